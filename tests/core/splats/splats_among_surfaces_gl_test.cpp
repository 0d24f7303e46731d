// SPDX-License-Identifier: Apache-2.0
// Tests Gaussian splats among surfaces: order, hidden splats, methods, bands, samples, channels.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "core/capture/gl_session.h"
#include "core/capture/method.h"
#include "core/image/layers.h"
#include "core/image/merge.h"
#include "core/splats/splat_layers.h"
#include "support/capture.h"
#include "support/flat.h"
#include "support/splats.h"

namespace peeler::test {
namespace {

/// Adds a cloud of small splats in front of the camera to a scene.
void addSplats(SceneBuilder& builder, std::size_t count) {
    Primitive& primitive = addPoints(builder);
    const auto splats = std::make_shared<Splats>();
    std::mt19937 random(7);
    std::uniform_real_distribution<float> share(0, 1);
    for (std::size_t i = 0; i < count; ++i) {
        primitive.positions.emplace_back(2 * share(random) - 1, 2 * share(random) - 1,
                                         -2 - 2 * share(random));
        splats->scales.emplace_back(0.1F * share(random), 0.1F * share(random),
                                    0.1F * share(random));
        splats->rotations.emplace_back(0, 0, 0, 1);
        splats->opacities.push_back(share(random));
        splats->harmonics.emplace_back(share(random), share(random), share(random));
    }
    primitive.splats = splats;
}

Scene panesAmongSplats(bool opaque) {
    SceneBuilder builder;
    addSplats(builder, 200);
    const auto mode = opaque ? AlphaMode::kOpaque : AlphaMode::kBlend;
    builder.rectangle(0.6F, 0.6F, -3, builder.material({0.2F, 0.7F, 0.3F, 0.5F}, mode));
    return builder.scene();
}

void expectAlike(const CompositeImage& a, const CompositeImage& b, double tolerance) {
    ASSERT_EQ(a.rgba.size(), b.rgba.size());
    for (std::size_t p = 0; p < a.rgba.size(); ++p)
        for (std::size_t c = 0; c < 4; ++c)
            ASSERT_NEAR(a.rgba[p][c], b.rgba[p][c], tolerance);
}

LayeredImage splatsAlone(const Scene& scene, const View& view, const CaptureSettings& settings) {
    SplatLayers layers{PosedScene(scene, 0)};
    layers.begin(view, settings);
    LayeredImage image;
    layers.capture(view.crop, image);
    image.extra.clear();
    return image;
}

TEST(SplatsAmongSurfaces, AreMergedByDepth) {
    const View view = testView(64, 48);
    const Scene scene = panesAmongSplats(false);
    Scene without = scene;
    without.meshes.front().primitives.clear();
    const LayeredImage elements[] = {capture(without, view).image, splatsAlone(scene, view, {})};
    LayeredImage wanted;
    mergeByDepth(elements, view.crop, elements[0], wanted);
    const Captured both = capture(scene, view);
    EXPECT_GT(both.plan.layers.size(), 5U);
    EXPECT_EQ(difference(both.image, wanted), "");
}

TEST(SplatsAmongSurfaces, AreHiddenByOpaqueOnes) {
    const View view = testView(64, 48);
    const Scene scene = panesAmongSplats(true);
    const LayeredImage all = capture(scene, view).image;
    CaptureSettings settings;
    settings.surfaces = Surfaces::kVisible;
    const LayeredImage visible = capture(scene, view, settings).image;
    settings.surfaces = Surfaces::kTransparent;
    const LayeredImage transparent = capture(scene, view, settings).image;
    ASSERT_LT(visible.fragments(), all.fragments());
    for (std::size_t p = 0; p < all.window.pixels(); ++p) {
        std::uint32_t wall = 0;  // number of fragments up to the wall
        while (wall < all.count(p) && color(all, all.offsets[p] + wall).a != 1)
            ++wall;
        const bool hidden = wall < all.count(p);
        EXPECT_EQ(visible.count(p), hidden ? wall + 1 : all.count(p));
        EXPECT_EQ(transparent.count(p), hidden ? wall : all.count(p));
    }
    settings = {};
    settings.composite = true;
    settings.color_type = PixelType::kFloat;
    const CompositeImage composite = flat(capture(scene, view, settings).image);
    settings.composite = false;
    const CompositeImage layers = flat(capture(scene, view, settings).image);
    expectAlike(composite, layers, 1e-6);
}

TEST(SplatsAmongSurfaces, AreTheSameForEveryMethodAndBand) {
    const View view = testView(64, 48);
    const Scene scene = panesAmongSplats(false);
    GlRenderer renderer(sharedContext(), PosedScene(scene, 0));
    for (const SplatOrder order : {SplatOrder::kCenter, SplatOrder::kRay}) {
        CaptureSettings settings;
        settings.splat_order = order;
        settings.channels = {Channel::kId, Channel::kPosition, Channel::kNormal};
        const Captured whole = capture(renderer, view, settings);
        for (const MethodInfo& method : peelMethods()) {
            settings.method = method.name;
            settings.band_bytes = 1U << 18;
            if (!method.exact()) continue;
            const Captured other = capture(renderer, view, settings);
            EXPECT_GT(other.bands.size(), 1U);
            EXPECT_EQ(difference(whole.image, other.image), "") << method.name;
        }
    }
}

TEST(SplatsAlone, NeedNoContext) {
    const View view = testView(64, 48);
    SceneBuilder builder;
    addSplats(builder, 200);
    const PosedScene posed(builder.scene(), 0);
    GlRenderer with_context(sharedContext(), posed);
    GlSession session;
    GlRenderer& without = session.renderer({}, nullptr, 0, posed);
    EXPECT_FALSE(session.hasContext());
    for (const bool composite : {false, true}) {
        for (const int samples : {1, 2}) {
            CaptureSettings settings;
            settings.composite = composite;
            settings.samples = samples;
            if (!composite) settings.channels = {Channel::kId, Channel::kPosition};
            EXPECT_EQ(difference(capture(with_context, view, settings).image,
                                 capture(without, view, settings).image),
                      "");
        }
    }
    CaptureSettings hits;
    hits.hit_mode = HitMode::kRefined;
    EXPECT_EQ(capture(without, view, hits).image.fragments(), 0U);

    const Scene among = panesAmongSplats(true);
    EXPECT_FALSE(without.canShow(PosedScene(among, 0)));
    EXPECT_TRUE(with_context.canShow(PosedScene(among, 0)));
}

TEST(SplatsAmongSurfaces, CastNoShadows) {
    SceneBuilder builder;
    addSplats(builder, 200);
    builder.rectangle(4, 4, -5, builder.lit(builder.material({1, 1, 1, 1}, AlphaMode::kOpaque)));
    Light sun;
    sun.type = LightType::kDirectional;
    builder.light(sun, glm::dmat4(1));
    const View view = testView(48, 36);
    CaptureSettings settings;
    const LayeredImage without = capture(builder.scene(), view, settings).image;
    settings.shadows = true;
    EXPECT_EQ(difference(capture(builder.scene(), view, settings).image, without), "");
}

TEST(SplatsAmongSurfaces, SamplesOfASplatMergeWithItsOwn) {
    const View view = testView(32, 24);
    const Scene scene = panesAmongSplats(false);
    CaptureSettings settings;
    settings.samples = 4;
    settings.color_type = PixelType::kFloat;
    const CompositeImage layers = flat(capture(scene, view, settings).image);
    settings.composite = true;
    const CompositeImage composite = flat(capture(scene, view, settings).image);
    expectAlike(composite, layers, 1e-4);
}

}  // namespace
}  // namespace peeler::test
