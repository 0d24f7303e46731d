// SPDX-License-Identifier: Apache-2.0
// Tests that methods, backends, bands and raster tiles give the same fragments, bit for bit.
#include <gtest/gtest.h>

#include <cstdio>

#include <peeler/error.h>
#include "core/base/process_memory.h"
#include "core/capture/method.h"
#include "core/capture/scene_rasterizer.h"
#include "support/capture.h"
#include "support/hard_scenes.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

TEST(Methods, AgreeBitForBitOnHardScenes) {
    for (const auto& [name, scene] : hardScenes()) {
        const View view = testView(160, 120);
        const auto reference = capture(scene, view);
        EXPECT_GT(reference.image.fragments(), 1000U) << name;
        for (const auto& method : peelMethods()) {
            if (!method.exact()) continue;
            CaptureSettings s;
            s.method = method.name;
            EXPECT_EQ(difference(reference.image, capture(scene, view, s).image), "")
                << name << ", " << method.name;
        }
    }
}

TEST(Backends, AgreeBitForBitOnHardScenes) {
    if (!sharedContext().device().software) GTEST_SKIP() << "a GPU rounds as it likes";
    const std::string other = testBackend() == "egl" ? "osmesa" : "egl";
    const View view = testView(160, 120);
    for (const auto& [name, scene] : hardScenes()) {
        const auto here = capture(scene, view);
        LayeredImage there;
        inOwnThread([&, &shown = scene] {
            const auto context = gl::createContext({.backend = other});
            there = capture(shown, view, {}, *context).image;
        });
        EXPECT_EQ(difference(here.image, there), "") << name << " on " << other;
    }
}

// Core OpenGL has no framebuffer fetch, so the shaders count fragments with atomics instead.
TEST(Extensions, DoNotChangeTheResult) {
    const View view = testView(160, 120);
    for (const auto& [name, scene] : hardScenes()) {
        const auto extended = capture(scene, view);
        inOwnThread([&, &shown = scene] {
            const auto core = gl::createContext({.backend = testBackend(), .core_only = true});
            EXPECT_EQ(difference(extended.image, capture(shown, view, {}, *core).image), "")
                << name;
        });
    }
    if (!sharedContext().device().limits.framebuffer_fetch)
        std::printf("the driver has no framebuffer fetch: both were core OpenGL\n");
}

TEST(Bands, DoNotChangeTheResult) {
    const auto scenes = hardScenes();
    const View view = testView(320, 240);
    const auto whole = capture(scenes[0].scene, view);
    ASSERT_EQ(whole.bands.size(), 1U);
    for (const auto& method : peelMethods()) {
        if (!method.exact()) continue;
        CaptureSettings small;
        small.method = method.name;
        small.band_bytes = 1 << 20;
        const auto cut = capture(scenes[0].scene, view, small);
        EXPECT_GT(cut.bands.size(), 3U);
        EXPECT_EQ(difference(whole.image, cut.image), "") << method.name;
    }
    View cropped = view;
    cropped.crop = {13, 57, 301, 199};
    const auto part = capture(scenes[0].scene, cropped);
    for (int y = cropped.crop.y0; y < cropped.crop.y1; ++y) {
        for (int x = cropped.crop.x0; x < cropped.crop.x1; ++x) {
            const std::size_t a = whole.image.pixelIndex(x, y), b = part.image.pixelIndex(x, y);
            ASSERT_EQ(whole.image.count(a), part.image.count(b));
            for (std::uint32_t k = 0; k < whole.image.count(a); ++k) {
                ASSERT_EQ(whole.image.z[whole.image.offsets[a] + k],
                          part.image.z[part.image.offsets[b] + k]);
            }
        }
    }
}

// On a GPU, a band is captured while the previous band is read. A software rasteriser gains nothing
// from the overlap, but must give the same bands.
TEST(Bands, ThatOverlapAreTheSame) {
    const int scale = exhaustive() ? 2 : 1;
    const View view = testView(80 * scale, 60 * scale);
    CaptureSettings described, nearest, precise, rays;
    described.channels = {Channel::kNormal, Channel::kId, Channel::kBaseColor};
    nearest.max_layers = 2;
    precise.color_type = PixelType::kFloat;
    precise.tinted = true;
    rays.hit_mode = HitMode::kRefined;
    const Scene scene = glassScene();
    inOwnThread([&] {
        const auto context = gl::createContext({.backend = testBackend(), .core_only = true});
        gl::Device device = context->device();
        const auto compare = [&](CaptureSettings s, std::string_view what) {
            device.software = true;
            context->setDevice(device);
            const auto whole = capture(scene, view, s, *context);
            device.software = false;
            context->setDevice(device);
            s.band_bytes = (1U << 16) * static_cast<unsigned>(scale * scale);
            const auto cut = capture(scene, view, s, *context);
            EXPECT_GT(cut.bands.size(), 3U) << what;
            EXPECT_EQ(difference(whole.image, cut.image), "") << what;
        };
        compare(rays, "rays");
        compare(described, "channels");
        std::size_t i = 0;
        for (const auto& method : peelMethods()) {
            if (!method.exact()) continue;
            CaptureSettings s = ++i % 2 == 0 ? nearest : precise;
            s.method = method.name;
            compare(s, method.name);
        }
    });
}

TEST(Bands, MethodsAndSurfacesAgreeAcrossRasterTiles) {
    auto scenes = hardScenes();
    Scene& scene = scenes[0].scene;
    for (std::size_t i = 0; i < scene.materials.size(); i += 3)
        scene.materials[i].alpha_mode = AlphaMode::kOpaque;
    View view = testView(4200, 150);
    view.projection.half_width = 0.5;  // the same frustum, stretched over two raster tiles
    view.crop = {3900, 10, 4200, 140};
    for (const Surfaces surfaces : {Surfaces::kAll, Surfaces::kVisible, Surfaces::kTransparent}) {
        CaptureSettings s;
        s.surfaces = surfaces;
        const auto whole = capture(scene, view, s);
        for (const auto& method : peelMethods()) {
            if (!method.exact()) continue;
            s.method = method.name;
            s.band_bytes = 1 << 19;
            const auto cut = capture(scene, view, s);
            EXPECT_GT(cut.bands.size(), 3U);
            EXPECT_EQ(difference(whole.image, cut.image), "") << method.name;
            s.max_layers = 2;
            const auto nearest = capture(scene, view, s);
            for (std::size_t p = 0; p < view.crop.pixels(); ++p) {
                ASSERT_EQ(nearest.image.count(p), std::min(2U, whole.image.count(p)));
                for (std::uint32_t k = 0; k < nearest.image.count(p); ++k) {
                    ASSERT_EQ(nearest.image.z[nearest.image.offsets[p] + k],
                              whole.image.z[whole.image.offsets[p] + k]);
                }
            }
            s.max_layers = 0;
        }
    }
}
TEST(Bands, LeaveRoomForWhatTheSinksHold) {
    struct LargeSink : CollectSink {
        SinkMemory memory(const Plan&) const override { return {0, bytes}; }
        std::uint64_t bytes = 0;
    } sink;
    SceneBuilder builder;
    builder.rectangle(1, 1, -2, builder.material({1, 1, 1, 0.5F}));
    const PosedScene shown(builder.scene(), 0);
    GlRenderer renderer(sharedContext(), shown);
    CaptureSettings s;
    // Memory freed by earlier tests must not add to the budget.
    returnFreeMemory();
    s.memory = residentBytes() + (512ULL << 20);
    const CapturePlan plan = renderer.plan(testView(64, 64), s);
    EXPECT_NO_THROW(renderer.capture(plan, sink));
    sink.bytes = 512ULL << 20;
    try {
        renderer.capture(plan, sink);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kMemory);
    }
}

}  // namespace
}  // namespace peeler::test
