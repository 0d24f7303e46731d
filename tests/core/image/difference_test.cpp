// SPDX-License-Identifier: Apache-2.0
// Tests differences against analytic answers.
#include "core/image/difference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/color.h"
#include "formats/exr/synthetic_image.h"
#include "support/numbers.h"

namespace peeler {
namespace {

using test::kInfinity;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

LayeredImage floatPicture() {
    test::SyntheticOptions options;
    options.seed = 3;
    options.color_type = PixelType::kFloat;
    return test::makePicture(options).image;
}

LayeredDifference between(const LayeredImage& a, const LayeredImage& b) {
    LayeredDifference sum;
    addDifference(a, b, sum);
    return sum;
}

/// Returns one row of pixels, given as lists of fragments. Each number is the Z of a fragment and
/// the value of all its channels.
LayeredImage rowOfValues(const std::vector<std::vector<float>>& lists) {
    LayeredImage image;
    image.window = {0, 0, static_cast<int>(lists.size()), 1};
    image.color = {{"R", "G", "B", "A"}, PixelType::kFloat, {}};
    image.offsets = {0};
    for (const auto& list : lists) {
        for (const float value : list) {
            image.z.push_back(value);
            for (int c = 0; c < 4; ++c)
                test::appendValue(image.color.data, value);
        }
        image.offsets.push_back(static_cast<std::uint32_t>(image.z.size()));
    }
    return image;
}

TEST(Difference, OfAPictureFromItselfIsNothing) {
    const LayeredImage a = floatPicture();
    const LayeredDifference sum = between(a, a);
    EXPECT_EQ(sum.pixels, a.window.pixels());
    EXPECT_EQ(sum.count_pixels, 0U);
    EXPECT_EQ(sum.all.both, a.fragments());
    EXPECT_EQ(sum.all.only_a + sum.all.only_b, 0U);
    EXPECT_EQ(sum.all.depth.largest, 0);
    EXPECT_EQ(sum.all.color.rmse(), 0);
    EXPECT_EQ(sum.all.color.psnr(), kInfinity);
    EXPECT_EQ(sum.all.color.x, -1);
    EXPECT_EQ(sum.composite.largest, 0);
}

TEST(Difference, AKnownOffset) {
    const LayeredImage a = floatPicture();
    LayeredImage b = a;
    for (float& z : b.z)
        z += 0.5F;
    auto colors = b.color.as<float>();
    for (std::size_t i = 0; i < colors.size(); i += 4)
        colors[i] += 0.25F;  // only red changes: a quarter of the values
    const LayeredDifference sum = between(a, b);
    EXPECT_NEAR(sum.all.depth.largest, 0.5, 1e-6);
    EXPECT_NEAR(sum.all.depth.mean(), 0.5, 1e-6);
    EXPECT_NEAR(sum.all.depth.rmse(), 0.5, 1e-6);
    EXPECT_NEAR(sum.all.color.largest, 0.25, 1e-6);
    EXPECT_NEAR(sum.all.color.mean(), 0.0625, 1e-6);
    EXPECT_NEAR(sum.all.color.rmse(), 0.125, 1e-6);
    EXPECT_NEAR(sum.all.color.psnr(), 20 * std::log10(8), 1e-4);
    EXPECT_GT(sum.composite.largest, 0.2);
    for (const FragmentDifference& layer : sum.layers)
        EXPECT_NEAR(layer.color.rmse(), 0.125, 1e-6);
}

TEST(Difference, CountsAndLayers) {
    const LayeredImage a = rowOfValues({{1, 2, 3}, {}, {1}, {1, 2}});
    const LayeredImage b = rowOfValues({{1}, {5}, {1}, {1, 2.5}});
    LayeredDifference sum;
    std::vector<float> largest(4);
    addDifference(a, b, sum, largest);
    EXPECT_EQ(sum.count_pixels, 2U);
    EXPECT_EQ(sum.largest_count, 2U);
    ASSERT_EQ(sum.layers.size(), 3U);
    EXPECT_EQ(sum.layers[0].both, 3U);
    EXPECT_EQ(sum.layers[0].only_b, 1U);
    EXPECT_EQ(sum.layers[1].both, 1U);
    EXPECT_EQ(sum.layers[1].only_a, 1U);
    EXPECT_EQ(sum.layers[2].only_a, 1U);
    EXPECT_EQ(sum.all.only_a, 2U);
    EXPECT_EQ(sum.all.both, 4U);
    EXPECT_FLOAT_EQ(static_cast<float>(sum.layers[1].depth.largest), 0.5F);
    EXPECT_EQ(sum.layers[1].depth.x, 3);
    EXPECT_EQ(sum.layers[0].depth.largest, 0);
    EXPECT_EQ(largest, (std::vector<float>{-2, -1, 0, 0.5F}));
}

TEST(Difference, NanOnOneSideIsOne) {
    const LayeredImage a = rowOfValues({{1}, {1}}), b = rowOfValues({{1}, {1}});
    LayeredImage one = a, both = b;
    one.color.as<float>()[5] = kNan;
    both.color.as<float>()[5] = kNan;
    EXPECT_EQ(between(one, b).all.color.largest, kInfinity);
    EXPECT_EQ(between(b, one).all.color.largest, kInfinity);
    EXPECT_EQ(between(one, b).all.color.psnr(), -kInfinity);
    EXPECT_EQ(between(one, b).all.color.x, 1);
    EXPECT_EQ(between(one, both).all.color.largest, 0);
}

TEST(Difference, InfinitiesOfOneSignAreEqual) {
    constexpr float kInf = std::numeric_limits<float>::infinity();
    EXPECT_EQ(between(rowOfValues({{kInf}}), rowOfValues({{kInf}})).all.color.largest, 0);
    EXPECT_EQ(between(rowOfValues({{kInf}}), rowOfValues({{-kInf}})).all.color.largest, kInfinity);
    EXPECT_EQ(between(rowOfValues({{kInf}}), rowOfValues({{1}})).all.depth.largest, kInfinity);
}

TEST(Difference, HalfAgainstFloat) {
    test::SyntheticOptions options;
    options.color_type = PixelType::kHalf;
    const LayeredImage a = test::makePicture(options).image;
    options.color_type = PixelType::kFloat;
    const LayeredDifference sum = between(a, test::makePicture(options).image);
    EXPECT_EQ(sum.count_pixels, 0U);
    EXPECT_GT(sum.all.color.largest, 0);
    EXPECT_LE(sum.all.color.largest, 3.0 / 2048);  // at most half the spacing of halves below 4
}

TEST(Difference, BandsChangeNoBit) {
    const LayeredImage a = floatPicture();
    LayeredImage b = a;
    for (float& value : b.color.as<float>())
        value *= 1.01F;
    const LayeredDifference whole = between(a, b);
    LayeredDifference cut;
    for (int y = 0; y < a.window.y1; y += 7) {
        const int end = std::min(y + 7, a.window.y1);
        addDifference(test::cutRows(a, y, end), test::cutRows(b, y, end), cut);
    }
    EXPECT_EQ(cut.all.color.sum, whole.all.color.sum);
    EXPECT_EQ(cut.composite.sum_of_squares, whole.composite.sum_of_squares);
    EXPECT_EQ(cut.pixels, whole.pixels);
    EXPECT_EQ(cut.composite.y, whole.composite.y);
}

TEST(ColorRamp, EndsMiddleAndBeyond) {
    const auto bytes = [](const std::array<float, 3>& color) {
        std::array<long, 3> out{};
        for (std::size_t c = 0; c < 3; ++c)
            out[c] = std::lround(255 * srgbFromLinear(color[c]));
        return out;
    };
    EXPECT_EQ(bytes(inferno(0)), (std::array<long, 3>{0, 0, 4}));
    EXPECT_EQ(bytes(inferno(0.5F)), (std::array<long, 3>{188, 55, 84}));
    EXPECT_EQ(bytes(inferno(1)), (std::array<long, 3>{252, 255, 164}));
    EXPECT_EQ(inferno(9), inferno(1));
    EXPECT_EQ(inferno(-1), inferno(0));
    EXPECT_EQ(inferno(kNan), inferno(0));
    // This value is interpolated between two anchors.
    EXPECT_EQ(bytes(inferno(0.03125F)), (std::array<long, 3>{8, 3, 21}));
    float before = -1;
    for (int i = 0; i <= 100; ++i) {
        const auto [r, g, b] = inferno(static_cast<float>(i) / 100);
        const float light = 0.2126F * r + 0.7152F * g + 0.0722F * b;
        EXPECT_GT(light, before) << i;
        before = light;
    }
}

}  // namespace
}  // namespace peeler
