// SPDX-License-Identifier: Apache-2.0
// Tests pictures for display: defaults, exposure metering, and outputs that stay linear.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "core/base/color.h"
#include "formats/image/flat_image.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Returns a white wall in sunlight of 5000 lux, and a camera that looks at it.
Json sunlitWall() {
    Json scene = stackScene(1);
    scene["materials"][0] = {{"doubleSided", true},
                             {"pbrMetallicRoughness", {{"metallicFactor", 0}}}};
    scene["extensionsUsed"] = {"KHR_lights_punctual"};
    scene["extensions"]["KHR_lights_punctual"]["lights"] =
        Json::parse(R"([{"type": "directional", "name": "sun", "intensity": 5000}])");
    scene["scenes"][0]["nodes"].push_back(scene["nodes"].size());
    scene["nodes"].push_back({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    return scene;
}

class ForEyes : public testing::Test {
  protected:
    Outcome peeler(std::vector<std::string> arguments) const {
        const Outcome outcome = runPeeler(arguments);
        EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
        return outcome;
    }
    /// Renders the sunlit wall; returns the JSON result.
    Json render(const std::string& name, std::vector<std::string> more) const {
        more.insert(more.begin(), {"render", lit_.string(), "-o", scratch_ / name, "--size",
                                   "48x32", "--json", "--samples", "1"});
        return Json::parse(peeler(more).out);
    }
    std::string bytes(const std::string& name) const { return bytesOf(scratch_ / name); }

    ScratchDir scratch_;
    fs::path lit_ = writeScene(scratch_.path(), sunlitWall());
    fs::path glasses_ = sourceDir() / "examples" / "scenes" / "glasses.glb";
};

TEST_F(ForEyes, HaveFourSamplesAndTheNeutralToneMap) {
    const auto result = [&](const std::string& name, std::vector<std::string> more) {
        more.insert(more.begin(), {"render", glasses_.string(), "-o", scratch_ / name, "--size",
                                   "32x18", "--json"});
        return Json::parse(peeler(more).out);
    };
    for (const char* name : {"a.png", "a.jpg", "a.tif"}) {
        const Json found = result(name, {});
        EXPECT_EQ(found["samples"], 4) << name;
        EXPECT_EQ(found["toneMap"], "neutral") << name;
        EXPECT_EQ(found["exposure"], 0) << name;
        EXPECT_EQ(found["exposureAutomatic"], false) << name;
    }
    result("b.png", {"--samples", "4", "--tone-map", "neutral", "--exposure", "0"});
    EXPECT_EQ(bytes("b.png").size(), bytes("a.png").size());
    EXPECT_EQ(result("c.png", {"--samples", "2"})["samples"], 2);
    EXPECT_EQ(result("c.png", {"--fxaa"})["samples"], 1);
    EXPECT_EQ(result("c.html", {})["samples"], 1);
    for (const char* kind : {"ldi", "deep", "composite"}) {
        const Json found = result("a.exr", {"--as", kind});
        EXPECT_EQ(found["samples"], 1) << kind;
        EXPECT_FALSE(found.contains("toneMap")) << kind;
    }
}

/// Three opaque walls fill 8 x 8 pixels. Only the first is visible, in each of the four samples.
TEST_F(ForEyes, SayHowTheyWereLitAndCountAsLayersDo) {
    Json scene = stackScene(3);
    scene["materials"][0].erase("alphaMode");
    const std::string walls = writeScene(scratch_.path(), scene).string();
    const auto said = [&](const std::string& name, std::vector<std::string> more) {
        more.insert(more.begin(), {"render", walls, "-o", scratch_ / name, "--size", "8x8"});
        return peeler(more).err;
    };
    const auto expect = [](const std::string& text, const std::string& part) {
        EXPECT_TRUE(contains(text, part)) << part << " is not in\n" << text;
    };
    expect(said("a.png", {}),
           "a.png: 1 layer, 64 visible fragments, camera front (cuts the scene off; --camera auto "
           "shows all of it), studio light, 4 samples (as in an "
           "EXR: --environment none --samples 1), ");
    expect(said("b.png", {"--environment", "none", "--samples", "1"}),
           "b.png: 1 layer, 64 visible fragments, camera front (cuts the scene off; --camera auto "
           "shows all of it), key light, 1 sample, ");
    expect(said("c.exr", {}), "c.exr: 3 layers, 192 fragments, camera front (cuts ");
    const std::string views = said("@.png", {"--views", "2"});
    expect(views, "0000.png: ");
    EXPECT_EQ(views.find("as in an EXR"), views.rfind("as in an EXR")) << "once a run\n" << views;
    expect(said("d.png", {"--shading", "unlit", "--samples", "2"}), ", unlit, 2 samples, ");
    scene = sunlitWall();
    writeScene(scratch_.path(), scene);
    expect(said("e.png", {}), ", the scene's lights, 4 samples (as in an EXR: --samples 1), ");
}

TEST_F(ForEyes, AreExposedForLampsAndSayByHowMuch) {
    const Json found = render("a.png", {});
    EXPECT_EQ(found["exposureAutomatic"], true);
    // A white dielectric reflects 5000/π·0.96 and some light of the sky. Metering scales it to at
    // least √0.18 of white.
    EXPECT_NEAR(found["exposure"].get<double>(), std::log2(std::sqrt(0.18) / (5000 / 3.1416)),
                0.25);
    const FlatImage picture = readFlatImage(scratch_ / "a.png");
    EXPECT_NEAR(picture.image.rgba[48 * 16 + 24][1], std::sqrt(0.18), 0.06);
    // Specifying the metered exposure gives the same picture; exposure 0 does not scale the light.
    const Json given = render("b.png", {"--exposure", found["exposure"].dump()});
    EXPECT_EQ(given["exposureAutomatic"], false);
    EXPECT_EQ(readFlatImage(scratch_ / "b.png").image.rgba, picture.image.rgba);
    render("c.png", {"--exposure", "0", "--tone-map", "none"});
    EXPECT_EQ(readFlatImage(scratch_ / "c.png").image.rgba[48 * 16 + 24][1], 1);
    EXPECT_EQ(render("d.png", {"--shading", "unlit"})["exposureAutomatic"], false);
}

TEST_F(ForEyes, TilesAndCropsAreExposedAlike) {
    const Json whole = render("a.png", {});
    EXPECT_EQ(render("b.png", {"--tile", "2/3"})["exposure"], whole["exposure"]);
    EXPECT_EQ(render("c.png", {"--crop", "0,0,1,1"})["exposure"], whole["exposure"]);
    EXPECT_EQ(render("d.png", {"--method", "two-pass"})["exposure"], whole["exposure"]);
}

TEST_F(ForEyes, FramesAreExposedAlikeWhicheverAreAsked) {
    const Json all = render("a.#.png", {"--frames", "0-2"});
    ASSERT_EQ(all["frames"].size(), 3U);
    for (const Json& frame : all["frames"])
        EXPECT_EQ(frame["exposure"], all["frames"][0]["exposure"]);
    EXPECT_EQ(render("b.#.png", {"--frames", "2"})["frames"][0]["exposure"],
              all["frames"][0]["exposure"]);
}

TEST_F(ForEyes, LayersOfLampsAreMeteredFromTheFile) {
    render("a.exr", {});
    const Json flat = Json::parse(
        peeler({"flatten", scratch_ / "a.exr", "-o", scratch_ / "a.png", "--json"}).out);
    EXPECT_EQ(flat["exposureAutomatic"], true);
    EXPECT_NEAR(flat["exposure"].get<double>(), render("b.png", {})["exposure"].get<double>(),
                0.11);
    const Json sheet = Json::parse(
        peeler({"sheet", scratch_ / "a.exr", "-o", scratch_ / "sheet.png", "--json"}).out);
    EXPECT_NEAR(sheet["exposure"].get<double>(), flat["exposure"].get<double>(), 0.11);
    const Json page =
        Json::parse(peeler({"view", scratch_ / "a.exr", "-o", scratch_ / "a.html", "--json"}).out);
    EXPECT_EQ(page["exposure"], flat["exposure"]);
    // The exposure stays 0 if no light exceeds the displayable range. It also stays 0 for crops,
    // which are never metered.
    peeler({"render", glasses_.string(), "-o", scratch_ / "g.exr", "--size", "32x18"});
    EXPECT_EQ(
        Json::parse(peeler({"flatten", scratch_ / "g.exr", "-o", scratch_ / "g.png", "--json"})
                        .out)["exposure"],
        0);
    render("part.exr", {"--crop", "0,0,16,16"});
    EXPECT_EQ(Json::parse(
                  peeler({"flatten", scratch_ / "part.exr", "-o", scratch_ / "part.png", "--json"})
                      .out)["exposure"],
              0);
}

TEST_F(ForEyes, DryRunsTellWhatWillBeDone) {
    const Json plan = render("a.png", {"--dry-run"})["pictures"][0];
    EXPECT_EQ(plan["samples"], 1);
    EXPECT_EQ(plan["toneMap"], "neutral");
    EXPECT_TRUE(plan["exposure"].is_null());
    EXPECT_EQ(plan["exposureAutomatic"], true);
    EXPECT_EQ(render("a.png", {"--dry-run", "--exposure", "-2"})["pictures"][0]["exposure"], -2);
    EXPECT_FALSE(render("a.exr", {"--dry-run"})["pictures"][0].contains("toneMap"));
}

TEST_F(ForEyes, BackgroundsKeepTheirDigits) {
    for (const char* tone_map : {"none", "neutral", "aces"}) {
        render("a.png", {"--background", "#888888", "--exposure", "-4", "--tone-map", tone_map,
                         "--eye", "0,0,9", "--target", "0,0,10"});  // looks away from the wall
        const FlatImage picture = readFlatImage(scratch_ / "a.png");
        for (const auto& pixel : picture.image.rgba)
            ASSERT_NEAR(pixel[0], linearFromSrgb(136.0F / 255), 1e-6);
    }
}

TEST_F(ForEyes, SkippedOnlyIfMeteredAlike) {
    render("a.png", {});
    const auto again = [&](std::vector<std::string> more) {
        more.insert(more.begin(), "--skip-existing");
        return render("a.png", more).contains("skipped");
    };
    EXPECT_TRUE(again({}));
    EXPECT_FALSE(again({"--exposure", "0"}));
}

}  // namespace
}  // namespace peeler::test
