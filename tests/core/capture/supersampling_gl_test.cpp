// SPDX-License-Identifier: Apache-2.0
// Tests supersampling: composites converge, and merged layers composite to the same picture.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include <peeler/composite.h>
#include "assets/model_files.h"
#include "cmd/options/camera_options.h"
#include "core/capture/method.h"
#include "formats/gltf/gltf_reader.h"
#include "support/capture.h"
#include "support/flat.h"
#include "support/hard_scenes.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

CaptureSettings samplesAPixel(int samples, bool composite) {
    CaptureSettings settings;
    settings.samples = samples;
    settings.composite = composite;
    settings.color_type = PixelType::kFloat;
    return settings;
}

double rmse(const CompositeImage& a, const CompositeImage& b) {
    double sum = 0;
    for (std::size_t p = 0; p < a.rgba.size(); ++p) {
        for (std::size_t c = 0; c < 4; ++c) {
            const double d = static_cast<double>(a.rgba[p][c]) - static_cast<double>(b.rgba[p][c]);
            sum += d * d;
        }
    }
    return std::sqrt(sum / (4.0 * static_cast<double>(a.rgba.size())));
}

float worstColor(const CompositeImage& a, const CompositeImage& b) {
    float most = 0;
    for (std::size_t p = 0; p < a.rgba.size(); ++p)
        for (std::size_t c = 0; c < 4; ++c)
            most = std::max(most, std::abs(a.rgba[p][c] - b.rgba[p][c]));
    return most;
}

/// Renders a regular grid of 16 × 16 samples per pixel: captures a picture 16 times as wide and
/// high, and averages it.
CompositeImage reference(const Scene& scene, const View& view) {
    constexpr int kGrid = 16;
    View large = view;
    large.width *= kGrid;
    large.height *= kGrid;
    large.crop = {0, 0, large.width, large.height};
    const CompositeImage fine = flat(capture(scene, large, samplesAPixel(1, true)).image);
    CompositeImage mean;
    mean.window = view.crop;
    mean.rgba.resize(view.crop.pixels());
    mean.z.resize(view.crop.pixels());
    for (int y = 0; y < large.height; ++y) {
        for (int x = 0; x < large.width; ++x) {
            const auto from = static_cast<std::size_t>(y) * static_cast<std::size_t>(large.width) +
                              static_cast<std::size_t>(x);
            const auto to =
                static_cast<std::size_t>(y / kGrid) * static_cast<std::size_t>(view.width) +
                static_cast<std::size_t>(x / kGrid);
            for (std::size_t c = 0; c < 4; ++c)
                mean.rgba[to][c] += fine.rgba[from][c] / (kGrid * kGrid);
        }
    }
    return mean;
}

TEST(Supersampling, ConvergesToAGridOf16By16Samples) {
    const View view = exhaustive() ? testView(80, 60) : testView(48, 36);
    for (const auto& [name, scene] : hardScenes()) {
        // Skips the scene of horizontal edges, because a reference with 16 rows is no better than
        // 16 samples there.
        if (name == std::string("grazing quads")) continue;
        const CompositeImage wanted = reference(scene, view);
        double last = 1e9;
        for (const int samples : {1, 2, 4, 8, 16, 32, 64}) {
            const double error =
                rmse(flat(capture(scene, view, samplesAPixel(samples, true)).image), wanted);
            std::printf("%s, %d samples: RMSE %.5f\n", name, samples, error);
            EXPECT_LT(error, last) << name << ", " << samples;
            last = error;
        }
        EXPECT_LT(last, 0.01) << name;
    }
}

TEST(Supersampling, LayersCompositeToTheSupersampledComposite) {
    const View view = exhaustive() ? testView(160, 120) : testView(80, 60);
    for (const auto& [name, scene] : hardScenes()) {
        for (const int samples : {2, 4, 9}) {
            const auto composite = capture(scene, view, samplesAPixel(samples, true));
            const auto layers = capture(scene, view, samplesAPixel(samples, false));
            EXPECT_LT(worstColor(flat(layers.image), flat(composite.image)), 1e-4F) << name;
            EXPECT_EQ(layers.plan.samples, samples);
            EXPECT_TRUE(layers.plan.complete());
        }
    }
}

TEST(Supersampling, LayersOfTheExampleScenesCompositeToTheSupersampledComposite) {
    std::size_t scenes = 0;
    for (const auto& path : modelFiles(sourceDir() / "examples" / "scenes")) {
        ++scenes;
        const Scene scene = readGltf(path);
        cmd::CameraOptions camera;
        camera.size = exhaustive() ? Size{240, 135} : Size{120, 68};
        const PosedScene contained(scene, 0);
        const View view = cmd::makeView(contained, SceneExtent(contained), camera);
        const CompositeImage composite = flat(capture(scene, view, samplesAPixel(4, true)).image);
        CaptureSettings stored = samplesAPixel(4, false);
        stored.color_type = PixelType::kHalf;
        // Values brighter than white are clipped, as on a display.
        auto shown = [](CompositeImage image) {
            for (auto& color : image.rgba)
                for (float& component : color)
                    component = std::min(component, 1.0F);
            return image;
        };
        const float in_file =
            worstColor(shown(flat(capture(scene, view, stored).image)), shown(composite));
        EXPECT_LT(in_file, 1 / 255.0F) << path;
        stored.color_type = PixelType::kFloat;
        const float exact = worstColor(flat(capture(scene, view, stored).image), composite);
        EXPECT_LT(exact, 1e-4F) << path;
        std::printf("%s: %.5f in half, %.7f in float\n", path.filename().c_str(),
                    static_cast<double>(in_file), static_cast<double>(exact));
    }
    EXPECT_GE(scenes, 5U);
}

TEST(Supersampling, MethodsAndBandsAgree) {
    const int scale = exhaustive() ? 2 : 1;
    const View view = testView(48 * scale, 36 * scale);
    for (const auto& [name, scene] : hardScenes()) {
        const PosedScene shown(scene, 0);
        GlRenderer renderer(sharedContext(), shown);
        const auto layers = capture(renderer, view, samplesAPixel(3, false));
        const auto composite = flat(capture(renderer, view, samplesAPixel(3, true)).image);
        for (const auto& method : peelMethods()) {
            if (!method.exact()) continue;
            CaptureSettings settings = samplesAPixel(3, false);
            settings.method = method.name;
            settings.band_bytes = (1U << 17) * static_cast<unsigned>(scale * scale);
            const auto other = capture(renderer, view, settings);
            EXPECT_GT(other.bands.size(), 1U);
            EXPECT_EQ(difference(layers.image, other.image), "") << name << ", " << method.name;
            settings.composite = true;
            EXPECT_LT(worstColor(composite, flat(capture(renderer, view, settings).image)), 1e-5F)
                << name << ", " << method.name;
        }
    }
}

TEST(Supersampling, SamplesThatSeeNothingInABandAddNothingToIt) {
    // The quad's upper edge is at 8.25 rows of 24, so a quarter of row 8 is empty.
    SceneBuilder builder;
    builder.quad({-9, -9, -2}, {9, -9, -2}, {9, 0.625F, -2}, {-9, 0.625F, -2},
                 builder.material({1, 0.5F, 0.25F, 0.5F}));
    const View view = testView(32, 24);
    for (const auto& method : peelMethods()) {
        CaptureSettings settings = samplesAPixel(4, true);
        settings.method = method.name;
        const auto whole = capture(builder.scene(), view, settings);
        // With this limit, on-the-fly composites use one row per band; layers need more memory per
        // row.
        settings.band_bytes = method.composite ? 1 << 12 : 1 << 14;
        const auto cut = capture(builder.scene(), view, settings);
        EXPECT_GE(cut.bands.size(), method.composite ? 24U : 2U);
        EXPECT_EQ(difference(whole.image, cut.image), "") << method.name;
    }
}

TEST(Supersampling, TheListsOfAllSamplesCountAmongABandsBytes) {
    SceneBuilder builder;
    builder.rectangle(0.01F, 0.01F, -2, builder.material({1, 1, 1, 0.5F}));
    CaptureSettings settings = samplesAPixel(64, false);
    settings.band_bytes = 1 << 20;
    const auto result = capture(builder.scene(), testView(160, 120), settings);
    for (const Window& band : result.bands)
        EXPECT_LT(band.pixels() * 64 * sizeof(std::uint32_t), settings.band_bytes);
}

TEST(Supersampling, KeepsTheNearestMergedLayers) {
    const View view = testView(160, 120);
    const Scene scene = hardScenes()[0].scene;
    const auto all = capture(scene, view, samplesAPixel(4, false));
    CaptureSettings settings = samplesAPixel(4, false);
    settings.max_layers = 3;
    const auto few = capture(scene, view, settings);
    EXPECT_EQ(few.plan.layers.size(), 3U);
    EXPECT_EQ(few.plan.fragments_counted, all.image.fragments());
    EXPECT_EQ(few.plan.fragments_stored, few.image.fragments());
    for (std::size_t p = 0; p < view.crop.pixels(); ++p) {
        ASSERT_EQ(few.image.count(p), std::min(3U, all.image.count(p)));
        for (std::uint32_t k = 0; k < few.image.count(p); ++k)
            ASSERT_EQ(few.image.z[few.image.offsets[p] + k], all.image.z[all.image.offsets[p] + k]);
    }
}

TEST(Supersampling, AnEdgeHasItsCoverageInAlpha) {
    SceneBuilder builder;
    // The edges are at x = 4.25 and 12.75 of 16 pixels (half_width 2/3 at distance 2 spans 8/3
    // units).
    const auto at = [](double pixel) { return static_cast<float>((pixel / 8 - 1) * 4 / 3); };
    builder.quad({at(4.25), -9, -2}, {at(12.75), -9, -2}, {at(12.75), 9, -2}, {at(4.25), 9, -2},
                 builder.material({0.5F, 1, 0.25F, 0.5F}));
    const auto result = capture(builder.scene(), testView(16, 12), samplesAPixel(16, false));
    ASSERT_EQ(result.plan.layers.size(), 1U);
    const auto alpha = [&](int x) {
        const std::size_t pixel = result.image.pixelIndex(x, 6);
        return result.image.count(pixel) ? color(result.image, result.image.offsets[pixel]).a : 0;
    };
    EXPECT_FLOAT_EQ(alpha(3), 0);
    EXPECT_FLOAT_EQ(alpha(4), 0.5F * 0.75F);
    EXPECT_FLOAT_EQ(alpha(8), 0.5F);
    EXPECT_FLOAT_EQ(alpha(12), 0.5F * 0.75F);
    EXPECT_FLOAT_EQ(alpha(13), 0);
}

TEST(Supersampling, SurfacesThatMeetAtAnEdgeDoNotLetTheBackgroundThrough) {
    SceneBuilder builder;  // two opaque halves of a picture, at different depths
    builder.quad({-9, -9, -2}, {0.01F, -9, -2}, {0.01F, 9, -2}, {-9, 9, -2},
                 builder.material({1, 0, 0, 1}, AlphaMode::kOpaque));
    builder.quad({0.015F, -9, -3}, {9, -9, -3}, {9, 9, -3}, {0.015F, 9, -3},
                 builder.material({0, 1, 0, 1}, AlphaMode::kOpaque));
    const auto result = capture(builder.scene(), testView(15, 11), samplesAPixel(16, false));
    for (const auto& rgba : flat(result.image).rgba)
        EXPECT_FLOAT_EQ(rgba[3], 1);
}

}  // namespace
}  // namespace peeler::test
