// SPDX-License-Identifier: Apache-2.0
// Tests the "over" operator against analytic answers.
#include <peeler/composite.h>

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/parallel.h"
#include "formats/exr/synthetic_image.h"
#include "support/numbers.h"

namespace peeler {
namespace {

using Rgba = std::array<float, 4>;
using test::kFloatInfinity;

/// Returns a row of pixels with these fragment lists.
LayeredImage rowOfLists(const std::vector<std::vector<Rgba>>& pixels,
                        PixelType type = PixelType::kFloat) {
    LayeredImage image;
    image.window = {4, 9, 4 + static_cast<int>(pixels.size()), 10};
    image.offsets = {0};
    image.color = {{"R", "G", "B", "A"}, type, {}};
    for (const auto& list : pixels) {
        for (const Rgba& color : list) {
            image.z.push_back(static_cast<float>(image.z.size()) + 2);
            for (const float value : color)
                test::appendColor(image.color, value);
        }
        image.offsets.push_back(static_cast<std::uint32_t>(image.z.size()));
    }
    return image;
}

TEST(Composite, KnownStacks) {
    const Rgba red = {0.5F, 0, 0, 0.5F}, green = {0, 0.25F, 0, 0.25F}, white = {1, 1, 1, 1};
    for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
        const LayeredImage image =
            rowOfLists({{}, {red}, {red, green}, {green, red, white, red}}, type);
        CompositeImage out;
        compositeOver(image, {}, out);
        EXPECT_EQ(out.window, image.window);
        EXPECT_EQ(out.rgba[0], (Rgba{}));
        EXPECT_EQ(out.rgba[1], red);
        EXPECT_EQ(out.rgba[2], (Rgba{0.5F, 0.125F, 0, 0.625F}));
        // Behind green, red adds 0.75·0.5 and opaque white adds 0.375. The last red is hidden.
        EXPECT_EQ(out.rgba[3], (Rgba{0.75F, 0.625F, 0.375F, 1}));
        EXPECT_EQ(out.z, (std::vector<float>{kFloatInfinity, 2, 3, 5}));
    }
}

TEST(Composite, BackgroundGoesLast) {
    CompositeImage out;
    compositeOver(rowOfLists({{}, {{0.25F, 0.25F, 0, 0.5F}}}), {0, 0.5F, 1, 1}, out);
    EXPECT_EQ(out.rgba[0], (Rgba{0, 0.5F, 1, 1}));
    EXPECT_EQ(out.rgba[1], (Rgba{0.25F, 0.5F, 0.5F, 1}));
    EXPECT_EQ(out.z[0], kFloatInfinity) << "the background is at no depth";
}

TEST(Composite, ManyEqualLayersFollowThePowerLaw) {
    constexpr float kAlpha = 0.1F;
    constexpr int kLayers = 60;
    CompositeImage out;
    compositeOver(rowOfLists({std::vector<Rgba>(kLayers, {kAlpha, 0, 0, kAlpha})}), {}, out);
    EXPECT_NEAR(out.rgba[0][3], 1 - std::pow(1 - kAlpha, kLayers), 1e-6);
    EXPECT_NEAR(out.rgba[0][0], out.rgba[0][3], 1e-6);
}

TEST(Composite, OrderOfOperationsIsTheDocumentedOne) {
    const auto picture = test::makePicture({.seed = 77});
    const LayeredImage& image = picture.image;
    CompositeImage out;
    compositeOver(image, {}, out);
    for (std::size_t p = 0; p < image.window.pixels(); ++p) {
        Rgba sum{};
        for (std::uint32_t f = image.offsets[p]; f < image.offsets[p + 1]; ++f) {
            // `volatile` prevents a fused multiply-add.
            volatile float rest = 1 - sum[3];
            for (std::size_t c = 0; c < 4; ++c) {
                half value;
                value.setBits(image.color.as<std::uint16_t>()[4 * f + c]);
                volatile float part = rest * static_cast<float>(value);
                sum[c] += part;
            }
        }
        ASSERT_EQ(out.rgba[p], sum) << "pixel " << p << ", seed 77";
    }
}

TEST(Composite, ThreadsChangeNothingAndStorageIsReused) {
    const auto picture = test::makePicture({.seed = 78});
    CompositeImage one, many;
    setThreadCount(1);
    compositeOver(picture.image, {}, one);
    setThreadCount(4);
    many.rgba.resize(100000);
    compositeOver(picture.image, {}, many);
    setThreadCount(0);
    EXPECT_EQ(one.rgba, many.rgba);
    EXPECT_EQ(one.z, many.z);
}

}  // namespace
}  // namespace peeler
