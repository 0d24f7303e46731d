// SPDX-License-Identifier: Apache-2.0
// Compares composites made on the fly with CPU composites of the captured layers, and with
// formulas. Checks the published number of geometry passes.
#include "core/image/composite.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include <peeler/error.h>
#include "core/capture/method.h"
#include "core/image/layers.h"
#include "support/capture.h"
#include "support/flat.h"
#include "support/hard_scenes.h"
#include "support/method_names.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

// The rounding error of a few hundred operations on 32-bit floats.
constexpr float kRoundingOfColors = 4e-6F;

/// Returns the largest colour difference; 1e9 if any Z differs.
float worst(const CompositeImage& a, const CompositeImage& b) {
    EXPECT_EQ(a.window, b.window);
    float most = 0;
    for (std::size_t p = 0; p < a.rgba.size(); ++p) {
        if (a.z[p] != b.z[p]) return 1e9F;
        for (std::size_t c = 0; c < 4; ++c)
            most = std::max(most, std::abs(a.rgba[p][c] - b.rgba[p][c]));
    }
    return most;
}

Captured composited(const Scene& scene, const View& view, CaptureSettings settings) {
    settings.composite = true;
    return capture(scene, view, settings);
}

class Exact : public testing::TestWithParam<std::string> {};

TEST_P(Exact, EqualsTheCompositeOfTheLayers) {
    for (const auto& [name, scene] : hardScenes()) {
        for (const PixelType precision : {PixelType::kHalf, PixelType::kFloat}) {
            for (const Surfaces surfaces : {Surfaces::kAll, Surfaces::kVisible}) {
                CaptureSettings settings;
                settings.color_type = precision;
                settings.surfaces = surfaces;
                Scene shown = scene;
                for (std::size_t i = 0; i < shown.materials.size(); i += 5)
                    shown.materials[i].alpha_mode = AlphaMode::kOpaque;
                CompositeImage expected;
                compositeOver(capture(shown, testView(160, 120), settings).image, {}, expected);
                settings.method = GetParam();
                settings.band_bytes = 1 << 20;
                const auto result = composited(shown, testView(160, 120), settings);
                EXPECT_GT(result.bands.size(), 1U);
                EXPECT_LE(worst(flat(result.image), expected), kRoundingOfColors) << name;
            }
        }
    }
}

TEST_P(Exact, KeepsTheNearestLayersAndBlendsOrDropsTheRest) {
    for (const auto& [name, scene] : hardScenes()) {
        const auto all = capture(scene, testView(160, 120));
        for (const std::uint32_t limit : {1U, 2U, 5U}) {
            for (const Tail tail : {Tail::kDrop, Tail::kBlend}) {
                CompositeImage expected;
                compositeNearest(all.image, limit, tail, expected);
                CaptureSettings settings;
                settings.method = GetParam();
                settings.max_layers = limit;
                settings.tail = tail;
                const auto result = composited(scene, testView(160, 120), settings);
                EXPECT_LE(worst(flat(result.image), expected), 1e-4F)
                    << name << ", " << limit << " layers";
                EXPECT_FALSE(result.plan.complete());
                EXPECT_EQ(result.plan.fragments_counted, all.image.fragments());
                std::uint64_t beyond = 0;
                for (std::size_t p = 0; p < all.image.window.pixels(); ++p)
                    beyond += all.image.count(p) - std::min(all.image.count(p), limit);
                EXPECT_EQ(result.plan.fragments_counted - result.plan.fragments_stored, beyond);
                EXPECT_EQ(result.plan.fragments_blended, tail == Tail::kBlend ? beyond : 0);
            }
        }
    }
}

/// Returns `count` quads, one behind the other. Their draw order is not their depth order.
Scene quads(int count) {
    SceneBuilder builder;
    for (int i = 0; i < count; ++i) {
        const auto z = static_cast<float>(1 + (i * 7) % count);
        builder.rectangle(4 * z, 4 * z, -z, builder.material({0.1F * z, 1 - 0.1F * z, 0.5F, 0.3F}));
    }
    return builder.scene();
}

TEST_P(Exact, TakesAsManyGeometryPassesAsPublished) {
    for (const int n : {1, 2, 9, 10}) {
        const std::map<std::string, int> published = {
            {"a-buffer", 1},      {"front-to-back", n},      {"two-pass", 2 * n},
            {"back-to-front", n}, {"dual", (n + 1) / 2 + 1}, {"dual-max", (n + 1) / 2 + 1}};
        CaptureSettings settings;
        settings.method = GetParam();
        const auto result = composited(quads(n), testView(40, 30), settings);
        EXPECT_EQ(result.plan.layers.size(), static_cast<std::size_t>(n));
        EXPECT_EQ(result.report.passes, published.at(GetParam()));
    }
}

INSTANTIATE_TEST_SUITE_P(Methods, Exact, testing::ValuesIn(methodNames(true)), [](const auto& i) {
    std::string name = i.param;
    std::replace(name.begin(), name.end(), '-', '_');
    return name;
});

TEST(Dual, FinishesPixelsWithCoincidentFragmentsInMorePasses) {
    SceneBuilder builder;
    for (int i = 0; i < 3; ++i)
        builder.rectangle(1, 1, -2,
                          builder.material({0.2F * static_cast<float>(i), 0.5F, 1, 0.5F}));
    for (const char* method : {"dual", "dual-max"}) {
        CaptureSettings settings;
        settings.method = method;
        const auto result = composited(builder.scene(), testView(40, 30), settings);
        CompositeImage expected;
        compositeOver(capture(builder.scene(), testView(40, 30)).image, {}, expected);
        EXPECT_LE(worst(flat(result.image), expected), kRoundingOfColors);
        EXPECT_EQ(result.report.passes,
                  // The range pass and 2 peels, then one pass for each of the 3 fragments.
                  3 + 3);
    }
}

using Formula = void (*)(const LayeredImage&, const std::array<float, 4>&, CompositeImage&);

TEST(Approximations, EqualTheirFormulasOnTheCapturedLayers) {
    const std::map<std::string, Formula> formulas = {{"weighted-average", compositeWeightedAverage},
                                                     {"weighted-sum", compositeWeightedSum}};
    for (const auto& [name, scene] : hardScenes()) {
        const auto layers = capture(scene, testView(160, 120));
        for (const auto& [method, formula] : formulas) {
            CompositeImage expected;
            formula(layers.image, {}, expected);
            CaptureSettings settings;
            settings.method = method;
            const auto result = composited(scene, testView(160, 120), settings);
            EXPECT_LE(worst(flat(result.image), expected), 1e-3F) << name << ", " << method;
            EXPECT_EQ(result.report.passes, 1);
            EXPECT_TRUE(result.plan.complete());
        }
    }
}

TEST(Approximations, EqualTheExactCompositeOfOneLayer) {
    SceneBuilder builder;
    builder.rectangle(1, 1, -2, builder.material({0.2F, 0.5F, 0.9F, 0.25F}));
    CompositeImage exact;
    compositeOver(capture(builder.scene(), testView(40, 30)).image, {}, exact);
    for (const auto& method : methodNames(false)) {
        CaptureSettings settings;
        settings.method = method;
        const auto result = composited(builder.scene(), testView(40, 30), settings);
        EXPECT_LE(worst(flat(result.image), exact), kRoundingOfColors) << method;
    }
}

TEST(Approximations, AverageAndUnsortedAreExactIfAllFragmentsOfAPixelAreAlike) {
    SceneBuilder builder;
    const int material = builder.material({0.2F, 0.5F, 0.9F, 0.25F});
    for (int i = 0; i < 6; ++i)
        builder.rectangle(1, 1, -2 - static_cast<float>((i * 5) % 6), material);
    CompositeImage exact;
    compositeOver(capture(builder.scene(), testView(40, 30)).image, {}, exact);
    for (const char* method : {"weighted-average", "unsorted"}) {
        CaptureSettings settings;
        settings.method = method;
        const auto result = composited(builder.scene(), testView(40, 30), settings);
        EXPECT_LE(worst(flat(result.image), exact), 1e-5F) << method;
    }
}

TEST(Approximations, UnsortedShowsWhatWasDrawnLastInFront) {
    SceneBuilder builder;
    // The red rectangle is nearer and is drawn first.
    builder.rectangle(1, 1, -2, builder.material({1, 0, 0, 0.5F}));
    builder.rectangle(2, 2, -3, builder.material({0, 1, 0, 0.5F}));
    CaptureSettings settings;
    settings.method = "unsorted";
    const auto result = composited(builder.scene(), testView(40, 30), settings);
    const std::uint32_t middle = result.image.offsets[result.image.pixelIndex(20, 15)];
    const auto seen = color(result.image, middle);
    EXPECT_FLOAT_EQ(seen.g, 0.5F);
    EXPECT_FLOAT_EQ(seen.r, 0.25F);
    EXPECT_FLOAT_EQ(result.image.z[middle], 2);
}

/// Returns the mean of green and red with these weights, at an opacity of 5/8 over blue.
glm::vec3 meanBehind(const glm::vec2& weight) {
    return {0.625F * weight.y / (weight.x + weight.y), 0.625F * weight.x / (weight.x + weight.y),
            0.375F};
}

TEST(Approximations, PutTheNearestOpaqueSurfaceBehindTheOthersIfOnlyTheVisibleIsShown) {
    SceneBuilder builder;
    builder.rectangle(9, 9, -5, builder.material({0, 0, 1, 1}, AlphaMode::kOpaque));
    builder.rectangle(9, 9, -7, builder.material({1, 1, 1, 1}, AlphaMode::kOpaque));
    builder.rectangle(9, 9, -6, builder.material({1, 1, 0, 0.5F}));  // hidden by the white wall
    builder.rectangle(9, 9, -4, builder.material({1, 0, 0, 0.25F}));
    builder.rectangle(9, 9, -3, builder.material({0, 1, 0, 0.5F}));
    const std::map<std::string, glm::vec3> expected = {
        // With the mean colour (1/3, 2/3, 0) and the mean alpha A = 3/8, (1 − A)² = 25/64 of the
        // blue shows through.
        {"weighted-average", {13.0F / 64, 26.0F / 64, 25.0F / 64}},
        {"weighted-sum", {0.25F, 0.5F, 0.25F}},
        {"unsorted", {0.125F, 0.5F, 0.375F}},
        {"weighted-blended",
         meanBehind({0.5F * 0.5F * 10 / 0.36001F, 0.25F * 0.25F * 10 / 0.64001F})},
        // Two depths have exact moments. A quarter of a fragment's own absorbance weakens it.
        {"moment-based",
         meanBehind({0.5F * std::pow(0.5F, 0.25F), 0.25F * 0.5F * std::pow(0.75F, 0.25F)})},
    };
    for (const auto& [method, rgb] : expected) {
        CaptureSettings settings;
        settings.method = method;
        settings.surfaces = Surfaces::kVisible;
        const auto result = composited(builder.scene(), testView(40, 30), settings);
        const auto seen = color(result.image, 0);
        EXPECT_EQ(result.plan.fragments_counted, 3 * 40 * 30U);
        const double near = method == "moment-based" ? 5e-3 : 1e-5;  // the moments are biased
        EXPECT_NEAR(seen.r, rgb.r, near) << method;
        EXPECT_NEAR(seen.g, rgb.g, near) << method;
        EXPECT_NEAR(seen.b, rgb.b, near) << method;
        EXPECT_NEAR(seen.a, 1, 1e-5) << method;
    }
}

TEST(Approximations, RefuseToFindLayersOrToLimitThem) {
    for (const auto& method : methodNames(false)) {
        for (const bool composite : {false, true}) {
            CaptureSettings settings;
            settings.method = method;
            settings.composite = composite;
            settings.max_layers = composite ? 2 : 0;
            try {
                capture(quads(2), testView(40, 30), settings);
                FAIL() << method;
            } catch (const Error& error) {
                EXPECT_EQ(error.kind(), ErrorKind::kUsage);
                EXPECT_NE(std::string(error.what()).find(method), std::string::npos);
            }
        }
    }
}

TEST(OcclusionRatio, EndsWithTheFirstLayerOnFewerPixels) {
    for (const auto& [name, scene] : hardScenes()) {
        const auto all = capture(scene, testView(160, 120));
        for (const double ratio : {0.9, 0.3, 0.05, 0.001}) {
            // Peels the captured A-buffer layer by layer, like a renderer with occlusion queries.
            std::uint32_t layers = 0;
            for (std::uint64_t touched = all.image.window.pixels();
                 static_cast<double>(touched) >= ratio * 160 * 120 && touched > 0; ++layers) {
                touched = 0;
                for (std::size_t p = 0; p < all.image.window.pixels(); ++p)
                    touched += all.image.count(p) > layers ? 1 : 0;
            }
            layers =
                std::min<std::uint32_t>(layers, static_cast<std::uint32_t>(all.plan.layers.size()));
            LayeredImage expected = all.image;
            keepLayers(expected, {.nearest = layers});
            for (const auto& method : methodNames(true)) {
                CaptureSettings settings;
                settings.method = method;
                settings.occlusion_ratio = ratio;
                const auto result = capture(scene, testView(160, 120), settings);
                EXPECT_EQ(result.plan.layers.size(), layers) << name << ", " << ratio;
                EXPECT_EQ(difference(result.image, expected), "") << name << ", " << method;
                EXPECT_EQ(result.plan.fragments_counted, all.image.fragments());
                EXPECT_EQ(result.plan.fragments_stored, expected.fragments());
            }
        }
    }
}

}  // namespace
}  // namespace peeler::test
