// SPDX-License-Identifier: Apache-2.0
// Compares punctual lights with the formulas of KHR_lights_punctual.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include <peeler/error.h>
#include <peeler/view.h>
#include "core/scene/lights.h"
#include "support/capture.h"
#include "support/lights.h"

namespace peeler::test {
namespace {

constexpr LightType kDirectional = LightType::kDirectional, kPoint = LightType::kPoint;

/// A rough white wall of half extents (4, 4) at z = −4 that faces the camera at the origin, and
/// lights. The wall reflects 0.96 of its base colour diffusely; the rest is specular.
class Wall {
  public:
    Wall() {
        const int white = builder_.lit(builder_.material({1, 1, 1, 1}, AlphaMode::kOpaque));
        builder_.rectangle(4, 4, -4, white);
    }

    void add(const Light& added, const glm::dvec3& at, const glm::dvec3& forward = {0, 0, -1}) {
        const glm::dvec3 up = std::abs(forward.y) > 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
        glm::dmat4 placement = *lookAlong(at, forward, up);
        // The node's scale must not affect its light.
        for (int axis = 0; axis < 3; ++axis)
            placement[axis] *= 3.0;
        builder_.light(added, placement);
    }

    /// Returns the row-major colours of a 65x65 picture that come from the lights alone: the
    /// difference from a picture with all intensities at 0, which shows only the environment.
    std::vector<glm::dvec3> seen() {
        std::vector<glm::dvec3> bright = colors();
        std::vector<double> intensities;
        for (Light& shining : builder_.scene().lights) {
            intensities.push_back(shining.intensity);
            shining.intensity = 0;
        }
        const std::vector<glm::dvec3> dark = colors();
        for (std::size_t i = 0; i < intensities.size(); ++i)
            builder_.scene().lights[i].intensity = intensities[i];
        for (std::size_t p = 0; p < bright.size(); ++p)
            bright[p] -= dark[p];
        return bright;
    }
    glm::dvec3 atCenter() { return seen()[32 * 65 + 32]; }

    /// Returns the point where the ray of a pixel hits the wall.
    static glm::dvec3 point(int x, int y) {
        return {4 * 0.5 * ((x + 0.5) / 65 * 2 - 1), 4 * 0.5 * (1 - (y + 0.5) / 65 * 2), -4};
    }

  private:
    std::vector<glm::dvec3> colors() const {
        CaptureSettings s;
        s.color_type = PixelType::kFloat;
        const auto result = capture(builder_.scene(), testView(65, 65), s);
        std::vector<glm::dvec3> values;
        for (std::size_t f = 0; f < result.image.fragments(); ++f)
            values.emplace_back(glm::vec3(color(result.image, f)));
        EXPECT_EQ(values.size(), 65U * 65U);
        return values;
    }

    SceneBuilder builder_;
};

/// Returns the wall's BRDF for light from l and the view from v (unit vectors away from the
/// surface, normal +Z): glTF 2.0, appendix B, for white of roughness 1.
double brdf(const glm::dvec3& l, const glm::dvec3& v) {
    const double pi = std::numbers::pi;
    const glm::dvec3 h = glm::normalize(l + v);
    const double fresnel = 0.04 + 0.96 * std::pow(1 - glm::dot(v, h), 5);
    // At roughness 1 the distribution is 1 / pi and the visibility 0.5 / (n·l + n·v).
    return (1 - fresnel) / pi + fresnel / pi * 0.5 / (l.z + v.z);
}

/// Compares every eighth pixel with `irradiance` (at perpendicular incidence) times cosine and
/// BRDF. `toward` returns the direction from a point to the light.
void expectLight(Wall& wall, const std::function<glm::dvec3(const glm::dvec3&)>& toward,
                 const std::function<double(const glm::dvec3&)>& irradiance) {
    const auto seen = wall.seen();
    double brightest = 0;
    for (int y = 0; y < 65; y += 8) {
        for (int x = 0; x < 65; x += 8) {
            const glm::dvec3 at = Wall::point(x, y), l = toward(at);
            const double expected = irradiance(at) * l.z * brdf(l, glm::normalize(-at));
            brightest = std::max(brightest, expected);
            const glm::dvec3 rgb = seen[static_cast<std::size_t>(y * 65 + x)];
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(rgb[c], expected, 2e-5 * expected + 2e-6) << x << ", " << y;
        }
    }
    EXPECT_GT(brightest, 1e-3) << "the test sees nothing";
}

TEST(Lights, OneLuxOnWhiteIsOneOverPi) {
    Wall wall;
    wall.add(lightOf(kDirectional, 1), {5, 6, 7});
    // Rough white reflects 0.96 of the light diffusely, and 0.04 / 4 of the light straight back by
    // specular reflection.
    EXPECT_NEAR(wall.atCenter().g, (0.96 + 0.04 / 4) / std::numbers::pi, 1e-6);
}

TEST(Lights, DirectionalLightHasNoPlace) {
    const glm::dvec3 forward = glm::normalize(glm::dvec3(1, -2, -3));
    for (const glm::dvec3& at : {glm::dvec3(0), glm::dvec3(50, -900, 7)}) {
        Wall wall;
        wall.add(lightOf(kDirectional, 2.5), at, forward);
        expectLight(
            wall, [&](const glm::dvec3&) { return -forward; },
            [](const glm::dvec3&) { return 2.5; });
    }
}

TEST(Lights, ShineOnAMixOfDielectricAndMetal) {
    // glTF 2.0, appendix B.3.5: the reflections of the dielectric and the metal are mixed linearly
    // by `metallic`.
    const glm::dvec3 forward = glm::normalize(glm::dvec3(1, -1, -2));
    const auto lit = [&](float metallic, float roughness) {
        SceneBuilder builder;
        const int index = builder.material({0.9F, 0.6F, 0.3F, 1}, AlphaMode::kOpaque);
        Material& m = builder.scene().materials[static_cast<std::size_t>(builder.lit(index))];
        m.metallic = metallic;
        m.roughness = roughness;
        builder.rectangle(4, 4, -4, index);
        Environment black;
        black.width = black.height = 1;
        black.radiance.assign(1, glm::vec3(0));
        builder.scene().environment = black;
        builder.light(lightOf(kDirectional, 3), *lookAlong({0, 0, 0}, forward, {0, 1, 0}));
        CaptureSettings s;
        s.color_type = PixelType::kFloat;
        return glm::dvec3(color(capture(builder.scene(), testView(9, 9), s).image, 40));
    };
    for (const float roughness : {0.3F, 0.7F, 1.0F}) {
        const glm::dvec3 dielectric = lit(0, roughness), metal = lit(1, roughness);
        EXPECT_GT(glm::distance(dielectric, metal), 0.05);
        for (const float metallic : {0.25F, 0.5F, 0.75F}) {
            const glm::dvec3 expected = glm::mix(dielectric, metal, double(metallic));
            EXPECT_LT(glm::distance(lit(metallic, roughness), expected), 1e-5) << metallic;
        }
    }
}

TEST(Lights, FromBehindDoNotShine) {
    Wall wall;
    wall.add(lightOf(kDirectional, 5), {0, 0, 0}, {0, 0.3, 1});
    wall.add(lightOf(kPoint, 5), {0, 0, -5});
    EXPECT_EQ(wall.atCenter(), glm::dvec3(0));
}

TEST(Lights, PointLightFallsOffWithTheSquareOfTheDistance) {
    for (const glm::dvec3& at :
         {glm::dvec3(0, 0, -3), glm::dvec3(1, -0.5, 4), glm::dvec3(-9, 5, 60)}) {
        Wall wall;
        wall.add(lightOf(kPoint, 30), at);
        expectLight(
            wall, [&](const glm::dvec3& p) { return glm::normalize(at - p); },
            [&](const glm::dvec3& p) { return 30 / glm::dot(at - p, at - p); });
    }
}

TEST(Lights, RangeIsAWindow) {
    const glm::dvec3 at(0.5, 0.25, -3);
    Wall wall;
    Light near = lightOf(kPoint, 10);
    near.range = 1.6;
    wall.add(near, at);
    expectLight(
        wall, [&](const glm::dvec3& p) { return glm::normalize(at - p); },
        [&](const glm::dvec3& p) {
            const double d = glm::length(at - p);
            return 10 * std::clamp(1 - std::pow(d / 1.6, 4), 0.0, 1.0) / (d * d);
        });
    // The corners of the picture are beyond the light's range.
    EXPECT_EQ(wall.seen()[0], glm::dvec3(0));
}

TEST(Lights, SpotLightHasTheConeOfTheFormula) {
    const glm::dvec3 at(-0.5, 0.5, -1), forward = glm::normalize(glm::dvec3(0.2, -0.1, -1));
    const double inner = 0.2, outer = 0.45;
    Wall wall;
    Light spot = lightOf(LightType::kSpot, 20);
    spot.inner_cone = inner;
    spot.outer_cone = outer;
    wall.add(spot, at, forward);
    int full = 0, partial = 0, dark = 0;
    expectLight(
        wall, [&](const glm::dvec3& p) { return glm::normalize(at - p); },
        [&](const glm::dvec3& p) {
            const double cosine = glm::dot(glm::normalize(p - at), forward);
            const double scale = 1 / std::max(0.001, std::cos(inner) - std::cos(outer));
            const double share = std::clamp((cosine - std::cos(outer)) * scale, 0.0, 1.0);
            ++(share == 1 ? full : share > 0 ? partial : dark);
            return 20 * share * share / glm::dot(at - p, at - p);
        });
    EXPECT_GT(full, 2);
    EXPECT_GT(partial, 2);
    EXPECT_GT(dark, 2);
}

TEST(Lights, AddUpEachInItsColour) {
    Wall wall;
    wall.add(lightOf(kDirectional, 2, {1, 0, 0.5}), {0, 0, 0});
    wall.add(lightOf(kPoint, 8, {0, 1, 0.5}), {0, 0, -2});
    const glm::dvec3 rgb = wall.atCenter();
    const double one = (0.96 + 0.04 / 4) / std::numbers::pi;
    EXPECT_NEAR(rgb.r, 2 * one, 1e-5);
    EXPECT_NEAR(rgb.g, 2 * one, 1e-5);  // 8 candela at distance 2
    EXPECT_NEAR(rgb.b, 2 * one, 1e-5);
}

TEST(Lights, ThereMayBeHundreds) {
    Wall wall;
    for (int i = 0; i < 500; ++i)
        wall.add(lightOf(kDirectional, 0.01), {0, 0, 0});
    EXPECT_NEAR(wall.atCenter().g, 5 * (0.96 + 0.04 / 4) / std::numbers::pi, 1e-4);
}

TEST(Lights, OfAnyStrengthLeaveEmissionAlone) {
    // The reflection of a black metal is 0 times the light. The light must not be infinite, because
    // the product would be NaN.
    SceneBuilder builder;
    const int metal = builder.lit(builder.material({0, 0, 0, 1}, AlphaMode::kOpaque));
    Material& material = builder.scene().materials[static_cast<std::size_t>(metal)];
    material.metallic = 1;
    material.emissive = glm::vec3(0.5F);
    builder.rectangle(4, 4, -4, metal);
    builder.light(lightOf(kPoint, 1e38), *lookAlong({0, 0, -3.999}, {0, 0, -1}, {0, 1, 0}));
    builder.light(lightOf(kPoint, 1), *lookAlong({0, 0, -4}, {0, 0, -1}, {0, 1, 0}));
    const auto image = capture(builder.scene(), testView(65, 65)).image;
    EXPECT_NEAR(color(image, 32 * 65 + 32).g, 0.5F, 0.1F);
}

TEST(Lights, ThatHaveNoDirectionAreRefused) {
    Scene scene;
    scene.lights.resize(1);
    scene.nodes.resize(1);
    scene.nodes[0].light = 0;
    scene.nodes[0].local[2] = {0, 0, 0, 0};
    scene.scenes.push_back({"", {0}});
    EXPECT_THROW(placedLights(PosedScene(scene, 0)), Error);
    scene.lights[0].type = LightType::kPoint;
    EXPECT_EQ(placedLights(PosedScene(scene, 0)).size(), 1U);
}

}  // namespace
}  // namespace peeler::test
