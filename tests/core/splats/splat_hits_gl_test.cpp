// SPDX-License-Identifier: Apache-2.0
// Tests the hits of rays with Gaussian splats, with both engines, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/error.h>
#include "core/rays/ray_maps.h"
#include "core/splats/splat_hits.h"
#include "support/capture.h"
#include "support/closed_meshes.h"
#include "support/splats.h"
#include "support/traced_hits.h"

namespace peeler::test {
namespace {

struct HitSplat {
    glm::dvec3 mean{0}, scale{0.1};
    glm::dquat turn{1, 0, 0, 0};
    double opacity = 0.5;
};

/// Adds a node with white splats.
void addHitSplats(SceneBuilder& builder, const std::vector<HitSplat>& list) {
    Primitive& primitive = addPoints(builder);
    const auto splats = std::make_shared<Splats>();
    for (const HitSplat& splat : list) {
        primitive.positions.emplace_back(splat.mean);
        splats->scales.emplace_back(splat.scale);
        splats->rotations.emplace_back(splat.turn.x, splat.turn.y, splat.turn.z, splat.turn.w);
        splats->opacities.push_back(static_cast<float>(splat.opacity));
        splats->harmonics.emplace_back(0.5 / 0.28209479177387814);
    }
    primitive.splats = splats;
}

std::vector<HitSplat> cloudOfHits() {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> share(0, 1);
    std::vector<HitSplat> splats(300);
    for (HitSplat& splat : splats)
        splat = {.mean = {2 * share(random) - 1, 2 * share(random) - 1, -2 - 2 * share(random)},
                 .scale = {0.1 * share(random), 0.1 * share(random), 0.1 * share(random)},
                 .turn = glm::normalize(glm::dquat(share(random), share(random), 0.3, 0.1)),
                 .opacity = share(random)};
    return splats;
}

glm::dmat3 covarianceOf(const HitSplat& splat) {
    glm::dmat3 half = glm::mat3_cast(splat.turn);
    for (int k = 0; k < 3; ++k)
        half[k] *= splat.scale[k];
    return half * glm::transpose(half);
}

/// Returns the opacity and the distance of a splat on a parallel ray along −Z that starts at
/// `start`: the marginal over Z of its Gaussian, and the conditional mean of Z. `widening` adds to
/// the variances of X and Y.
std::pair<double, double> onRayAlongZ(const HitSplat& splat, const glm::dvec3& start,
                                      double widening) {
    const glm::dmat3 c = covarianceOf(splat);
    const glm::dvec2 d = glm::dvec2(start - splat.mean);
    const glm::dvec2 solved = glm::inverse(glm::dmat2(c) + widening * glm::dmat2(1)) * d;
    const double z = splat.mean.z + glm::dot(glm::dvec2(c[2]), solved);
    return {std::min(0.99, splat.opacity * std::exp(-glm::dot(d, solved) / 2)), start.z - z};
}

class SplatHitsBy : public testing::TestWithParam<const char*> {
  protected:
    TracedHits traced(const Scene& scene, const View& view,
                      const CaptureSettings& settings = hitSettings()) const {
        const PosedScene posed(scene, 0);
        const auto surfaces = openHits(GetParam(), posed);
        SplatHits source(*surfaces);
        return trace(source, view, settings);
    }
};
INSTANTIATE_TEST_SUITE_P(By, SplatHitsBy, testing::Values("cpu", "gl"),
                         [](const auto& row) { return std::string(row.param); });

TEST_P(SplatHitsBy, AreMarginalsAtConditionalMeans) {
    const HitSplat round{.mean = {0, 0, -4}, .scale = glm::dvec3(0.25), .opacity = 0.8};
    const HitSplat oblique{.mean = {0.7, -0.4, -3},
                           .scale = {0.4, 0.1, 0.2},
                           .turn = glm::normalize(glm::dquat(0.8, 0.3, -0.5, 0.2)),
                           .opacity = 0.9};
    // A disc nearly along the rays: where only the dilation reaches, its depth is not far off.
    const HitSplat disc{.mean = {0, 0, -3},
                        .scale = {1, 1, 1e-3},
                        .turn = glm::angleAxis(1.56, glm::dvec3(0, 1, 0)),
                        .opacity = 0.9};
    const std::pair<HitSplat, double> rows[] = {{round, 0}, {oblique, 0}, {oblique, 4}, {disc, 4}};
    for (const auto& [splat, dilation] : rows) {
        SceneBuilder builder;
        addHitSplats(builder, {splat});
        const Bounds box{splat.mean - 3.0, splat.mean + 3.0};
        const Bundle bundle = parallelBundle("", box, box, {0, 0, -1}, {200});
        const double spacing = bundle.size().x / bundle.view.width;
        CaptureSettings settings = hitSettings();
        settings.splat_dilation = dilation;
        const TracedHits hits = traced(builder.scene(), bundle.view, settings);
        EXPECT_EQ(hits.plan.fragments_counted, hits.image.fragments());
        std::size_t found = 0;
        for (int y = 0; y < bundle.view.height; ++y) {
            for (int x = 0; x < bundle.view.width; ++x) {
                const std::size_t pixel = hits.image.pixelIndex(x, y);
                const auto [alpha, distance] =
                    onRayAlongZ(splat, worldPosition(bundle.view, x + 0.5, y + 0.5, 0),
                                dilation * spacing * spacing);
                const double least = std::max(1.0 / 255, splat.opacity * std::exp(-4.5));
                if (std::abs(alpha / least - 1) < 0.01) continue;
                ASSERT_EQ(hits.image.count(pixel), alpha > least ? 1U : 0U) << x << ' ' << y;
                if (hits.image.count(pixel) == 0) continue;
                const std::uint32_t hit = hits.image.offsets[pixel];
                EXPECT_NEAR(color(hits.image, hit).a, alpha, 1e-5);
                EXPECT_NEAR(color(hits.image, hit).r, alpha, 1e-5);
                EXPECT_NEAR(static_cast<double>(hits.image.z[hit]), distance, 1e-5);
                ++found;
            }
        }
        EXPECT_GT(found, 500U);
    }
}

TEST_P(SplatHitsBy, ThroughAPinholeAreWhereResponsesAreLargest) {
    const HitSplat splat{.mean = {0.7, -0.4, -3},
                         .scale = {0.3, 0.05, 0.1},
                         .turn = glm::normalize(glm::dquat(0.8, 0.3, -0.5, 0.2)),
                         .opacity = 0.9};
    SceneBuilder builder;
    addHitSplats(builder, {splat});
    const View view = testView(64, 48);
    const TracedHits hits = traced(builder.scene(), view);
    ASSERT_GT(hits.image.fragments(), 100U);
    const glm::dmat3 precision = glm::inverse(covarianceOf(splat));
    for (int y = 0; y < view.height; ++y)
        for (int x = 0; x < view.width; ++x) {
            const std::size_t pixel = hits.image.pixelIndex(x, y);
            if (hits.image.count(pixel) == 0) continue;
            const glm::dvec3 ray = worldPosition(view, x + 0.5, y + 0.5, 1);
            const double z = glm::dot(ray, precision * splat.mean) / glm::dot(ray, precision * ray);
            EXPECT_NEAR(static_cast<double>(hits.image.z[hits.image.offsets[pixel]]), z, 1e-4);
        }
}

TEST_P(SplatHitsBy, OfPointsWithoutSizeAreAtTheirCentres) {
    SceneBuilder builder;
    addHitSplats(builder, {{.mean = {0, 0, -3}, .scale = glm::dvec3(0)}});
    const Bounds box{{-1, -1, -4}, {1, 1, -2}};
    CaptureSettings settings = hitSettings();
    settings.splat_dilation = 1;
    for (const View& view : {testView(8, 8), parallelBundle("", box, box, {0, 0, -1}, {9}).view}) {
        const LayeredImage image = traced(builder.scene(), view, settings).image;
        EXPECT_GT(image.fragments(), 4U);
        const double distance = view.projection.perspective ? 3 : view.camera_to_world[3].z + 3;
        for (const float z : image.z)
            EXPECT_NEAR(static_cast<double>(z), distance, 1e-6);
    }
}

TEST_P(SplatHitsBy, AreAmongSurfacesByDepth) {
    SceneBuilder builder;
    addHitSplats(builder, {{.mean = {0, 0, -5}}, {.mean = {0, 0, -3}}, {.mean = {0, 0, -4}}});
    builder.rectangle(2, 2, -4, builder.material({0, 1, 0, 0.5}));
    View view = testView(1, 1);
    view.projection.half_width = view.projection.half_height = 1e-3;
    CaptureSettings settings = hitSettings();
    settings.channels = {Channel::kNormal, Channel::kGeometricNormal, Channel::kBaseColor,
                         Channel::kFacing, Channel::kId};
    const LayeredImage image = traced(builder.scene(), view, settings).image;
    ASSERT_EQ(image.fragments(), 4U);
    const auto keys = image.extra.front().as<std::uint32_t>();
    EXPECT_EQ(keys[0], 2U);
    EXPECT_TRUE(keys[1] == 4 || keys[1] == 5) << keys[1];  // at equal depths, surfaces first
    EXPECT_EQ(keys[2], 3U);
    EXPECT_EQ(keys[3], 1U);
    for (std::size_t hit = 0; hit < 4; ++hit) {
        const bool splat = hit != 1;
        EXPECT_EQ(color(image, hit).a > 0, splat);
        EXPECT_EQ(findChannel(image, "N.Z").value(hit), splat ? 0 : 1);
        EXPECT_EQ(findChannel(image, "Ng.Z").value(hit), splat ? 0 : 1);
        EXPECT_NEAR(findChannel(image, "baseColor.R").value(hit), splat ? 1 : 0, 1e-6);
        EXPECT_EQ(findChannel(image, "facing").value(hit), 1);
        EXPECT_EQ(findIds(image, "id.object").id(hit), splat ? 1U : 2U);
    }
    EXPECT_EQ(findIds(image, "id.primitive").id(0), 2U);
}

TEST_P(SplatHitsBy, AreTheFragmentsOfAPictureInAllBands) {
    SceneBuilder builder;
    addHitSplats(builder, cloudOfHits());
    builder.rectangle(0.6F, 0.6F, -3, builder.material({0, 1, 0, 0.5}));
    const View view = testView(64, 48);
    const PosedScene posed(builder.scene(), 0);
    const auto surfaces = openHits(GetParam(), posed);
    SplatHits source(*surfaces);
    CaptureSettings settings = hitSettings();
    settings.faces = Faces::kGltf;
    settings.channels = {Channel::kBaseColor};
    const TracedHits whole = trace(source, view, settings);
    CaptureSettings picture;
    picture.splat_order = SplatOrder::kRay;
    picture.color_type = PixelType::kFloat;
    picture.channels = {Channel::kBaseColor};
    const LayeredImage shown = capture(builder.scene(), view, picture).image;
    EXPECT_EQ(whole.image.offsets, shown.offsets);
    for (std::size_t i = 0; i < shown.fragments(); ++i) {
        ASSERT_NEAR(whole.image.z[i], shown.z[i], 1e-5);
        if (color(whole.image, i).a > 0) {
            EXPECT_EQ(color(whole.image, i), color(shown, i));
        }
        for (const char* name : {"baseColor.R", "baseColor.G", "baseColor.B"})
            ASSERT_NEAR(findChannel(whole.image, name).value(i), findChannel(shown, name).value(i),
                        1e-6);
    }
    settings.band_bytes = 1U << 16;
    const TracedHits bands = trace(source, view, settings);
    EXPECT_GT(bands.bands.size(), 2U);
    EXPECT_EQ(bands.report.bands, static_cast<int>(bands.bands.size()));
    EXPECT_EQ(difference(whole.image, bands.image), "");
    CollectSink sink;
    EXPECT_GT(source.forecastMemory(source.plan(view, settings), sink), 1U << 20);
}

TEST_P(SplatHitsBy, AreInNoSolid) {
    Scene scene = sceneOf({{"", {torus(0.4, 32, 16)}}});
    const Bounds box = PosedScene(scene).bounds().value();
    const Bundle bundle = parallelBundle("", box, box, {0.1, 0.2, -1}, {40});
    const auto thickness = [&](const Scene& shown) {
        const PosedScene posed(shown, 0);
        const Solids solids(posed);
        RayMaps maps(posed, &solids, {.maps = {RayMap::kThickness, RayMap::kCount}});
        maps.begin(bundle);
        const TracedHits hits = traced(shown, bundle.view);
        std::vector<float> planes;
        maps.evaluateRows(bundle, hits.image, 0, bundle.view.height, planes);
        return planes;
    };
    const std::vector<float> without = thickness(scene);
    SceneBuilder builder;
    addHitSplats(builder, {{.mean = {0.4, 0, 0}, .scale = glm::dvec3(0.2)}});
    scene.meshes.push_back(builder.scene().meshes.back());
    scene.meshes.back().primitives.front().material = 0;
    Node node;
    node.mesh = 1;
    scene.nodes.push_back(node);
    scene.scenes.front().roots.push_back(static_cast<int>(scene.nodes.size()) - 1);
    const std::vector<float> with = thickness(scene);
    const std::size_t rays = without.size() / 2;
    EXPECT_TRUE(std::equal(with.begin(), with.begin() + static_cast<int>(rays), without.begin()));
    EXPECT_NE(with, without) << "the splat adds to the number of hits";
}

TEST(SplatHits, OfOtherKindsAreRefused) {
    SceneBuilder builder;
    addHitSplats(builder, {{.mean = {0, 0, -3}}});
    const PosedScene posed(builder.scene(), 0);
    const auto surfaces = openHits("cpu", posed);
    SplatHits source(*surfaces);
    EXPECT_THROW(source.plan(testView(4, 4), hitSettings(HitMode::kSloped)), Error);
    CollectSink sink;
    EXPECT_THROW(source.capture(surfaces->plan(testView(4, 4), hitSettings()), sink), Error);
}

}  // namespace
}  // namespace peeler::test
