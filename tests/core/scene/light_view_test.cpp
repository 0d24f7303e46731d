// SPDX-License-Identifier: Apache-2.0
// Tests the views from which shadow maps are rendered.
#include "core/scene/lights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include <peeler/view.h>

namespace peeler::test {
namespace {

/// Returns a cloud of pseudorandom points around `middle`, in a plane parallel to XY.
Scene cloud(const glm::dvec3& middle) {
    std::mt19937 random(1992);
    std::uniform_real_distribution<double> unit(-1, 1);
    Scene scene;
    Primitive& points = scene.meshes.emplace_back().primitives.emplace_back();
    for (int i = 0; i < 500; ++i)
        points.positions.emplace_back(middle + glm::dvec3(unit(random), 2 * unit(random), 0));
    scene.nodes.emplace_back().mesh = 0;
    scene.scenes.push_back({"", {0}});
    return scene;
}

PlacedLight placedLight(LightType type, const glm::dvec3& at, const glm::dvec3& forward) {
    PlacedLight light;
    light.name = "lamp";
    light.light.type = type;
    light.to_world = *lookAlong(at, forward, {0, 1, 0});
    return light;
}

TEST(LightView, OfADirectionalLightIsTight) {
    const Scene scene = cloud({100, -50, 20});
    const PosedScene shown(scene, 0);
    const auto view =
        lightView(placedLight(LightType::kDirectional, {-3, 4, 5}, {1, -2, -0.5}), shown);
    ASSERT_TRUE(view);
    EXPECT_EQ(view->camera_name, "light:lamp");
    EXPECT_FALSE(view->projection.perspective);
    const glm::dmat4 clip_from_world =
        view->projection.matrix() * glm::inverse(view->camera_to_world);
    glm::dvec3 low(9), high(-9);
    for (const glm::vec3& p : scene.meshes[0].primitives[0].positions) {
        const glm::dvec3 at(clip_from_world * glm::dvec4(p, 1));
        low = glm::min(low, at);
        high = glm::max(high, at);
    }
    for (int axis = 0; axis < 2; ++axis) {
        EXPECT_NEAR(low[axis], -1 / 1.01, 1e-6);
        EXPECT_NEAR(high[axis], 1 / 1.01, 1e-6);
    }
    EXPECT_GT(low.z, 0.005);  // the far plane is at 0, since Z is reversed
    EXPECT_LT(high.z, 0.995);
    EXPECT_GT(high.z - low.z, 0.97);
}

TEST(LightView, OfASpotLightIsItsCone) {
    const Scene scene = cloud({0, 0, -5});
    const PosedScene shown(scene, 0);
    PlacedLight spot = placedLight(LightType::kSpot, {0, 0, 1}, {0, 0, -1});
    spot.light.outer_cone = 0.5;
    const auto view = lightView(spot, shown);
    ASSERT_TRUE(view);
    EXPECT_TRUE(view->projection.perspective);
    EXPECT_NEAR(view->projection.half_width, 1.01 * std::tan(0.5), 1e-12);
    EXPECT_EQ(view->projection.half_width, view->projection.half_height);
    EXPECT_NEAR(view->projection.near, 6e-5, 1e-9);
    EXPECT_TRUE(std::isinf(view->projection.far));
    EXPECT_EQ(view->camera_to_world, spot.to_world);
    spot.light.outer_cone = std::numbers::pi / 2;  // the tangent of this angle would be infinite
    EXPECT_NEAR(lightView(spot, shown)->projection.half_width,
                1.01 * std::tan(85 * std::numbers::pi / 180), 1e-9);
}

TEST(LightView, OfWhatIsSeenEdgeOnHasAWidth) {
    const Scene scene = cloud({0, 0, -5});  // seen along X, the flat cloud has no width
    const auto view =
        lightView(placedLight(LightType::kDirectional, {0, 0, 0}, {1, 0, 0}), PosedScene(scene));
    ASSERT_TRUE(view);
    EXPECT_GT(view->projection.half_width, 1e-5);
    EXPECT_LT(view->projection.half_width, 1e-3);
}

TEST(LightView, IsNoneWhereThereIsNone) {
    const Scene scene = cloud({0, 0, -5});
    const PosedScene shown(scene, 0);
    EXPECT_FALSE(lightView(placedLight(LightType::kPoint, {0, 0, 0}, {0, 0, -1}), shown));
    Scene empty;
    empty.scenes.push_back({"", {}});
    const auto sun = placedLight(LightType::kDirectional, {0, 0, 0}, {0, 0, -1});
    EXPECT_FALSE(lightView(sun, PosedScene(empty)));
    EXPECT_TRUE(lightView(sun, shown));
}

TEST(LightView, TheBuiltInLightStandsInForNone) {
    const Scene scene = cloud({0, 0, 0});
    const auto lights = placedLights(PosedScene(scene, 0));
    ASSERT_EQ(lights.size(), 1U);
    EXPECT_EQ(lights[0].name, "key");
    // The built-in light comes from above, the left and the front.
    const glm::dvec3 toward(lights[0].to_world[2]);
    EXPECT_NEAR(glm::length(toward), 1, 1e-6);
    EXPECT_LT(toward.x, -0.4);
    EXPECT_GT(toward.y, 0.7);
    EXPECT_GT(toward.z, 0.4);
}

}  // namespace
}  // namespace peeler::test
