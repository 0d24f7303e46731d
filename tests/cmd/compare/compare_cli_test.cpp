// SPDX-License-Identifier: Apache-2.0
// Tests peeler compare: known differences give known numbers and exit codes.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/color.h"
#include "formats/exr/exr_writers.h"
#include "formats/exr/synthetic_image.h"
#include "formats/image/flat_image.h"
#include "formats/writers.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

class CompareCommand : public testing::Test {
  protected:
    /// Writes a layered file of random fragments, modified by `change`. Returns the path.
    std::string write(const std::string& name,
                      const std::function<void(SyntheticPicture&)>& change = {}) const {
        SyntheticOptions options;
        options.color_type = PixelType::kFloat;
        SyntheticPicture picture = makePicture(options);
        if (change) change(picture);
        ExrLdiWriter writer(path(name));
        writePicture(writer, picture);
        return path(name);
    }
    std::string path(const std::string& name) const { return (scratch_ / name).string(); }

    static Outcome compare(std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), "compare");
        return runPeeler(arguments);
    }
    static Json json(std::vector<std::string> arguments) {
        arguments.emplace_back("--json");
        return Json::parse(compare(arguments).out);
    }

    ScratchDir scratch_;
};

/// Adds `amount` to all red values, which are a quarter of all values.
void addRed(SyntheticPicture& picture, float amount) {
    auto colors = picture.image.color.as<float>();
    for (std::size_t i = 0; i < colors.size(); i += 4)
        colors[i] += amount;
}

/// Removes the last fragment of each of the first `pixels` pixels that have two fragments, and
/// corrects the plan.
void dropFragments(SyntheticPicture& picture, int pixels) {
    LayeredImage& image = picture.image;
    for (std::size_t p = 0; p < image.window.pixels() && pixels > 0; ++p) {
        if (image.count(p) != 2) continue;
        const std::size_t last = image.offsets[p + 1] - 1U;
        image.z.erase(image.z.begin() + static_cast<std::ptrdiff_t>(last));
        const auto stride = static_cast<std::ptrdiff_t>(image.color.stride());
        const auto first = image.color.data.begin() + static_cast<std::ptrdiff_t>(last) * stride;
        image.color.data.erase(first, first + stride);
        for (std::size_t q = p + 1; q < image.offsets.size(); ++q)
            --image.offsets[q];
        --pixels;
    }
    ASSERT_EQ(pixels, 0);
    picture.plan.fragments_counted = picture.plan.fragments_stored = image.fragments();
}

TEST_F(CompareCommand, AFileIsIdenticalToItself) {
    const std::string a = write("a.exr");
    const Outcome result = compare({a, a});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.out.find("identical\n"), std::string::npos) << result.out;
    EXPECT_EQ(result.err, "");
    const Json found = json({a, a});
    EXPECT_EQ(found.at("identical"), true);
    EXPECT_EQ(found.at("fragments").at("color").at("psnr"), "inf");
    EXPECT_EQ(found.at("layers").size(), 7U);
    const Outcome quiet = compare({a, a, "-q"});
    EXPECT_EQ(quiet.out + quiet.err, "");
}

TEST_F(CompareCommand, AKnownColorOffsetGivesKnownNumbers) {
    const std::string a = write("a.exr");
    const std::string b = write("b.exr", [](auto& picture) { addRed(picture, 0.25F); });
    const Outcome result = compare({a, b});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.err.find("peeler: error: beyond --max-color 0: "), std::string::npos);
    EXPECT_EQ(result.err.find("--max-depth"), std::string::npos) << result.err;
    const Json found = json({a, b});
    EXPECT_EQ(found.at("identical"), false);
    EXPECT_EQ(found.at("within"), false);
    EXPECT_EQ(found.at("countPixels"), 0);
    const Json& color = found.at("fragments").at("color");
    EXPECT_NEAR(color.at("max"), 0.25, 1e-6);
    EXPECT_NEAR(color.at("mean"), 0.0625, 1e-6);
    EXPECT_NEAR(color.at("rmse"), 0.125, 1e-6);
    EXPECT_NEAR(color.at("psnr"), 18.0618, 1e-3);
    EXPECT_EQ(found.at("fragments").at("depth").at("max"), 0);
    EXPECT_NEAR(found.at("layers").at(3).at("color").at("rmse"), 0.125, 1e-6);
}

TEST_F(CompareCommand, ThresholdsAreLimitsOfTheExitCode) {
    const std::string a = write("a.exr");
    const std::string b = write("b.exr", [](auto& picture) {
        addRed(picture, 0.25F);
        for (float& z : picture.image.z)
            z += 0.125F;
    });
    struct Row {
        std::vector<std::string> thresholds;
        int exit_code;
    };
    const Row rows[] = {{{"--max-color", "0.26"}, 1},  // fails, because --max-depth is 0 by default
                        {{"--max-depth", "0.126"}, 1},
                        {{"--max-depth", "0.126", "--max-color", "0.26"}, 0},
                        {{"--max-depth", "0.126", "--max-color", "0.24"}, 1},
                        {{"--max-depth", "0.124", "--max-color", "0.26"}, 1},
                        {{"--max-depth", "inf", "--max-rmse", "0.126"}, 0},
                        {{"--max-depth", "inf", "--max-rmse", "0.124"}, 1},
                        {{"--max-depth", "inf", "--min-psnr", "18"}, 0},
                        {{"--max-depth", "inf", "--min-psnr", "18.1"}, 1},
                        {{"--max-depth", "inf", "--min-psnr", "18", "--max-color", "0.1"}, 1}};
    for (const Row& row : rows) {
        std::vector<std::string> arguments{a, b};
        arguments.insert(arguments.end(), row.thresholds.begin(), row.thresholds.end());
        const Outcome result = compare(arguments);
        EXPECT_EQ(result.exit_code, row.exit_code) << testing::PrintToString(row.thresholds);
        EXPECT_EQ(result.err.empty(), row.exit_code == 0) << result.err;
    }
}

TEST_F(CompareCommand, CountsMayDifferInSoManyPixels) {
    const std::string a = write("a.exr");
    const std::string b = write("b.exr", [](auto& picture) { dropFragments(picture, 3); });
    EXPECT_EQ(compare({a, b}).exit_code, 1);
    EXPECT_EQ(compare({a, b, "--max-count", "2"}).exit_code, 1);
    EXPECT_EQ(compare({a, b, "--max-count", "3"}).exit_code, 0);
    const Json found = json({a, b});
    EXPECT_EQ(found.at("countPixels"), 3);
    EXPECT_EQ(found.at("largestCount"), 1);
    EXPECT_EQ(found.at("fragments").at("onlyA"), 3);
    EXPECT_EQ(found.at("fragments").at("onlyB"), 0);
    EXPECT_EQ(found.at("layers").at(1).at("onlyA"), 3);
    EXPECT_EQ(json({b, a}).at("fragments").at("onlyB"), 3);
}

TEST_F(CompareCommand, NanOnOneSideIsBeyondEveryFiniteThreshold) {
    const std::string a = write("a.exr");
    const std::string b = write("b.exr", [](auto& picture) {
        picture.image.color.template as<float>()[40] = std::nanf("");
    });
    EXPECT_EQ(compare({a, b, "--max-color", "1e30"}).exit_code, 1);
    EXPECT_EQ(compare({b, b}).exit_code, 0);
    EXPECT_EQ(json({a, b}).at("fragments").at("color").at("max"), "inf");
}

TEST_F(CompareCommand, FlatImagesAgainstLayers) {
    const std::string a = write("a.exr");
    ASSERT_EQ(runPeeler({"flatten", a, "-o", path("flat.exr")}).exit_code, 0);
    EXPECT_EQ(compare({a, path("flat.exr")}).exit_code, 0);
    // A TIFF clips the bright fragments, so the clipped part is the difference.
    ASSERT_EQ(runPeeler({"flatten", a, "-o", path("flat.tif")}).exit_code, 0);
    const Json clipped = json({a, path("flat.tif")});
    EXPECT_EQ(clipped.at("byLayer"), false);
    EXPECT_EQ(clipped.at("pixels"), 83 * 61);
    EXPECT_GT(clipped.at("composite").at("max"), 0.5);
    const std::string b = write("b.exr", [](auto& picture) { addRed(picture, 0.25F); });
    EXPECT_EQ(compare({path("flat.exr"), b, "--min-psnr", "60"}).exit_code, 1);
    EXPECT_EQ(json({a, b, "--composites"}).at("byLayer"), false);
}

/// Writes a flat picture of a single grey.
std::string writeGrey(const std::string& path, int width, int height, float grey) {
    CompositeImage picture;
    picture.window = {0, 0, width, height};
    picture.rgba.assign(picture.window.pixels(), {grey, grey, grey, 1});
    writePicture(path, picture, {});
    return path;
}

TEST_F(CompareCommand, FlatImagesAreComparedLinear) {
    // The encoded values 188 and 99 are 0.5029 and 0.1248 in linear light.
    const std::string a = writeGrey(path("a.png"), 8, 4, 0.5029F);
    const std::string b = writeGrey(path("b.png"), 8, 4, 0.1248F);
    const std::string c = writeGrey(path("c.exr"), 8, 4, 0.5029F);
    EXPECT_NEAR(json({a, b}).at("composite").at("max"), 0.3781, 2e-4);
    EXPECT_LT(json({a, c}).at("composite").at("max"), 2e-4);
    EXPECT_EQ(compare({a, a}).exit_code, 0);
}

TEST_F(CompareCommand, OtherSizesCannotBeCompared) {
    const std::string a = writeGrey(path("a.png"), 8, 4, 0.5F);
    const std::string b = writeGrey(path("b.png"), 8, 5, 0.5F);
    const Outcome result = compare({a, b});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.out, "");
    EXPECT_NE(result.err.find("8 x 4 and 8 x 5 pixels"), std::string::npos) << result.err;
}

TEST_F(CompareCommand, OtherCropsCannotBeCompared) {
    const auto cropped = [&](const std::string& name, const Window& crop) {
        SyntheticOptions options;
        options.crop = crop;
        ExrLdiWriter writer(path(name));
        writePicture(writer, makePicture(options));
        return path(name);
    };
    const std::string a = cropped("a.exr", {0, 0, 40, 40}), b = cropped("b.exr", {5, 0, 45, 40});
    const Outcome result = compare({a, b});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.err.find("crops"), std::string::npos) << result.err;
}

TEST_F(CompareCommand, WhatIsNoImageIsInvalidInput) {
    const std::string a = write("a.exr");
    EXPECT_EQ(compare({a, path("missing.exr")}).exit_code, 3);
    EXPECT_EQ(compare({a, (sourceDir() / "README.md").string()}).exit_code, 3);
    EXPECT_EQ(compare({a, a, "--heatmap-max", "1"}).exit_code, 2);
    EXPECT_EQ(compare({a, a, "--heatmap", a}).exit_code, 2);
    EXPECT_EQ(compare({a, a, "--max-color", "-1"}).exit_code, 2);
    EXPECT_EQ(compare({a, a, "--max-color", "nan"}).exit_code, 2);
}

TEST_F(CompareCommand, TheHeatMapShowsWhere) {
    const std::string a = write("a.exr");
    std::size_t changed = 0, dropped = 0;
    const std::string b = write("b.exr", [&](SyntheticPicture& picture) {
        const LayeredImage before = picture.image;
        dropFragments(picture, 1);
        while (before.count(dropped) == picture.image.count(dropped))
            ++dropped;
        changed = dropped + 100;
        while (picture.image.count(changed) == 0)
            ++changed;
        picture.image.color.as<float>()[4U * picture.image.offsets[changed]] += 0.5F;
    });
    const Outcome result = compare(
        {a, b, "--heatmap", path("heat.png"), "--heatmap-max", "1", "--report", path("r.json")});
    EXPECT_NE(result.out.find("heat map: "), std::string::npos) << result.out;
    const Json report = Json::parse(bytesOf(path("r.json")));
    EXPECT_EQ(report.at("heatmap").at("colorMax"), 1);
    EXPECT_EQ(report.at("heatmap").at("countMax"), 1);
    const CompositeImage heat = readFlatImage(path("heat.png")).image;
    ASSERT_EQ(heat.window, (Window{0, 0, 83, 61}));
    const auto byteAt = [&](std::size_t pixel, std::size_t channel) {
        return std::lround(255 * srgbFromLinear(heat.rgba[pixel][channel]));
    };
    const auto expectColor = [&](std::size_t pixel, const std::array<long, 3>& bytes) {
        for (std::size_t c = 0; c < 3; ++c)
            EXPECT_EQ(byteAt(pixel, c), bytes[c]) << pixel << ' ' << c;
    };
    expectColor(changed, {188, 55, 84});    // the colour at the middle of the ramp
    expectColor(dropped, {110, 240, 255});  // cyan: the largest difference in fragment counts
    std::size_t black = 0;
    for (std::size_t p = 0; p < heat.rgba.size(); ++p)
        black += byteAt(p, 0) == 0 && byteAt(p, 1) == 0 && byteAt(p, 2) == 4 ? 1 : 0;
    EXPECT_EQ(black, heat.rgba.size() - 2);
}

TEST_F(CompareCommand, HeatMapIsScaledToTheLargestDifference) {
    const std::string a = write("a.exr");
    const std::string b = write("b.exr", [](auto& picture) { addRed(picture, 0.25F); });
    const Json found = json({a, b, "--heatmap", path("heat.png")});
    EXPECT_NEAR(found.at("heatmap").at("colorMax"), 0.25, 1e-6);
    EXPECT_EQ(found.at("heatmap").at("countMax"), 0);
}

}  // namespace
}  // namespace peeler::test
