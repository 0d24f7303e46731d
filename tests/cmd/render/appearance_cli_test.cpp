// SPDX-License-Identifier: Apache-2.0
// Tests the options --variant, --transmission, --environment and --environment-rotation.
#include <gtest/gtest.h>

#include <fstream>

#include "cmd/tiny_gltf.h"
#include "formats/exr/exr_readers.h"
#include "support/capture.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// Returns a wall of white glass with the variants "red" and "green", seen by the camera "front".
nlohmann::json glassScene() {
    nlohmann::json scene = stackScene(1);
    scene["materials"] = nlohmann::json::parse(R"([
        {"name": "glass", "doubleSided": true, "pbrMetallicRoughness": {"metallicFactor": 0},
         "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.75}}},
        {"name": "red", "doubleSided": true, "extensions": {"KHR_materials_unlit": {}},
         "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}},
        {"name": "green", "doubleSided": true, "extensions": {"KHR_materials_unlit": {}},
         "pbrMetallicRoughness": {"baseColorFactor": [0, 1, 0, 1]}}])");
    scene["extensionsUsed"] = {"KHR_materials_transmission", "KHR_materials_variants",
                               "KHR_materials_unlit"};
    scene["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "red"}},
                                                                 {{"name", "green"}}};
    scene["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] = {
        {{"material", 1}, {"variants", {0}}}, {{"material", 2}, {"variants", {1}}}};
    return scene;
}

class Appearance : public testing::Test {
  protected:
    /// Returns the nearest layer of the middle pixel, rendered with these options.
    glm::vec4 rendered(const std::vector<std::string>& options) {
        const auto result = run(options);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        ExrLdiReader reader(folder_ / "out.exr");
        settings_hash_ = reader.info().provenance.settings_hash;
        LayeredImage image;
        reader.read({0, 0, 8, 8}, image);
        const std::size_t middle = image.pixelIndex(4, 4);
        EXPECT_EQ(image.count(middle), 1U);
        return color(image, image.offsets[middle]);
    }

    Outcome run(const std::vector<std::string>& options) {
        std::vector<std::string> command{"render",   scene_.string(), "-o",     folder_ / "out.exr",
                                         "--camera", "front",         "--size", "8x8"};
        command.insert(command.end(), options.begin(), options.end());
        return runPeeler(command);
    }

    /// Writes a Radiance picture of 4x2 pixels, red, green, green and blue in both rows; returns
    /// the path.
    std::string sky() {
        std::string text = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n";
        for (int row = 0; row < 2; ++row) {
            for (const int bright : {0, 1, 1, 2}) {
                std::string pixel(4, '\0');
                pixel[static_cast<std::size_t>(bright)] = static_cast<char>(0x80);
                // Exponent 0x82: a mantissa of 0x80 gives radiance 2.
                pixel[3] = static_cast<char>(0x82);
                text += pixel;
            }
        }
        std::ofstream(folder_ / "sky.hdr", std::ios::binary) << text;
        return folder_ / "sky.hdr";
    }

    ScratchDir folder_;
    std::filesystem::path scene_ = writeScene(folder_.path(), glassScene());
    std::string settings_hash_;
};

TEST_F(Appearance, TransmissionIsInAlphaUnlessItIsToBeOpaque) {
    EXPECT_NEAR(rendered({}).a, 0.25, 1e-3);
    const std::string usual = settings_hash_;
    EXPECT_NEAR(rendered({"--transmission", "alpha"}).a, 0.25, 1e-3);
    EXPECT_EQ(settings_hash_, usual);
    EXPECT_EQ(rendered({"--transmission", "opaque"}).a, 1);
    EXPECT_NE(settings_hash_, usual);
}

TEST_F(Appearance, VariantsAreChosenByNameOrIndex) {
    EXPECT_EQ(rendered({"--variant", "red"}), glm::vec4(1, 0, 0, 1));
    const std::string red = settings_hash_;
    EXPECT_EQ(rendered({"--variant", "0"}), glm::vec4(1, 0, 0, 1));
    EXPECT_EQ(settings_hash_, red);
    EXPECT_EQ(rendered({"--variant", "green"}), glm::vec4(0, 1, 0, 1));
    EXPECT_NE(settings_hash_, red);
}

TEST_F(Appearance, UnknownVariantsAreRefusedWithTheList) {
    const auto result = run({"--variant", "gren"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("unknown variant: --variant gren"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("did you mean 'green'?"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("red, green; or give an index from 0 to 1"), std::string::npos);
    const std::filesystem::path none = writeScene(folder_.path(), stackScene(1));
    scene_ = none;
    EXPECT_NE(run({"--variant", "red"}).err.find("there are no variants"), std::string::npos);
}

TEST_F(Appearance, InfoListsTheVariants) {
    const auto text = runPeeler({"info", scene_.string()});
    EXPECT_NE(text.out.find("variants:\n  0  red\n  1  green\n"), std::string::npos) << text.out;
    const auto json = nlohmann::json::parse(runPeeler({"info", scene_.string(), "--json"}).out);
    EXPECT_EQ(json["variants"], nlohmann::json({"red", "green"}));
}

TEST_F(Appearance, AnEnvironmentLightsTheScene) {
    const std::vector<std::string> options{"--environment", sky(), "--transmission", "opaque"};
    // The wall faces +Z, the green middle of the environment. Some light comes from both sides of
    // the middle.
    const glm::vec4 ahead = rendered(options);
    const std::string hash = settings_hash_;
    EXPECT_GT(ahead.g, 3 * ahead.r);
    EXPECT_NEAR(ahead.r, ahead.b, 0.01F);
    EXPECT_NEAR(ahead.r + ahead.g + ahead.b, 2, 0.02F);
    auto turned = options;
    turned.insert(turned.end(), {"--environment-rotation", "90"});
    const glm::vec4 aside = rendered(turned);
    EXPECT_NE(settings_hash_, hash);
    // The wall now faces the former −X, which is half green and half blue. The wall also receives
    // some red from beyond the blue.
    EXPECT_NEAR(aside.g, aside.b + aside.r, 0.02F);
    EXPECT_LT(aside.r, 0.3F);
    turned.back() = "360";
    EXPECT_EQ(rendered(turned), ahead);
    EXPECT_EQ(settings_hash_, hash);
}

TEST_F(Appearance, AStudioIsBuiltIn) {
    const glm::vec4 usual = rendered({"--transmission", "opaque"});
    const std::string usual_hash = settings_hash_;
    const glm::vec4 lit = rendered({"--transmission", "opaque", "--environment", "studio"});
    const std::string lit_hash = settings_hash_;
    EXPECT_GT(glm::distance(usual, lit), 0.05F);
    EXPECT_NE(lit_hash, usual_hash);
    const glm::vec4 turned = rendered(
        {"--transmission", "opaque", "--environment", "studio", "--environment-rotation", "180"});
    EXPECT_GT(glm::distance(turned, lit), 0.02F);
    EXPECT_NE(lit_hash, settings_hash_);
    // "studio" is a built-in name; a file with this name needs a path.
    const auto file = run({"--environment", "./studio"});
    EXPECT_EQ(file.exit_code, 3);
    EXPECT_NE(file.err.find("./studio"), std::string::npos) << file.err;
}

TEST_F(Appearance, TheBackgroundIsNotTheEnvironment) {
    const auto result =
        runPeeler({"render", scene_.string(), "-o", folder_ / "out.png", "--camera", "front",
                   "--size", "8x8", "--environment", sky(), "--exposure", "1", "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(Appearance, PicturesForEyesAreInTheStudio) {
    const auto settings = [&](const std::string& name, std::vector<std::string> more) {
        more.insert(more.begin(), {"render", scene_.string(), "-o", folder_ / name, "--camera",
                                   "front", "--size", "8x8", "--samples", "1", "--json"});
        return Json::parse(runPeeler(more).out).at("settingsHash");
    };
    const Json studio = settings("out.png", {"--environment", "studio"});
    const Json none = settings("out.png", {"--environment", "none"});
    EXPECT_NE(studio, none);
    EXPECT_EQ(settings("out.png", {}), studio);
    EXPECT_EQ(settings("out.html", {}), studio);
    EXPECT_EQ(settings("out.exr", {}), none);
    // Shadows need the built-in light, so --shadows implies --environment none.
    EXPECT_EQ(settings("out.png", {"--shadows"}),
              settings("out.png", {"--shadows", "--environment", "none"}));
    EXPECT_EQ(run({"--environment", "none", "--environment-rotation", "5"}).exit_code, 2);
}

TEST_F(Appearance, WrongEnvironmentsAreErrors) {
    EXPECT_EQ(run({"--environment", folder_ / "missing.hdr"}).exit_code, 3);
    EXPECT_EQ(run({"--environment", scene_.string()}).exit_code, 3);
    const auto lonely = run({"--environment-rotation", "5"});
    EXPECT_EQ(lonely.exit_code, 2);
    EXPECT_NE(lonely.err.find("add --environment"), std::string::npos) << lonely.err;
    EXPECT_EQ(run({"--environment", sky(), "--environment-rotation", "east"}).exit_code, 2);
    EXPECT_EQ(run({"--transmission", "glass"}).exit_code, 2);
}

TEST_F(Appearance, NothingCastsShadowsInAnEnvironmentAlone) {
    const auto result = run({"--environment", sky(), "--shadows"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find("casts no shadows"), std::string::npos) << result.err;
    EXPECT_EQ(run({"--environment", sky(), "--camera", "light:key"}).exit_code, 2);
}

TEST_F(Appearance, SheetsTakeTheSameOptions) {
    const auto result = runPeeler({"sheet", scene_.string(), "-o", folder_ / "sheet.png",
                                   "--camera", "front", "--size", "32x32", "--environment", sky(),
                                   "--variant", "green", "--transmission", "opaque"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    rendered({});
    const auto of_file = runPeeler(
        {"sheet", folder_ / "out.exr", "-o", folder_ / "sheet.png", "--variant", "green"});
    EXPECT_EQ(of_file.exit_code, 2);
}

}  // namespace
}  // namespace peeler::test
