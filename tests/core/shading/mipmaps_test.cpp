// SPDX-License-Identifier: Apache-2.0
#include "core/shading/materials.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "core/base/color.h"

namespace peeler {
namespace {

Image image(int width, int height, std::vector<std::uint8_t> grey) {
    Image result;
    result.width = width;
    result.height = height;
    for (const auto g : grey)
        result.rgba.insert(result.rgba.end(), {g, g, g, g});
    return result;
}

TEST(Mipmaps, ChainsReachOneTexel) {
    EXPECT_EQ(mipmapLevels(1, 1), 1);
    EXPECT_EQ(mipmapLevels(256, 256), 9);
    EXPECT_EQ(mipmapLevels(5, 3), 3);
    EXPECT_EQ(mipmapLevels(1, 1024), 11);
}

TEST(Mipmaps, ColoursAreAveragedAsLightAndAlphaAsItIs) {
    const Image small = halved(image(2, 2, {0, 255, 255, 0}), true);
    ASSERT_EQ(small.rgba.size(), 4U);
    EXPECT_EQ(small.rgba[0], 188) << "half the light is 188 in sRGB";
    EXPECT_EQ(small.rgba[3], 128);
    EXPECT_EQ(halved(image(2, 2, {0, 255, 255, 0}), false).rgba[0], 128);
}

TEST(Mipmaps, OddSizesWeighWhatTheyCover) {
    // Five texels are reduced to two. Each of the two covers 2.5 of the five.
    const Image small = halved(image(5, 1, {10, 20, 30, 40, 50}), false);
    ASSERT_EQ(small.width, 2);
    EXPECT_EQ(small.rgba[0], 18);  // (10 + 20 + 15) / 2.5
    EXPECT_EQ(small.rgba[4], 42);  // (15 + 40 + 50) / 2.5
}

TEST(Mipmaps, EvenSizesAreMeansOfFour) {
    std::mt19937 dice(1);
    for (int i = 0; i < 3000; ++i) {
        Image even;
        even.width = even.height = 2;
        for (int byte = 0; byte < 16; ++byte)
            even.rgba.push_back(static_cast<std::uint8_t>(dice() % 256));
        for (const bool srgb : {false, true}) {
            std::array<double, 4> sum{};
            for (std::size_t byte = 0; byte < 16; ++byte) {
                const float value = static_cast<float>(even.rgba[byte]) / 255;
                sum[byte % 4] += srgb && byte % 4 < 3 ? linearFromSrgb(value) : value;
            }
            const Image small = halved(even, srgb);
            for (std::size_t c = 0; c < 4; ++c) {
                const auto step = static_cast<float>(std::floor(sum[c] * 1024 + 0.5)) / 4096;
                const float expected = srgb && c < 3 ? srgbFromLinear(step) : step;
                EXPECT_EQ(small.rgba[c], std::lround(255 * expected)) << i;
            }
        }
    }
}

TEST(Mipmaps, AConstantStaysConstant) {
    for (int value = 0; value < 256; ++value) {
        const Image small = halved(
            image(3, 3, std::vector<std::uint8_t>(9, static_cast<std::uint8_t>(value))), true);
        EXPECT_NEAR(small.rgba[0], value, value < 30 ? 1 : 0) << value;
        EXPECT_EQ(small.rgba[3], value);
    }
}

}  // namespace
}  // namespace peeler
