// SPDX-License-Identifier: Apache-2.0
// Tests the thinning of deep samples: known answers, the bound at every depth, and the number of
// samples against an exhaustive search.
#include "core/image/deep_thinning.h"

#include <gtest/gtest.h>

#define IMATH_HALF_NO_LOOKUP_TABLE
#include <Imath/half.h>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <vector>

#include <peeler/composite.h>
#include <peeler/error.h>
#include "core/image/composite.h"
#include "core/image/deep_curve.h"
#include "formats/exr/synthetic_image.h"

namespace peeler {
namespace {

struct DeepSample {
    float z, alpha;
    std::array<float, 3> color{};
    float back = 0;  ///< if greater than z, the end of a volume
    std::uint32_t object = 0;
    std::array<float, 3> tint{1, 1, 1};  ///< factors of alpha with coloured opacity
};

enum class DeepKind { kPoints, kVolumes };

/// Returns a picture of two pixels, an empty one and one with these samples.
LayeredImage deepPixel(const std::vector<DeepSample>& samples, PixelType type = PixelType::kFloat,
                       DeepKind kind = DeepKind::kPoints, bool tinted = false) {
    LayeredImage image;
    image.window = {0, 0, 2, 1};
    image.offsets = {0, 0, static_cast<std::uint32_t>(samples.size())};
    image.color = {colorNames(tinted), type, {}};
    image.color.data.resize(samples.size() * image.color.stride());
    image.extra = {{{"id.object"}, PixelType::kUint, {}}};
    if (kind == DeepKind::kVolumes) image.extra.push_back({{"ZBack"}, PixelType::kFloat, {}});
    for (const DeepSample& sample : samples) {
        TintedColor color{sample.color[0], sample.color[1], sample.color[2]};
        for (std::size_t c = 0; c < 3; ++c)
            color[4 + c] = sample.alpha * sample.tint[c];
        color[3] = meanOpacity(color[4], color[5], color[6]);
        storeColor(color, image.color, image.z.size());
        image.z.push_back(sample.z);
        test::appendValue(image.extra[0].data, sample.object);
        if (kind == DeepKind::kVolumes)
            test::appendValue(image.extra[1].data, std::max(sample.z, sample.back));
    }
    return image;
}

LayeredImage thinnedDeep(const LayeredImage& image, double error, bool keep_ids = false) {
    LayeredImage out;
    DeepThinning sum;
    DeepMergeSettings settings;
    settings.error = error;
    settings.keep_ids = keep_ids;
    thinDeepSamples(image, 0, 1, settings, out, sum);
    EXPECT_EQ(sum.before, image.fragments());
    EXPECT_EQ(sum.after, out.fragments());
    const double measured = DeepComparison(out, image)(1, 1).error;
    EXPECT_NEAR(measured, sum.largest_error, 1e-12);
    EXPECT_LE(measured, error);
    return out;
}

std::uint32_t thinningSeed() {
    const char* const wanted = std::getenv("PEELER_TEST_SEED");
    return wanted ? static_cast<std::uint32_t>(std::strtoul(wanted, nullptr, 10)) : 47;
}

/// Random samples: soft ones, strong ones, bright ones, or with an opaque one at the end.
std::vector<DeepSample> randomSamples(std::mt19937& random, int most) {
    std::uniform_real_distribution<float> unit(0, 1);
    const int count = std::uniform_int_distribution<int>(1, most)(random);
    const int kind = std::uniform_int_distribution<int>(0, 3)(random);
    std::vector<DeepSample> samples;
    float z = 1;
    for (int i = 0; i < count; ++i) {
        DeepSample sample{z += unit(random) < 0.2F ? 0 : unit(random), unit(random)};
        if (kind == 0) sample.alpha *= 0.1F;
        if (kind == 1 && i + 1 == count) sample.alpha = 1;
        for (float& value : sample.color)
            value = sample.alpha * unit(random) * (kind == 2 ? 40.0F : 1.0F);
        sample.object = static_cast<std::uint32_t>(unit(random) * 3);
        for (float& value : sample.tint)
            value = unit(random);
        samples.push_back(sample);
    }
    return samples;
}

/// Returns the fewest steps by trying every set of depths, with any values between them.
int fewestSteps(const DeepCurve& curve, double error) {
    const auto states = curve.states();
    const std::size_t count = states.size();
    const double scale = curve.colorScale();
    const auto fits = [&](std::size_t first, std::size_t end) {  // states [first, end) as one
        const bool fixed = first == 0;
        for (std::size_t i = 0; i < 6; ++i) {
            const double bound = error * (i < 3 ? scale : 1);
            double least = states[first][i], greatest = least;
            for (std::size_t k = first; k < end; ++k) {
                least = std::min(least, states[k][i]);
                greatest = std::max(greatest, states[k][i]);
            }
            const bool opaque = i >= 3 && end == count && states.back()[i] == 0;
            if (opaque && fixed) return false;
            if (fixed && (greatest - kDeepStart[i] > bound || kDeepStart[i] - least > bound))
                return false;
            if (greatest - least > 2 * bound || (opaque && greatest > bound)) return false;
        }
        return true;
    };
    int fewest = 99;
    for (std::uint32_t cuts = 0; cuts < (1U << (count - 1)); ++cuts) {
        const int steps = std::popcount(cuts);
        if (steps >= fewest) continue;
        bool good = true;
        std::size_t first = 0;
        for (std::size_t k = 1; good && k <= count; ++k) {
            if (k < count && !(cuts >> (k - 1) & 1U)) continue;
            good = fits(first, k);
            first = k;
        }
        if (good) fewest = steps;
    }
    return fewest;
}

TEST(DeepThinning, OneStepStandsForStepsWithinTwiceTheBound) {
    // Transmittance 1, 0.9, 0.81, 0.729; at 1/8 one step to (0.9 + 0.729) / 2 holds everywhere.
    const LayeredImage image = deepPixel({{1, 0.1F}, {2, 0.1F}, {3, 0.1F}});
    const LayeredImage out = thinnedDeep(image, 0.125);
    ASSERT_EQ(out.fragments(), 1U);
    EXPECT_EQ(out.z[0], 2);  // 0.9 is within the bound of 1
    EXPECT_NEAR(colorOf(out, 0)[3], 1 - (0.81 + 0.729) / 2, 1e-6);
    EXPECT_EQ(thinnedDeep(image, 1e-3).fragments(), 3U);
}

TEST(DeepThinning, AnOpaquePixelEndsOpaque) {
    const LayeredImage image = deepPixel({{1, 0.25F, {0.25F, 0, 0}},
                                          {2, 0.5F, {0, 0.5F, 0}},
                                          {3, 0.99F, {0, 0, 0.99F}},
                                          {4, 1, {1, 1, 1}},
                                          {5, 0.5F, {0.5F, 0, 0}}});
    for (const double error : {0.5, 0.1, 0.01, 1e-4}) {
        const LayeredImage out = thinnedDeep(image, error);
        float rest = 1;
        for (std::size_t i = 0; i < out.fragments(); ++i)
            rest *= 1 - colorOf(out, i)[3];
        EXPECT_EQ(rest, 0) << error;
    }
}

TEST(DeepThinning, TakesTheFewestSamples) {
    std::mt19937 random(thinningSeed());
    SCOPED_TRACE(thinningSeed());
    int same = 0;
    constexpr int kPixels = 1000;
    constexpr double kErrors[] = {1.0 / 1024, 1.0 / 256, 1.0 / 64, 1.0 / 8};
    for (int i = 0; i < kPixels; ++i) {
        const PixelType type = i % 3 == 0 ? PixelType::kHalf : PixelType::kFloat;
        const LayeredImage image =
            deepPixel(randomSamples(random, 12), type, DeepKind::kPoints, i % 5 == 0);
        DeepCurve curve;
        DeepFloats floats(image);
        floats.convert(0, image.fragments());
        ASSERT_TRUE(curve.read(floats.samples(0, image.fragments())));
        curve.mergePoints();
        const double error = kErrors[i % 4];
        const int fewest = fewestSteps(curve, error);
        const auto taken = static_cast<int>(thinnedDeep(image, error).fragments());
        EXPECT_LE(taken, fewest + 1) << i;
        same += taken == fewest ? 1 : 0;
    }
    RecordProperty("same", same);
    EXPECT_GE(same, kPixels * 95 / 100);
}

TEST(DeepThinning, HoldsTheBoundForEveryKindOfSample) {
    std::mt19937 random(thinningSeed());
    SCOPED_TRACE(thinningSeed());
    std::uniform_real_distribution<float> unit(0, 1);
    std::size_t before = 0, after = 0;
    for (int i = 0; i < 600; ++i) {
        std::vector<DeepSample> samples = randomSamples(random, 60);
        for (DeepSample& sample : samples) {
            if (unit(random) < 0.7F) sample.back = sample.z + 3 * unit(random);
            if (i % 7 == 0) sample.color[0] = -sample.color[0];
            if (i % 3 == 0) sample.alpha *= 0.05F;
        }
        const PixelType type = i % 2 == 0 ? PixelType::kHalf : PixelType::kFloat;
        const DeepKind kind = i % 4 < 2 ? DeepKind::kVolumes : DeepKind::kPoints;
        const LayeredImage image = deepPixel(samples, type, kind, i % 5 == 0);
        constexpr double kErrors[] = {1.0 / 4096, 1.0 / 256, 1.0 / 16};
        before += image.fragments();
        after += thinnedDeep(image, kErrors[i % 3]).fragments();
    }
    EXPECT_LT(after, before * 6 / 10);
}

TEST(DeepThinning, EqualSlicesOfFogAreOneVolume) {
    std::vector<DeepSample> slices;
    for (int i = 0; i < 100; ++i)
        slices.push_back(
            {static_cast<float>(i), 0.02F, {0.01F, 0.02F, 0}, static_cast<float>(i + 1)});
    const LayeredImage out =
        thinnedDeep(deepPixel(slices, PixelType::kFloat, DeepKind::kVolumes), 1e-4);
    ASSERT_EQ(out.fragments(), 1U);
    EXPECT_EQ(out.z[0], 0);
    EXPECT_EQ(findChannel(out, "ZBack").value(0), 100);
    EXPECT_NEAR(colorOf(out, 0)[3], 1 - std::pow(0.98, 100), 1e-4);
}

TEST(DeepThinning, SeparateObjectsKeepSeparateSamples) {
    std::mt19937 random(thinningSeed());
    SCOPED_TRACE(thinningSeed());
    for (int i = 0; i < 300; ++i) {
        std::vector<DeepSample> samples = randomSamples(random, 20);
        for (DeepSample& sample : samples)
            sample.alpha = std::max(sample.alpha, 0.02F);
        const LayeredImage image = deepPixel(samples);
        const LayeredImage out = thinnedDeep(image, 1.0 / 32, true);
        const FragmentChannel ids = findIds(image, "id.object"), kept = findIds(out, "id.object");
        // The samples of the result, one after another, composite runs of one object.
        std::size_t next = 0;
        for (std::size_t s = 0; s < out.fragments(); ++s) {
            const std::array<float, 4> wanted = colorOf(out, s);
            std::array<float, 4> run{};
            const auto is_same = [&](std::size_t c) {
                return std::abs(run[c] - wanted[c]) <= 1e-4F * std::max(1.0F, wanted[c]);
            };
            while (next < image.fragments() && ids.id(next) == kept.id(s) &&
                   !(is_same(3) && is_same(0))) {
                const std::array<float, 4> add = colorOf(image, next++);
                for (std::size_t c = 0; c < 4; ++c)
                    run[c] += (1 - run[3]) * add[c];
            }
            ASSERT_TRUE(is_same(0) && is_same(1) && is_same(2) && is_same(3)) << i;
        }
    }
}

TEST(DeepThinning, NeedsIdsToKeepApart) {
    LayeredImage image = deepPixel({{1, 0.5F}, {2, 0.5F}});
    image.extra.clear();
    DeepMergeSettings settings;
    settings.error = 0.1;
    settings.keep_ids = true;
    LayeredImage out;
    DeepThinning sum;
    EXPECT_THROW(thinDeepSamples(image, 0, 1, settings, out, sum), Error);
}

TEST(DeepThinning, ValuesWithoutMeaningStay) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const DeepSample& odd :
         {DeepSample{2, nan}, DeepSample{2, 1.5F}, DeepSample{2, -0.5F},
          DeepSample{2, 0.5F, {0, std::numeric_limits<float>::infinity(), 0}}}) {
        const LayeredImage image = deepPixel({{1, 0.001F}, odd, {3, 0.001F}, {4, 0.001F}});
        EXPECT_EQ(thinnedDeep(image, 0.1).color.data, image.color.data);
    }
}

TEST(DeepCurve, FindsTheExtremeBetweenTheEndsOfVolumes) {
    // Transmittance exp(−z) and exp(−2z) to depth 1: the difference e⁻ᶻ − e⁻²ᶻ is largest, 1/4, at
    // z = ln 2.
    const auto volume = [](double rate) {
        return deepPixel({{0, static_cast<float>(1 - std::exp(-rate)), {}, 1}}, PixelType::kFloat,
                         DeepKind::kVolumes);
    };
    const DeepDifference worst = DeepComparison(volume(1), volume(2))(1, 1);
    EXPECT_NEAR(worst.error, 0.25, 1e-6);
    EXPECT_NEAR(worst.z, std::log(2.0), 1e-6);
    EXPECT_EQ(deepChannelName(worst.component, false), "A");
}

TEST(DeepCurve, MergesOverlappingVolumesAsOpenExrDoes) {
    // "Interpreting OpenEXR Deep Pixels": opacities add up as 1 − (1 − a)(1 − b), and colours as
    // (Ca · u(a)/a + Cb · u(b)/b) · m / u(m), where u(a) = −ln(1 − a) and m is the merged opacity.
    const std::array<double, 3> a{0.3, 0.2, 0.0}, b{0.6, 0.1, 0.5};
    const LayeredImage image =
        deepPixel({{1, 0.3F, {0.2F, 0.3F, 0}, 2}, {1, 0.6F, {0.1F, 0, 0.5F}, 2}}, PixelType::kFloat,
                  DeepKind::kVolumes);
    DeepCurve curve;
    DeepFloats floats(image);
    floats.convert(0, 2);
    ASSERT_TRUE(curve.read(floats.samples(0, 2)));
    ASSERT_EQ(curve.pieces().size(), 1U);
    const double opacity = 1 - 0.7 * 0.4, ua = -std::log(0.7), ub = -std::log(0.4);
    EXPECT_NEAR(curve.pieces()[0].opacity[0], opacity, 1e-6);
    EXPECT_NEAR(curve.pieces()[0].color[0],
                (0.2 * ua / a[0] + 0.1 * ub / b[0]) * opacity / (ua + ub), 1e-6);
}

}  // namespace
}  // namespace peeler
