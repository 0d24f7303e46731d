// SPDX-License-Identifier: Apache-2.0
// Tests composites in which an opaque triangle is shaded once in a pixel.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include <peeler/composite.h>
#include <peeler/error.h>
#include "core/base/process_memory.h"
#include "core/capture/sample_target.h"
#include "core/fragments/supersampling.h"
#include "support/capture.h"
#include "support/flat.h"
#include "support/hard_scenes.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// Whether the driver can shade once per pixel.
bool supported() {
    return SampleTarget::supported(sharedContext().functions(), samplePositions(kPixelSamples));
}
CaptureSettings fourSamples(ShadePer shade_per) {
    CaptureSettings settings;
    settings.composite = true;
    settings.samples = static_cast<int>(kPixelSamples);
    settings.shade_per = shade_per;
    return settings;
}

/// Returns the largest difference of two composites in colour or, where both have a finite Z,
/// relative Z.
float largestDifference(const CompositeImage& a, const CompositeImage& b) {
    EXPECT_EQ(a.window, b.window);
    float largest = 0;
    for (std::size_t p = 0; p < a.rgba.size(); ++p) {
        for (std::size_t c = 0; c < 4; ++c)
            largest = std::max(largest, std::abs(a.rgba[p][c] - b.rgba[p][c]));
        for (std::size_t c = 0; c < 3 && a.tinted(); ++c)
            largest = std::max(largest, std::abs(a.opacity[p][c] - b.opacity[p][c]));
        EXPECT_EQ(std::isfinite(a.z[p]), std::isfinite(b.z[p])) << "pixel " << p;
        if (std::isfinite(a.z[p]) && std::isfinite(b.z[p]))
            largest = std::max(largest, std::abs(a.z[p] / b.z[p] - 1));
    }
    return largest;
}

/// Opaque, masked and transparent surfaces of one colour each; also glass at the depth of an opaque
/// surface, before and after it in draw order. All edges pass between the sample positions.
SceneBuilder flatColors() {
    SceneBuilder builder;
    const int red = builder.material({1, 0, 0, 1}, AlphaMode::kOpaque);
    const int green = builder.material({0, 0.5F, 0, 1}, AlphaMode::kMask);
    const int blue = builder.material({0, 0, 1, 0.25F});
    builder.rectangle(1.01F, 0.61F, -3, blue);
    builder.rectangle(0.83F, 0.72F, -3, red);
    builder.rectangle(0.47F, 0.79F, -3, blue);
    builder.triangles({{-1.13F, -0.9F, -2}, {0.7F, -0.31F, -4}, {0.2F, 0.95F, -3}}, green);
    builder.rectangle(0.33F, 0.29F, -2, blue);
    builder.rectangle(0.23F, 0.39F, -1.5F, red);
    return builder;
}

TEST(ShadePerPixel, EqualsEverySampleWhereColorsAreConstant) {
    if (!supported()) GTEST_SKIP() << "the driver has other sample positions";
    const SceneBuilder builder = flatColors();
    for (const PixelType precision : {PixelType::kHalf, PixelType::kFloat}) {
        for (const bool tinted : {false, true}) {
            CaptureSettings settings = fourSamples(ShadePer::kSample);
            settings.color_type = precision;
            settings.tinted = tinted;
            const Captured samples = capture(builder.scene(), testView(97, 61), settings);
            settings.shade_per = ShadePer::kPixel;
            const Captured pixels = capture(builder.scene(), testView(97, 61), settings);
            EXPECT_LE(largestDifference(flat(samples.image), flat(pixels.image)), 1e-6F);
            EXPECT_EQ(samples.plan.fragments_counted, pixels.plan.fragments_counted);
            ASSERT_EQ(samples.plan.layers.size(), pixels.plan.layers.size());
            for (std::size_t i = 0; i < samples.plan.layers.size(); ++i)
                EXPECT_EQ(samples.plan.layers[i].pixels, pixels.plan.layers[i].pixels);
        }
    }
}

// Drivers may place a sample of an edge on either side if they rasterise samples or shifted views.
TEST(ShadePerPixel, FindsTheFragmentsOfEverySample) {
    if (!supported()) GTEST_SKIP() << "the driver has other sample positions";
    for (const auto& [name, plain] : hardScenes()) {
        Scene scene = plain;
        for (std::size_t i = 0; i < scene.materials.size(); i += 2)
            scene.materials[i].alpha_mode = i % 4 == 0 ? AlphaMode::kOpaque : AlphaMode::kMask;
        const auto counted = [&](ShadePer shade_per) {
            return static_cast<double>(
                capture(scene, testView(160, 120), fourSamples(shade_per)).plan.fragments_counted);
        };
        const double wanted = counted(ShadePer::kSample);
        EXPECT_NEAR(counted(ShadePer::kPixel), wanted, 1e-3 * wanted) << name;
    }
}

// The mean of a linear function over a pixel's samples is its value at their centroid.
TEST(ShadePerPixel, ShadesAtTheCentroidOfTheVisibleSamples) {
    if (!supported()) GTEST_SKIP() << "the driver has other sample positions";
    SceneBuilder builder;
    const int white = builder.material({1, 1, 1, 1}, AlphaMode::kOpaque);
    builder.triangles({{-1.13F, -0.9F, -3}, {1.31F, -0.41F, -3}, {0.2F, 0.95F, -3}}, white);
    builder.scene().meshes[0].primitives[0].colors = {{1, 0, 0, 1}, {0, 1, 0, 1}, {0, 0, 1, 1}};
    builder.rectangle(0.23F, 0.17F, -2, white);
    CaptureSettings settings = fourSamples(ShadePer::kSample);
    settings.color_type = PixelType::kFloat;
    const CompositeImage samples = flat(capture(builder.scene(), testView(97, 61), settings).image);
    settings.shade_per = ShadePer::kPixel;
    const CompositeImage pixels = flat(capture(builder.scene(), testView(97, 61), settings).image);
    EXPECT_LE(largestDifference(samples, pixels), 1e-4F);
}

TEST(ShadePerPixel, FiltersTexturesAtEverySample) {
    if (!supported()) GTEST_SKIP() << "the driver has other sample positions";
    SceneBuilder builder;
    const int checkered = builder.material({1, 1, 1, 1}, AlphaMode::kOpaque);
    builder.triangles({{-1.13F, -0.9F, -3}, {1.31F, -0.41F, -3}, {0.2F, 0.95F, -3}}, checkered);
    builder.scene().meshes[0].primitives[0].texcoords[0] = {{0, 0}, {9, 1}, {3, 7}};
    Image image;
    image.width = image.height = 4;
    for (int i = 0; i < 16; ++i)
        image.rgba.insert(image.rgba.end(), 3, (i + i / 4) % 2 ? 255 : 0),
            image.rgba.push_back(255);
    builder.scene().images.push_back(image);
    builder.scene().materials[static_cast<std::size_t>(checkered)].base_color_texture.image = 0;
    CaptureSettings settings = fourSamples(ShadePer::kSample);
    settings.color_type = PixelType::kFloat;
    const CompositeImage samples = flat(capture(builder.scene(), testView(97, 61), settings).image);
    settings.shade_per = ShadePer::kPixel;
    const CompositeImage pixels = flat(capture(builder.scene(), testView(97, 61), settings).image);
    EXPECT_LE(largestDifference(samples, pixels), 0.02F);
}

TEST(ShadePerPixel, IsTheSameInBandsAndCrops) {
    if (!supported()) GTEST_SKIP() << "the driver has other sample positions";
    const SceneBuilder builder = flatColors();
    const PosedScene posed(builder.scene(), 0);
    GlRenderer renderer(sharedContext(), posed);
    CaptureSettings settings = fourSamples(ShadePer::kPixel);
    View view = testView(97, 61);
    const CompositeImage whole = flat(capture(renderer, view, settings).image);
    settings.band_bytes = 1 << 16;
    EXPECT_EQ(largestDifference(flat(capture(renderer, view, settings).image), whole), 0);
    view.crop = {13, 7, 71, 52};
    const CompositeImage part = flat(capture(renderer, view, settings).image);
    for (int y = view.crop.y0; y < view.crop.y1; ++y)
        for (int x = view.crop.x0; x < view.crop.x1; ++x)
            EXPECT_EQ(part.rgba[static_cast<std::size_t>((y - 7) * 58 + x - 13)],
                      whole.rgba[static_cast<std::size_t>(y * 97 + x)])
                << x << ' ' << y;
}

TEST(ShadePerPixel, IsTheSameWithoutRoomToKeepComposites) {
    if (!supported()) GTEST_SKIP() << "the driver has other sample positions";
    const SceneBuilder builder = flatColors();
    const View view = testView(2000, 1500);
    CaptureSettings settings = fourSamples(ShadePer::kPixel);
    const Captured kept = capture(builder.scene(), view, settings);
    settings.memory = MemoryBudget(std::uint64_t{400} << 20);
    settings.memory.base = residentBytes();
    const Captured counted = capture(builder.scene(), view, settings);
    EXPECT_GT(counted.bands.size(), 1U);
    EXPECT_EQ(kept.plan.fragments_counted, counted.plan.fragments_counted);
    EXPECT_EQ(largestDifference(flat(kept.image), flat(counted.image)), 0);
}

/// Returns an opaque triangle whose colour changes along its edges.
SceneBuilder rainbow() {
    SceneBuilder builder;
    const int white = builder.material({1, 1, 1, 1}, AlphaMode::kOpaque);
    builder.triangles({{-1.13F, -0.9F, -3}, {1.31F, -0.41F, -2}, {0.2F, 0.95F, -4}}, white);
    builder.scene().meshes[0].primitives[0].colors = {{1, 0, 0, 1}, {0, 1, 0, 1}, {0, 0, 1, 1}};
    return builder;
}

TEST(ShadePerPixel, IsTheDefaultOfOpaqueScenesWithinTheBudget) {
    if (!supported()) GTEST_SKIP() << "the driver has other sample positions";
    const auto picture = [](const SceneBuilder& builder, ShadePer shade_per, MemoryBudget memory) {
        CaptureSettings settings = fourSamples(shade_per);
        settings.memory = memory;
        return capture(builder.scene(), testView(97, 61), settings).image.color.data;
    };
    constexpr std::uint64_t kLarge = std::uint64_t{8} << 30;
    const SceneBuilder opaque = rainbow();
    SceneBuilder mixed = rainbow();
    mixed.rectangle(0.1F, 0.1F, -1, mixed.material({0, 0, 1, 0.5F}));
    const auto pixel = picture(opaque, ShadePer::kPixel, 0);
    EXPECT_NE(pixel, picture(opaque, ShadePer::kSample, 0));
    EXPECT_EQ(pixel, picture(opaque, ShadePer::kAuto, 0));
    EXPECT_EQ(pixel, picture(opaque, ShadePer::kAuto, kLarge));
    EXPECT_EQ(picture(mixed, ShadePer::kSample, 0), picture(mixed, ShadePer::kAuto, 0));
    EXPECT_NE(picture(mixed, ShadePer::kSample, 0), picture(mixed, ShadePer::kPixel, 0));
}

TEST(ShadePerPixel, IsRefusedOrLeftOutWhereSamplesDiffer) {
    SceneBuilder lines = rainbow();
    lines.scene().meshes.back().primitives[0].topology = Topology::kLineLoop;
    CaptureSettings layers = fourSamples(ShadePer::kSample), others = layers, eight = layers;
    layers.composite = false;
    others.method = "front-to-back";
    eight.samples = 8;
    const SceneBuilder triangles = rainbow();
    const std::pair<const Scene*, CaptureSettings> cases[] = {
        {&lines.scene(), fourSamples(ShadePer::kSample)},
        {&triangles.scene(), layers},
        {&triangles.scene(), others},
        {&triangles.scene(), eight}};
    for (auto [scene, settings] : cases) {
        const Captured wanted = capture(*scene, testView(40, 30), settings);
        settings.shade_per = ShadePer::kAuto;
        const Captured found = capture(*scene, testView(40, 30), settings);
        EXPECT_EQ(found.image.z, wanted.image.z);
        EXPECT_EQ(found.image.color.data, wanted.image.color.data);
        settings.shade_per = ShadePer::kPixel;
        try {
            capture(*scene, testView(40, 30), settings);
            ADD_FAILURE() << "not refused";
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        }
    }
}

}  // namespace
}  // namespace peeler::test
