// SPDX-License-Identifier: Apache-2.0
// Tests peeler render --fxaa on the engine of the examples.
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

class FxaaOfTheEngine : public testing::Test {
  protected:
    Outcome run(const std::string& name, const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{
            "render", (sourceDir() / "examples" / "scenes" / "engine.glb").string(), "-o",
            (scratch_ / name).string()};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return runPeeler(arguments);
    }

    fs::path render(const std::string& name, const std::vector<std::string>& more) const {
        const Outcome result = run(name, more);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return scratch_ / name;
    }

    ScratchDir scratch_;
};

OIIO::ImageBuf colorsOf(const fs::path& path) {
    OIIO::ImageBuf image(path.string());
    EXPECT_TRUE(image.read(0, 0, true, OIIO::TypeDesc::FLOAT)) << image.geterror();
    return OIIO::ImageBufAlgo::channels(image, 4, {}, {}, {"R", "G", "B", "A"});
}

TEST_F(FxaaOfTheEngine, ComesNearerToManySamples) {
    const std::vector<std::string> small{"--as", "composite", "--size", "320x180"};
    auto smooth = small;
    smooth.emplace_back("--fxaa");
    const OIIO::ImageBuf aliased = colorsOf(render("a.exr", small));
    const OIIO::ImageBuf filtered = colorsOf(render("f.exr", smooth));
    const OIIO::ImageBuf large =
        colorsOf(render("l.exr", {"--as", "composite", "--size", "2560x1440"}));
    const OIIO::ImageBuf reference =
        OIIO::ImageBufAlgo::resize(large, "box", 0, OIIO::ROI(0, 320, 0, 180));
    const auto rms = [&](const OIIO::ImageBuf& image) {
        return OIIO::ImageBufAlgo::compare(image, reference, 1, 1).rms_error;
    };
    const double before = rms(aliased), after = rms(filtered);
    std::printf("RMS distance to 64 samples: %.4f without, %.4f with\n", before, after);
    EXPECT_LT(after, 0.8 * before);
}

TEST_F(FxaaOfTheEngine, IsTheSameOfTheLayersInAFile) {
    const std::vector<std::string> size{"--size", "640x360"};
    auto at_once = size;
    at_once.insert(at_once.end(), {"--as", "composite", "--fxaa"});
    const OIIO::ImageBuf expected = colorsOf(render("f.exr", at_once));
    const fs::path layers = render("layers.exr", size);
    for (const bool fxaa : {false, true}) {
        std::vector<std::string> arguments{"flatten", layers, "-o", scratch_ / "flat.exr"};
        if (fxaa) arguments.emplace_back("--fxaa");
        const Outcome result = runPeeler(arguments);
        ASSERT_EQ(result.exit_code, 0) << result.err;
        const auto compared =
            OIIO::ImageBufAlgo::compare(colorsOf(scratch_ / "flat.exr"), expected, 1e-6F, 1e-6F);
        EXPECT_EQ(compared.maxerror < 1e-6, fxaa) << compared.maxerror;
    }
}

TEST_F(FxaaOfTheEngine, WorksForEveryFlatFormat) {
    for (const char* name : {"a.png", "a.jpg", "a.tif"}) {
        const std::string plain = bytesOf(render(name, {"--size", "200x150", "--samples", "1"}));
        EXPECT_NE(bytesOf(render(name, {"--size", "200x150", "--fxaa"})), plain) << name;
    }
}

TEST_F(FxaaOfTheEngine, HasAHashOfItsOwn) {
    const auto hash = [&](const fs::path& path) {
        return Json::parse(runPeeler({"info", "--json", path.string()}).out)
            .at("attributes")
            .at("peeler:settingsHash");
    };
    const std::vector<std::string> plain{"--as", "composite", "--size", "64x48"};
    auto smooth = plain;
    smooth.emplace_back("--fxaa");
    EXPECT_NE(hash(render("a.exr", plain)), hash(render("b.exr", smooth)));
}

TEST_F(FxaaOfTheEngine, IsRefusedForWhatIsNoPicture) {
    for (const std::vector<std::string>& more :
         {std::vector<std::string>{"--fxaa"}, {"--fxaa", "--as", "midpoint-depth"}}) {
        const Outcome result = run("a.exr", more);
        EXPECT_EQ(result.exit_code, 2);
        for (const char* part : {"--fxaa", "--as composite", "--samples"})
            EXPECT_NE(result.err.find(part), std::string::npos) << part << " not in " << result.err;
        EXPECT_TRUE(fs::is_empty(scratch_.path()));
    }
}

}  // namespace
}  // namespace peeler::test
