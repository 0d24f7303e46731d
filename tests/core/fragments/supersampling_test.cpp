// SPDX-License-Identifier: Apache-2.0
#include "core/fragments/supersampling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/image/composite.h"

namespace peeler {
namespace {

struct Fragment {
    float z;
    std::uint32_t surface;
    std::array<float, 4> rgba;
};

/// Returns a picture of one pixel, with the fragments of one sample. With coloured opacity, green
/// and blue have less of it.
LayeredImage pixelOfSample(const std::vector<Fragment>& fragments,
                           PixelType type = PixelType::kFloat, bool with_opacity = false) {
    LayeredImage image;
    image.window = {0, 0, 1, 1};
    image.offsets = {0, static_cast<std::uint32_t>(fragments.size())};
    image.color = {colorNames(with_opacity), type, {}};
    image.color.data.resize(fragments.size() * image.color.stride());
    image.extra.push_back({{kKeyChannel}, PixelType::kUint, {}});
    image.extra[0].data.resize(fragments.size() * 4);
    for (std::size_t i = 0; i < fragments.size(); ++i) {
        image.z.push_back(fragments[i].z);
        const auto& [r, g, b, a] = fragments[i].rgba;
        storeColor({r, g, b, with_opacity ? meanOpacity(a, a / 2, a / 4) : a, a, a / 2, a / 4},
                   image.color, i);
        image.extra[0].as<std::uint32_t>()[i] = fragments[i].surface;
    }
    return image;
}

LayeredImage merged(const std::vector<LayeredImage>& samples) {
    LayeredImage out;
    mergeSamples(
        samples, [](std::uint32_t primitive) { return primitive; }, PixelType::kFloat, out);
    return out;
}

constexpr std::array<float, 4> kRed = {1, 0, 0, 1}, kGreen = {0, 1, 0, 1},
                               kGlass = {0, 0, 0.25F, 0.5F};

TEST(Supersampling, PositionsAreOneInEveryStripOfBothAxes) {
    EXPECT_EQ(samplePositions(1)[0], glm::dvec2(0.5));
    for (const int n : {2, 4, 8, 64}) {
        std::vector<int> columns, rows;
        for (const glm::dvec2& p : samplePositions(n)) {
            columns.push_back(static_cast<int>(p.x * n));
            rows.push_back(static_cast<int>(p.y * n));
        }
        std::sort(rows.begin(), rows.end());
        for (int i = 0; i < n; ++i) {
            EXPECT_EQ(columns[static_cast<std::size_t>(i)], i);
            EXPECT_EQ(rows[static_cast<std::size_t>(i)], i);
        }
    }
}

TEST(Supersampling, OneSurfaceBecomesOneFragmentWithItsNearestDepth) {
    const auto image =
        merged({pixelOfSample({{2.5F, 7, kGlass}}), pixelOfSample({{2.25F, 7, kGlass}})});
    ASSERT_EQ(image.fragments(), 1U);
    EXPECT_EQ(image.z[0], 2.25F);
    EXPECT_EQ(colorOf(image, 0), kGlass);
    EXPECT_TRUE(image.extra.empty());
}

TEST(Supersampling, DifferentSurfacesStayApart) {
    const auto image = merged({pixelOfSample({{2, 7, kRed}}), pixelOfSample({{2, 8, kGreen}})});
    ASSERT_EQ(image.fragments(), 2U);
    EXPECT_EQ(colorOf(image, 0), (std::array<float, 4>{0.5F, 0, 0, 0.5F}));
    // Green covers the part of the pixel that red does not cover.
    EXPECT_EQ(colorOf(image, 1), kGreen);
}

TEST(Supersampling, WhatIsHiddenInEverySampleKeepsItsCoverage) {
    const auto image =
        merged({pixelOfSample({{1, 1, kRed}, {2, 2, kGreen}}), pixelOfSample({{1, 1, kRed}})});
    ASSERT_EQ(image.fragments(), 2U);
    EXPECT_EQ(colorOf(image, 1), (std::array<float, 4>{0, 0.5F, 0, 0.5F}));
}

TEST(Supersampling, FrontAndBackOfABallMergeWithTheirLike) {
    // The second sample is near the ball's edge, where front and back are closer together.
    const auto image = merged({pixelOfSample({{1, 3, kGlass}, {9, 3, kGlass}}),
                               pixelOfSample({{4.5F, 3, kGlass}, {5.5F, 3, kGlass}})});
    ASSERT_EQ(image.fragments(), 2U);
    EXPECT_EQ(image.z[0], 1);
    EXPECT_EQ(image.z[1], 5.5F);
}

TEST(Supersampling, AFoldThatOneSampleMissesDoesNotMergeWithWhatIsInFront) {
    const auto image = merged({pixelOfSample({{1, 3, kGlass}, {1.1F, 3, kGlass}, {5, 3, kGlass}}),
                               pixelOfSample({{4.9F, 3, kGlass}})});
    ASSERT_EQ(image.fragments(), 3U);
    EXPECT_EQ(image.z[2], 4.9F);
    EXPECT_FLOAT_EQ(colorOf(image, 0)[3], 0.25F);
    EXPECT_FLOAT_EQ(colorOf(image, 1)[3], 0.25F / (2 - 0.5F) * 1);
}

TEST(Supersampling, ASampleMayHaveWhatAnotherOneLacks) {
    const auto image = merged({pixelOfSample({{1, 3, kGlass}}),
                               pixelOfSample({{1, 3, kGlass}, {2, 3, kGlass}}), pixelOfSample({})});
    ASSERT_EQ(image.fragments(), 2U);
    EXPECT_EQ(image.z[1], 2);
    EXPECT_FLOAT_EQ(colorOf(image, 0)[3], 1 / 3.F);
}

// A far fragment in one sample makes the samples unlike, but changes nothing in front of it.
TEST(Supersampling, PixelsWhoseSamplesAreAlikeMergeLikeOthers) {
    std::mt19937 random(7);
    const auto below = [&](unsigned end) { return static_cast<float>(random() % end); };
    for (int pixel = 0; pixel < 2000; ++pixel) {
        std::vector<std::vector<Fragment>> lists(4);
        const float spread = below(5);
        for (int layer = 0; layer < 3; ++layer) {
            const auto surface = static_cast<std::uint32_t>(random() % 2);
            for (auto& list : lists)
                list.push_back({1 + 4 * static_cast<float>(layer) + spread * below(4) / 4,
                                surface,
                                {below(4) / 8, 0, 0, below(5) / 4}});
        }
        const PixelType type = pixel % 2 == 0 ? PixelType::kHalf : PixelType::kFloat;
        const bool with_opacity = pixel % 4 < 2;
        std::vector<LayeredImage> alike, unlike;
        for (auto& list : lists) {
            std::ranges::stable_sort(list, {}, &Fragment::z);
            alike.push_back(pixelOfSample(list, type, with_opacity));
            if (unlike.empty()) list.push_back({99, 9, kRed});
            unlike.push_back(pixelOfSample(list, type, with_opacity));
        }
        const LayeredImage a = merged(alike), b = merged(unlike);
        ASSERT_EQ(a.fragments() + 1, b.fragments()) << pixel;
        EXPECT_TRUE(std::equal(a.z.begin(), a.z.end(), b.z.begin())) << pixel;
        EXPECT_TRUE(
            std::ranges::equal(a.color.data, std::span(b.color.data).first(a.color.data.size())))
            << pixel;
    }
}

TEST(Supersampling, SurfacesThatCrossKeepTheOrderOfEverySample) {
    const auto image = merged({pixelOfSample({{1, 1, kGlass}, {2, 2, kRed}}),
                               pixelOfSample({{1.5F, 2, kRed}, {2.5F, 1, kGlass}})});
    CompositeImage composite;
    compositeOver(image, {}, composite);
    // The result is half glass over red and half red over glass.
    EXPECT_FLOAT_EQ(composite.rgba[0][0], (0.5F + 1) / 2);
    EXPECT_FLOAT_EQ(composite.rgba[0][2], 0.125F);
    EXPECT_FLOAT_EQ(composite.rgba[0][3], 1);
    EXPECT_TRUE(std::is_sorted(image.z.begin(), image.z.end()));
}

}  // namespace
}  // namespace peeler
