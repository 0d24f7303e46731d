// SPDX-License-Identifier: Apache-2.0
// Tests the layers of pictures through lenses: against pinhole pictures, by method and by band.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include <peeler/error.h>
#include "core/capture/method.h"
#include "core/image/channels.h"
#include "core/lens/lens.h"
#include "core/scene/intrinsics.h"
#include "support/capture.h"
#include "support/flat.h"
#include "support/hard_scenes.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// Returns a view through a lens that differs from a pinhole by less than rounding.
View throughFlatLens(View view) {
    const double focal = view.height / (2 * view.projection.half_height);
    setLens(view, {makeLens("opencv", {0, 0, 0, 0, 1e-12}),
                   {focal, focal, (view.width - 1) / 2.0, (view.height - 1) / 2.0}});
    return view;
}

View throughFisheye(View view, double focal) {
    setLens(view, {makeLens("fisheye", {}),
                   {focal, focal, (view.width - 1) / 2.0, (view.height - 1) / 2.0}});
    return view;
}

/// Opaque, blended and tinted surfaces, lit and unlit, one behind the other.
Scene glassAndSpheres() {
    SceneBuilder builder;
    const int red = builder.lit(builder.material({0.9F, 0.2F, 0.1F, 1}, AlphaMode::kOpaque));
    const int blue = builder.lit(builder.material({0.1F, 0.3F, 0.9F, 0.4F}));
    const int pane = builder.material({0.2F, 0.8F, 0.3F, 0.5F});
    const int glass = builder.lit(builder.material({0.9F, 0.6F, 0.2F, 1}, AlphaMode::kOpaque));
    Material& tinted = builder.scene().materials[static_cast<std::size_t>(glass)];
    tinted.transmission.factor = 0.8F;
    builder.sphere({-0.5F, 0, -3}, 0.6F, red);
    builder.sphere({0.6F, 0.1F, -2.5F}, 0.5F, blue);
    builder.sphere({0.1F, -0.3F, -1.8F}, 0.3F, glass);
    builder.rectangle(1.5F, 0.4F, -2, pane);
    builder.rectangle(3, 3, -5, red);
    return builder.scene();
}

/// Expects an Error (kUsage) with these words.
void expectRefused(const std::function<void()>& call, const std::string& words) {
    try {
        call();
        ADD_FAILURE() << "nothing was refused: " << words;
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
}

struct Likeness {
    double pixels = 0;  ///< share of the pixels that have as many fragments
    double values = 0;  ///< share of their colour components and channel values that are alike
};

/// Compares the fragments of two images. At the edges of triangles they may differ.
Likeness likeness(const LayeredImage& a, const LayeredImage& b) {
    constexpr float kTolerance = 2e-3F;
    double pixels = 0, values = 0, alike = 0;
    const auto compare = [&](float x, float y) {
        ++values;
        alike += std::abs(x - y) <= kTolerance ? 1 : 0;
    };
    for (std::size_t p = 0; p < a.window.pixels(); ++p) {
        if (a.count(p) != b.count(p)) continue;
        ++pixels;
        for (std::uint32_t i = 0; i < a.count(p); ++i) {
            const std::uint32_t f = a.offsets[p] + i, g = b.offsets[p] + i;
            for (int c = 0; c < 4; ++c)
                compare(color(a, f)[c], color(b, g)[c]);
            for (std::size_t k = 0; k < a.extra.size(); ++k)
                for (std::size_t c = 0; c < a.extra[k].components(); ++c)
                    compare(FragmentChannel(a.extra[k], c).value(f),
                            FragmentChannel(b.extra[k], c).value(g));
        }
    }
    return {pixels / static_cast<double>(a.window.pixels()), alike / values};
}

TEST(TracedLayers, EqualAPinholesThroughALensWithoutDistortion) {
    const Scene scene = glassAndSpheres();
    const PosedScene posed(scene, 0);
    GlRenderer renderer(sharedContext(), posed);
    const View view = testView(64, 48), lens = throughFlatLens(view);
    const std::vector<std::pair<const char*, std::function<void(CaptureSettings&)>>> cases = {
        {"all", [](CaptureSettings&) {}},
        {"visible", [](CaptureSettings& s) { s.surfaces = Surfaces::kVisible; }},
        {"transparent", [](CaptureSettings& s) { s.surfaces = Surfaces::kTransparent; }},
        {"opaque", [](CaptureSettings& s) { s.opaque_only = true; }},
        {"both faces", [](CaptureSettings& s) { s.faces = Faces::kBoth; }},
        {"two layers", [](CaptureSettings& s) { s.max_layers = 2; }},
        {"unlit", [](CaptureSettings& s) { s.shading = Shading::kUnlit; }},
        {"tinted", [](CaptureSettings& s) { s.tinted = true; }},
        {"half", [](CaptureSettings& s) { s.color_type = PixelType::kHalf; }},
        {"shadows", [](CaptureSettings& s) { s.shadows = true; }},
        {"channels",
         [](CaptureSettings& s) {
             s.channels = {Channel::kNormal,  Channel::kGeometricNormal, Channel::kPosition,
                           Channel::kTangent, Channel::kBaseColor,       Channel::kFacing,
                           Channel::kId,      Channel::kDistance};
         }},
        {"four samples", [](CaptureSettings& s) { s.samples = 4; }},
        {"composite", [](CaptureSettings& s) { s.composite = true; }},
        {"composite of four samples",
         [](CaptureSettings& s) {
             s.composite = true;
             s.samples = 4;
         }},
    };
    for (const auto& [name, change] : cases) {
        CaptureSettings settings;
        settings.color_type = PixelType::kFloat;
        change(settings);
        const Captured pinhole = capture(renderer, view, settings);
        const Captured traced = capture(renderer, lens, settings);
        ASSERT_GT(pinhole.image.fragments(), 500U) << name;
        const auto [pixels, values] = likeness(pinhole.image, traced.image);
        EXPECT_GE(pixels, 0.995) << name;
        EXPECT_GE(values, 0.995) << name;
        EXPECT_EQ(traced.image.tinted(), pinhole.image.tinted()) << name;
        EXPECT_TRUE(traced.plan.complete() || settings.max_layers != 0) << name;
        if (settings.composite) continue;
        EXPECT_EQ(traced.plan.fragments_stored, traced.image.fragments()) << name;
    }
}

TEST(TracedLayers, AreTheSameForEveryMethodAndBand) {
    const Scene scene = glassAndSpheres();
    const PosedScene posed(scene, 0);
    GlRenderer renderer(sharedContext(), posed);
    const View view = throughFisheye(testView(64, 48), 20);
    CaptureSettings settings;
    const Captured whole = capture(renderer, view, settings);
    for (const MethodInfo& method : peelMethods()) {
        settings = {};
        settings.method = method.name;
        settings.composite = !method.exact();
        if (!method.exact()) {
            expectRefused([&] { renderer.plan(view, settings); }, "cannot look through a lens");
            continue;
        }
        settings.band_bytes = 1U << 17;
        const Captured other = capture(renderer, view, settings);
        EXPECT_GT(other.bands.size(), 1U);
        EXPECT_EQ(difference(whole.image, other.image), "") << method.name;
        settings.composite = true;
        EXPECT_EQ(flat(capture(renderer, view, settings).image).rgba, flat(whole.image).rgba)
            << method.name;
    }
}

TEST(TracedLayers, ShadeMoreHitsThanFitAtOnce) {
    SceneBuilder builder;
    const int pane = builder.material({0.2F, 0.4F, 0.8F, 0.5F});
    for (int i = 0; i < 40; ++i)
        builder.rectangle(9, 9, -1 - 0.1F * static_cast<float>(i), pane);
    CaptureSettings settings;
    settings.color_type = PixelType::kFloat;
    const Captured traced =
        capture(builder.scene(), throughFisheye(testView(100, 80), 60), settings);
    ASSERT_EQ(traced.image.fragments(), 40U * 100 * 80);
    for (std::size_t i = 0; i < traced.image.fragments(); ++i)
        ASSERT_EQ(color(traced.image, i), glm::vec4(0.1F, 0.2F, 0.4F, 0.5F)) << i;
}

TEST(TracedLayers, FollowThePoseAndTheNextFrame) {
    SceneBuilder builder;
    const int node =
        builder.rectangle(0.5F, 0.5F, -2, builder.material({1, 1, 1, 1}, AlphaMode::kOpaque));
    const Scene& scene = builder.scene();
    const auto moved = [&](double x) {
        Pose pose = restPose(scene);
        pose.locals[static_cast<std::size_t>(node)][3].x += x;
        return PosedScene(scene, 0, pose);
    };
    GlRenderer renderer(sharedContext(), moved(0));
    const View view = testView(80, 60), lens = throughFlatLens(view);
    CaptureSettings settings;
    settings.color_type = PixelType::kFloat;
    settings.channels = {Channel::kMotion};
    for (const double x : {0.0, 0.24}) {
        renderer.setPose(moved(x));
        renderer.setNextFrame({moved(x + 0.1), view});
        const Captured pinhole = capture(renderer, view, settings);
        renderer.setNextFrame({moved(x + 0.1), lens});
        const Captured traced = capture(renderer, lens, settings);
        const auto [pixels, values] = likeness(pinhole.image, traced.image);
        EXPECT_EQ(pixels, 1);
        EXPECT_EQ(values, 1);
        EXPECT_NEAR(FragmentChannel(traced.image.extra.front(), 0).value(0), 60 * 0.1 / 2, 1e-3);
    }
}

TEST(TracedLayers, RefuseWhatNeedsTheRasteriser) {
    const Scene scene = glassAndSpheres();
    const PosedScene posed(scene, 0);
    GlRenderer renderer(sharedContext(), posed);
    const View view = throughFisheye(testView(32, 24), 10);
    CaptureSettings settings;
    settings.clip.half_spaces = {{{0, 0, 1}, -2}};
    expectRefused([&] { renderer.plan(view, settings); }, "cannot be clipped");
    settings = {};
    const CapturePlan plan = renderer.plan(view, settings);
    const auto bands = renderer.bandsOnGpu(plan);
    expectRefused([&] { renderer.captureOnGpu(plan, bands.front()); }, "do not stay on the GPU");
}

}  // namespace
}  // namespace peeler::test
