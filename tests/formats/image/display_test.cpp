// SPDX-License-Identifier: Apache-2.0
// Tests display transforms: straight pixels over any background, and exposure metering.
#include "formats/image/display.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/base/color.h"

namespace peeler {
namespace {

using Rgba = std::array<float, 4>;

/// Returns the largest error over 256 grey backgrounds, in 255ths. A viewer blends `pixel` in sRGB
/// values; the exact result blends `shown` (premultiplied) in linear light.
double worstError(const Rgba& shown, const StraightPixel& pixel) {
    double worst = 0;
    for (int grey = 0; grey < 256; ++grey) {
        const float encoded = static_cast<float>(grey) / 255, back = linearFromSrgb(encoded);
        for (std::size_t c = 0; c < 3; ++c) {
            const float exact = encodeSrgb(shown[c] + (1 - shown[3]) * back);
            const float seen =
                pixel.alpha * encodeSrgb(pixel.color[c]) + (1 - pixel.alpha) * encoded;
            worst = std::max(worst, 255 * std::abs(static_cast<double>(exact - seen)));
        }
    }
    return worst;
}

/// Returns the naive conversion to straight alpha: divides by the unchanged alpha, then clips to 1.
StraightPixel clipped(const Rgba& shown) {
    const float alpha = std::max(shown[3], 1.0F / 255);
    return {{std::min(1.0F, shown[0] / alpha), std::min(1.0F, shown[1] / alpha),
             std::min(1.0F, shown[2] / alpha)},
            alpha};
}

TEST(StraightPixels, LightOnClearGlassSurvivesOverEveryGrey) {
    const struct {
        Rgba shown;
        // Lower bound of the error with clipped(), upper bound with straightPixel().
        double before, after;
    } rows[] = {{{0.05F, 0.05F, 0.05F, 0}, 62, 23},  {{0.18F, 0.18F, 0.18F, 0}, 116, 22},
                {{0.5F, 0.5F, 0.5F, 0}, 186, 18},    {{0.8F, 0.8F, 0.8F, 0.3F}, 154, 11},
                {{0.18F, 0.09F, 0.02F, 0}, 116, 49}, {{0.18F, 0, 0, 0}, 116, 61}};
    for (const auto& [shown, before, after] : rows) {
        SCOPED_TRACE(shown[0]);
        const StraightPixel pixel = straightPixel(shown);
        EXPECT_TRUE(pixel.raised);
        EXPECT_GT(worstError(shown, clipped(shown)), before);
        EXPECT_LT(worstError(shown, pixel), after);
        // With the same colour, no other alpha reduces the error by more than 25.5 of 255.
        double least = 255;
        for (int i = 1; i <= 255; ++i) {
            StraightPixel other = pixel;
            other.alpha = static_cast<float>(i) / 255;
            least = std::min(least, worstError(shown, other));
        }
        EXPECT_LT(worstError(shown, pixel), least + 25.5);
    }
}

/// Returns the largest error for coverage `alpha` and light of this colour, at 50 brightnesses up
/// to the full colour.
double worstOfLight(const std::array<float, 3>& color, float alpha) {
    double worst = 0;
    for (int i = 1; i <= 50; ++i) {
        const float light = static_cast<float>(i) / 50;
        const Rgba shown{light * color[0], light * color[1], light * color[2], alpha};
        worst = std::max(worst, worstError(shown, straightPixel(shown)));
    }
    return worst;
}

TEST(StraightPixels, AreOffByNoMoreThanTheGuideOfLightSays) {
    double clear = worstOfLight({1, 1, 1}, 0), covering = 0, colored = 0;
    for (const float alpha : {0.01F, 0.1F, 0.2F, 0.24F, 0.3F, 0.6F, 0.9F, 1.0F}) {
        covering = std::max(covering, worstOfLight({1, 1, 1}, alpha));
        for (const float green : {0.0F, 0.01F, 0.1F, 0.5F})
            for (const float blue : {0.0F, 0.5F, 1.0F})
                colored = std::max(colored, worstOfLight({1, green, blue}, alpha));
    }
    EXPECT_LE(clear, 24);
    EXPECT_LE(covering, 73.5);
    EXPECT_LE(colored, 130);
    // The bounds above are tight.
    EXPECT_GT(clear, 23);
    EXPECT_GT(covering, 69);
    EXPECT_GT(colored, 129);
}

TEST(StraightPixels, GreyLightIsExactOverBlack) {
    for (float light = 0.001F; light < 1; light *= 1.5F) {
        const StraightPixel pixel = straightPixel({light, light, light, 0});
        EXPECT_EQ(pixel.color, (std::array<float, 3>{1, 1, 1}));
        EXPECT_NEAR(pixel.alpha, encodeSrgb(light), 1e-6);
    }
}

TEST(StraightPixels, WhatCoversAsMuchAsItShinesIsDividedByItsAlpha) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> unit(0, 1);
    for (int i = 0; i < 1000; ++i) {
        const float alpha = unit(random);
        const Rgba shown{alpha * unit(random), alpha * unit(random), alpha * unit(random), alpha};
        const StraightPixel pixel = straightPixel(shown);
        EXPECT_FALSE(pixel.raised);
        EXPECT_EQ(pixel.alpha, alpha);
        for (std::size_t c = 0; c < 3; ++c)
            EXPECT_FLOAT_EQ(pixel.color[c], shown[c] / alpha);
    }
    EXPECT_EQ(straightPixel({}).alpha, 0);
}

TEST(StraightPixels, NothingJumpsWhereLightExceedsCoverage) {
    for (const float alpha : {0.0F, 0.1F, 0.5F, 0.9F}) {
        float before = alpha;
        for (float light = alpha; light <= 1; light += 1e-4F) {
            const StraightPixel pixel = straightPixel({light, light / 2, light / 4, alpha});
            EXPECT_GE(pixel.alpha, before - 1e-5F);
            // The curve is steepest in its linear part, with a slope of 12.92.
            EXPECT_LE(pixel.alpha - before, 12.93F * 1e-4F) << alpha << ' ' << light;
            before = pixel.alpha;
        }
    }
}

TEST(Displays, ToneMapsSeeOpaqueAndCoveredPartsAlike) {
    const Display display(1, "neutral");
    const Rgba opaque = display.shown({0.4F, 0.2F, 0.1F, 1});
    const Rgba half = display.shown({0.2F, 0.1F, 0.05F, 0.5F});
    for (std::size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(half[c], opaque[c] / 2, 1e-6);
    EXPECT_EQ(half[3], 0.5F);
    // Light of 3 must look the same on clear glass as on any surface.
    const Rgba clear = display.shown({3, 3, 3, 0}), covered = display.shown({3, 3, 3, 1});
    EXPECT_FLOAT_EQ(clear[0], covered[0]);
    EXPECT_EQ(display.shown({}), Rgba{});
}

TEST(Displays, BackgroundsStayWhatTheyAre) {
    const float grey = linearFromSrgb(136.0F / 255);
    const Rgba background{grey, grey, grey, 1};
    for (const char* tone_map : {"none", "neutral", "aces"}) {
        for (const float exposure : {-4.0F, 0.0F, 4.0F}) {
            const Display display(exposure, tone_map);
            EXPECT_EQ(display.shownOver({}, background), background);
            const Rgba half = display.shownOver({0, 0, 0, 0.5F}, background);
            EXPECT_NEAR(half[0], grey / 2 + display.shown({0, 0, 0, 0.5F})[0], 1e-6);
            EXPECT_EQ(half[3], 1);
        }
    }
}

CompositeImage pictureOf(const std::vector<Rgba>& pixels) {
    CompositeImage picture;
    picture.rgba = pixels;
    return picture;
}

float metered(const std::vector<Rgba>& pixels) {
    ExposureMeter meter;
    meter.add(pictureOf(pixels));
    return meter.stops();
}

TEST(Metering, AimsHalfwayBetweenMiddleGreyAndHighlights) {
    // For a single grey v, the mean requires log2(0.18 / v) stops and the highlights log2(1 / v).
    for (const float v : {0.01F, 0.18F, 1.0F, 50.0F}) {
        EXPECT_NEAR(metered(std::vector<Rgba>(100, {v, v, v, 1})),
                    (std::log2(0.18 / v) + std::log2(1 / v)) / 2, 0.06);
    }
    // With 90 pixels of 0.1 and 10 of 10, the mean is 0.1^0.9·10^0.1 and the highlights are at 10.
    std::vector<Rgba> pixels(90, {0.1F, 0.1F, 0.1F, 1});
    pixels.insert(pixels.end(), 10, {10, 10, 10, 1});
    const double mean = 0.9 * std::log2(0.1) + 0.1 * std::log2(10);
    EXPECT_NEAR(metered(pixels), (std::log2(0.18) - mean - std::log2(10)) / 2, 0.06);
    // A few very bright pixels hardly change the exposure.
    std::vector<Rgba> sparks(990, {0.18F, 0.18F, 0.18F, 1});
    sparks.insert(sparks.end(), 10, {1e6F, 1e6F, 1e6F, 1});
    EXPECT_NEAR(metered(sparks), metered(std::vector<Rgba>(10, {0.18F, 0.18F, 0.18F, 1})), 0.15);
    EXPECT_EQ(metered({}), 0);
    EXPECT_EQ(metered({{0, 0, 0, 1}, {1, 1, 1, 0}}), 0);
}

TEST(Metering, KeepsHighlightsBelowFour) {
    // Five percent of the pixels are very bright, and the others are dark. The exposure halfway
    // between the two targets would leave the bright pixels at 2^3.5.
    std::vector<Rgba> pixels(95, {0.001F, 0.001F, 0.001F, 1});
    pixels.insert(pixels.end(), 5, {10, 10, 10, 1});
    EXPECT_NEAR(metered(pixels), std::log2(4.0 / 10), 0.06);
}

TEST(Metering, DoesNotDependOnBandsOrOrder) {
    std::mt19937 random(11);
    std::uniform_real_distribution<float> unit(0, 1);
    std::vector<Rgba> pixels;
    for (int i = 0; i < 5000; ++i)
        pixels.push_back({unit(random) * unit(random), unit(random), unit(random), unit(random)});
    const float whole = metered(pixels);
    std::shuffle(pixels.begin(), pixels.end(), random);
    ExposureMeter meter;
    for (std::size_t first = 0; first < pixels.size(); first += 500)
        meter.add(pictureOf({pixels.begin() + static_cast<std::ptrdiff_t>(first),
                             pixels.begin() + static_cast<std::ptrdiff_t>(first + 500)}));
    EXPECT_EQ(meter.stops(), whole);
    // The exposure has one decimal, so users can specify it exactly.
    EXPECT_EQ(std::round(whole * 10) / 10, whole);
}

TEST(Metering, OfUnknownLightChangesOnlyWhatCannotBeShown) {
    const auto needed = [](float v) {
        ExposureMeter meter;
        meter.add(pictureOf(std::vector<Rgba>(10, {v, v, v, 1})));
        return meter.stopsIfNeeded();
    };
    EXPECT_EQ(needed(0.05F), 0);
    EXPECT_EQ(needed(3.5F), 0);
    EXPECT_LT(needed(5), -3);
    EXPECT_GT(needed(0.01F), 5);
    EXPECT_EQ(ExposureMeter().stopsIfNeeded(), 0);
}

}  // namespace
}  // namespace peeler
