// SPDX-License-Identifier: Apache-2.0
// Tests transmitted light in layers (shaders/transmission.glsl).
#include <gtest/gtest.h>

#include <cmath>

#include <peeler/composite.h>
#include <peeler/error.h>
#include "core/capture/method.h"
#include "support/capture.h"
#include "support/hard_scenes.h"
#include "support/lights.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// A pane at z = −2 and a red wall behind it at −3. Both fill the view.
class Pane {
  public:
    explicit Pane(const glm::vec4& rgba, float transmission, AlphaMode mode = AlphaMode::kOpaque) {
        index_ = static_cast<std::size_t>(builder_.lit(builder_.material(rgba, mode)));
        material().transmission.factor = transmission;
        builder_.rectangle(4, 4, -2, static_cast<int>(index_));
        builder_.rectangle(4, 4, -3, builder_.material({1, 0, 0, 1}, AlphaMode::kOpaque));
        scene().environment = uniformEnvironment(glm::vec3(0));
        for (const glm::vec3& at : scene().meshes[0].primitives[0].positions)
            scene().meshes[0].primitives[0].texcoords[0].emplace_back(at.x < 0 ? 0 : 1, 0);
    }
    Scene& scene() { return builder_.scene(); }
    Material& material() { return scene().materials[index_]; }

    LayeredImage seen(Surfaces surfaces = Surfaces::kAll, Shading shading = Shading::kPbr) {
        CaptureSettings s;
        s.color_type = PixelType::kFloat;
        s.surfaces = surfaces;
        s.shading = shading;
        return capture(scene(), testView(5, 5), s).image;
    }
    /// Returns the colour of the nearest layer in the middle pixel.
    glm::vec4 front(Shading shading = Shading::kPbr) {
        const LayeredImage image = seen(Surfaces::kAll, shading);
        const std::size_t middle = image.pixelIndex(2, 2);
        EXPECT_EQ(image.count(middle), 2U);
        return color(image, image.offsets[middle]);
    }

  private:
    SceneBuilder builder_;
    std::size_t index_ = 0;
};

TEST(Transmission, IsTakenOffAlpha) {
    EXPECT_NEAR(Pane({1, 1, 1, 1}, 0.7F).front().a, 0.3, 1e-6);
    EXPECT_NEAR(Pane({1, 1, 1, 1}, 1).front().a, 0, 1e-6);
    EXPECT_EQ(Pane({1, 1, 1, 1}, 0).front().a, 1);
    // Coverage (alpha) multiplies the remaining opacity.
    EXPECT_NEAR(Pane({1, 1, 1, 0.5F}, 0.4F, AlphaMode::kBlend).front().a, 0.5 * 0.6, 1e-6);
}

TEST(Transmission, OfColouredGlassIsAsMuchAsItsColourLetsPass) {
    EXPECT_NEAR(Pane({1, 0.5F, 0, 1}, 1).front().a, 0.5, 1e-6);
    EXPECT_NEAR(Pane({0.9F, 0.3F, 0.3F, 1}, 0.8F).front().a, 1 - 0.8 * 0.5, 1e-6);
    // With unlit shading, the opaque part of the glass has the colour of its material.
    const glm::vec4 flat = Pane({1, 0.5F, 0, 1}, 1).front(Shading::kUnlit);
    EXPECT_LT(glm::distance(flat, glm::vec4(0.5F, 0.25F, 0, 0.5F)), 1e-6F);
}

TEST(Transmission, LeavesReflectionsAtFullStrength) {
    // With light from all directions, the pane shows its specular reflection and the diffuse light
    // that is not transmitted.
    Pane clear({1, 1, 1, 1}, 1), half({1, 1, 1, 1}, 0.5F), none({1, 1, 1, 1}, 0);
    for (Pane* pane : {&clear, &half, &none}) {
        pane->material().roughness = 0;
        pane->scene().environment = uniformEnvironment(glm::vec3(1));
    }
    const glm::vec4 reflected = clear.front();
    EXPECT_NEAR(reflected.a, 0, 1e-6);
    EXPECT_NEAR(reflected.g, 0.04, 2e-3);
    EXPECT_NEAR(none.front().g, 1, 1e-3);
    EXPECT_NEAR(half.front().g, 0.5 * (1 + double(reflected.g)), 2e-3);
}

TEST(Transmission, IsNothingThroughMetal) {
    Pane pane({1, 1, 1, 1}, 1);
    pane.material().metallic = 1;
    EXPECT_EQ(pane.front().a, 1);
    pane.material().metallic = 0.25F;
    EXPECT_NEAR(pane.front().a, 0.25, 1e-6);
}

TEST(Transmission, FollowsItsTexture) {
    Pane pane({1, 1, 1, 1}, 0.8F);
    pane.scene().images.push_back({"red is what counts", 1, 1, {128, 7, 9, 255}});
    pane.material().transmission.texture.image = 0;
    EXPECT_NEAR(pane.front().a, 1 - 0.8 * 128 / 255, 1e-5);
    EXPECT_NEAR(pane.front(Shading::kUnlit).a, 1 - 0.8 * 128 / 255, 1e-5);
}

TEST(Transmission, ThroughAVolumeFollowsBeersLaw) {
    Pane pane({1, 1, 1, 1}, 1);
    Transmission& t = pane.material().transmission;
    t.thickness = 0.5F;
    t.attenuation_distance = 2;
    t.attenuation_color = {0.5F, 0.25F, 1};
    const glm::vec3 left(std::pow(0.5F, 0.25F), std::pow(0.25F, 0.25F), 1);
    EXPECT_NEAR(pane.front().a, 1 - (left.r + left.g + left.b) / 3, 1e-5);
    // Thickness is in mesh units, so scaling the mesh by 2 doubles it.
    pane.scene().nodes[0].local = glm::dmat4(2);
    pane.scene().nodes[0].local[3] = {0, 0, 2, 1};
    const glm::vec3 twice = left * left;
    EXPECT_NEAR(pane.front().a, 1 - (twice.r + twice.g + twice.b) / 3, 1e-5);
    // Thickness is multiplied by the green channel of its texture, here 0: nothing is absorbed.
    pane.scene().nodes[0].local = glm::dmat4(1);
    pane.scene().images.push_back({"none", 1, 1, {255, 0, 255, 255}});
    t.thickness_texture.image = 0;
    EXPECT_NEAR(pane.front().a, 0, 1e-6);
}

TEST(Transmission, HidesNothingAndIsNeverLeftOut) {
    for (const float factor : {0.5F, 1.0F}) {
        for (const AlphaMode mode : {AlphaMode::kOpaque, AlphaMode::kMask, AlphaMode::kBlend}) {
            Pane pane({1, 1, 1, 1}, factor, mode);
            EXPECT_EQ(pane.seen(Surfaces::kAll).fragments(), 50U);
            EXPECT_EQ(pane.seen(Surfaces::kVisible).fragments(), 50U);
            EXPECT_EQ(pane.seen(Surfaces::kTransparent).fragments(), 25U);
        }
    }
    EXPECT_EQ(Pane({1, 1, 1, 1}, 0).seen(Surfaces::kVisible).fragments(), 25U);
}

TEST(Transmission, ComesAfterTheAlphaTest) {
    EXPECT_EQ(Pane({1, 1, 1, 0.4F}, 1, AlphaMode::kMask).seen().fragments(), 25U);
    EXPECT_EQ(Pane({1, 1, 1, 0.6F}, 1, AlphaMode::kMask).seen().fragments(), 50U);
    EXPECT_EQ(Pane({1, 1, 1, 0}, 1, AlphaMode::kBlend).seen().fragments(), 25U);
}

TEST(Transmission, CastsNoShadow) {
    const auto brightness = [](float transmission) {
        SceneBuilder builder;
        builder.rectangle(4, 4, -4,
                          builder.lit(builder.material({1, 1, 1, 1}, AlphaMode::kOpaque)));
        const int glass = builder.material({1, 1, 1, 1}, AlphaMode::kOpaque);
        builder.scene().materials.back().transmission.factor = transmission;
        // The glass is between the lamp above and the wall, but outside the view.
        builder.quad({-2, 1.2F, -3.5F}, {2, 1.2F, -3.5F}, {2, 1.2F, -1}, {-2, 1.2F, -1}, glass);
        Light sun;
        sun.intensity = 3;
        glm::dmat4 down(1);  // shines along (0, −1, −1)
        down[1] = glm::dvec4(glm::normalize(glm::dvec3(0, 1, -1)), 0);
        down[2] = glm::dvec4(glm::normalize(glm::dvec3(0, 1, 1)), 0);
        builder.light(sun, down);
        builder.scene().environment = uniformEnvironment(glm::vec3(0));
        CaptureSettings s;
        s.shadows = true;
        s.shadow_size = 256;
        const LayeredImage image = capture(builder.scene(), testView(9, 9), s).image;
        return color(image, image.offsets[image.pixelIndex(4, 4)]).g;
    };
    EXPECT_LT(brightness(0), 0.01F);
    EXPECT_GT(brightness(0.5F), 0.5F);
}

TEST(Transmission, IsTheSameInEveryMethod) {
    Scene scene = glassScene();
    for (std::size_t i = 0; i < scene.materials.size(); i += 16)
        scene.materials[i].base_color = {1, 1, 1, 1};  // makes some panes perfectly clear
    const PosedScene shown(scene, 0);
    GlRenderer renderer(sharedContext(), shown);
    const View view = exhaustive() ? testView(100, 75) : testView(60, 45);
    for (const Surfaces surfaces : {Surfaces::kAll, Surfaces::kVisible}) {
        CaptureSettings s;
        s.surfaces = surfaces;
        const auto reference = capture(renderer, view, s);
        EXPECT_GT(reference.image.fragments(), 1000U);
        CompositeImage expected, found;
        compositeOver(reference.image, {}, expected);
        for (const auto& method : peelMethods()) {
            if (!method.exact()) continue;
            s.method = method.name;
            s.composite = false;
            EXPECT_EQ(difference(reference.image, capture(renderer, view, s).image), "")
                << method.name;
            s.composite = true;
            compositeOver(capture(renderer, view, s).image, {}, found);
            float worst = 0;
            for (std::size_t p = 0; p < expected.rgba.size(); ++p)
                for (std::size_t c = 0; c < 4; ++c)
                    worst = std::max(worst, std::abs(expected.rgba[p][c] - found.rgba[p][c]));
            EXPECT_LE(worst, 4e-6F) << method.name;
        }
    }
}

TEST(Transmission, OfNothingButReflectionsSurvivesAnAverage) {
    Pane pane({1, 1, 1, 1}, 1);
    pane.scene().scenes[0].roots.pop_back();  // removes the wall
    pane.scene().environment = uniformEnvironment(glm::vec3(1));
    CaptureSettings s;
    s.composite = true;
    const auto exact = capture(pane.scene(), testView(5, 5), s).image;
    s.method = "weighted-average";
    const auto average = capture(pane.scene(), testView(5, 5), s).image;
    EXPECT_GT(color(exact, 12).g, 0.01F);
    EXPECT_LT(glm::distance(color(exact, 12), color(average, 12)), 1e-5F);
}

}  // namespace
}  // namespace peeler::test
