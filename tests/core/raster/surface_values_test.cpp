// SPDX-License-Identifier: Apache-2.0
// Tests surface values at CPU hits, on surfaces with known normals, coordinates and colours.
#include "core/raster/surface_values.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "core/raster/hit_rasterizer.h"
#include "support/one_mesh.h"
#include "support/traced_hits.h"

namespace peeler::test {
namespace {

/// Returns a square that covers rays 0 to 8 and faces the camera, with U to the right and V down.
Primitive facing() {
    Primitive primitive;
    primitive.positions = {{0, -8, -2}, {8, -8, -2}, {8, 0, -2}, {0, 0, -2}};
    primitive.texcoords[0] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    primitive.indices = {0, 1, 2, 0, 2, 3};
    return primitive;
}

Image texel(std::uint8_t r, std::uint8_t g, std::uint8_t b, std::uint8_t a = 255) {
    Image image;
    image.width = image.height = 1;
    image.rgba = {r, g, b, a};
    return image;
}

std::vector<glm::dvec3> valuesOf(const Scene& scene, Channel channel,
                                 const View& view = parallelView(8, 8)) {
    HitRasterizer source{PosedScene(scene)};
    CaptureSettings settings = hitSettings();
    settings.channels = {channel};
    const TracedHits traced = trace(source, view, settings);
    const FragmentArray& array = traced.image.extra.at(1);
    std::vector<glm::dvec3> values(traced.image.fragments(), glm::dvec3(0));
    for (std::size_t f = 0; f < values.size(); ++f)
        for (std::size_t c = 0; c < array.components(); ++c)
            values[f][static_cast<int>(c)] =
                static_cast<double>(array.as<float>()[f * array.components() + c]);
    EXPECT_FALSE(values.empty());
    return values;
}

void expectAll(const std::vector<glm::dvec3>& values, const glm::dvec3& expected,
               double tolerance = 1e-6) {
    for (const glm::dvec3& value : values)
        for (int i = 0; i < 3; ++i)
            ASSERT_NEAR(value[i], expected[i], tolerance) << i;
}

TEST(SurfaceValues, NormalsAreOnTheSideOfTheRay) {
    expectAll(valuesOf(oneMesh({facing()}), Channel::kNormal), {0, 0, 1});
    // The square is rotated by 60° about Y and seen from its front, then from its back.
    const double angle = std::numbers::pi / 3;
    for (const double turn : {angle, angle + std::numbers::pi}) {
        const glm::dmat4 local = glm::translate(glm::dmat4(1), glm::dvec3(4, 0, -10)) *
                                 glm::rotate(glm::dmat4(1), turn, glm::dvec3(0, 1, 0)) *
                                 glm::translate(glm::dmat4(1), glm::dvec3(-4, 0, 2));
        const glm::dvec3 expected(std::sin(angle), 0, std::cos(angle));
        Primitive primitive = facing();
        expectAll(valuesOf(oneMesh({primitive}, local), Channel::kNormal), expected);
        primitive.normals.assign(4, {0, 0, 1});
        expectAll(valuesOf(oneMesh({primitive}, local), Channel::kNormal), expected);
    }
}

TEST(SurfaceValues, NormalsAreInterpolatedAndTurnWithTheInverseTranspose) {
    Primitive primitive = facing();
    primitive.normals = {{-1, 0, 1}, {1, 0, 1}, {1, 0, 1}, {-1, 0, 1}};
    const auto values = valuesOf(oneMesh({primitive}), Channel::kNormal);
    for (int x = 0; x < 8; ++x) {
        const glm::dvec3 expected = glm::normalize(glm::dvec3(2 * (x + 0.5) / 8 - 1, 0, 1));
        for (int i = 0; i < 3; ++i)
            EXPECT_NEAR(values[static_cast<std::size_t>(x)][i], expected[i], 1e-6);
    }
    // Scaling X by 1/2 doubles the slope. A reflection does not swap front and back.
    primitive.normals.assign(4, glm::normalize(glm::vec3(1, 0, 1)));
    for (const double scale : {0.5, -0.5}) {
        const glm::dmat4 local = glm::translate(glm::dmat4(1), glm::dvec3(4, 0, 0)) *
                                 glm::scale(glm::dmat4(1), glm::dvec3(scale, 1, 1));
        const glm::dvec3 normal = glm::normalize(glm::dvec3(scale > 0 ? 2 : -2, 0, 1));
        expectAll(valuesOf(oneMesh({primitive}, local), Channel::kNormal), normal);
    }
}

/// A normal map's +X points in the direction of increasing U, its +Y up in the image, with and
/// without tangents.
TEST(SurfaceValues, NormalMapsLeanAlongTheTexture) {
    const glm::dvec3 mapped(2 * 204.0 / 255 - 1, 2 * 51.0 / 255 - 1, 2 * 230.0 / 255 - 1);
    for (const bool with_tangents : {false, true}) {
        for (const bool second_set : {false, true}) {
            Primitive primitive = facing();
            primitive.normals.assign(4, {0, 0, 1});
            if (second_set) std::swap(primitive.texcoords[0], primitive.texcoords[1]);
            if (with_tangents) primitive.tangents.assign(4, {1, 0, 0, 1});
            Scene scene = oneMesh({primitive});
            scene.images = {texel(204, 51, 230)};
            Material& material = scene.materials[0];
            material.normal_texture.image = 0;
            material.normal_texture.texcoord = second_set ? 1 : 0;
            expectAll(valuesOf(scene, Channel::kNormal), glm::normalize(mapped));
            material.normal_scale = 0.5F;
            expectAll(valuesOf(scene, Channel::kNormal),
                      glm::normalize(mapped * glm::dvec3(0.5, 0.5, 1)));
            if (with_tangents) continue;
            // The texture is rotated by a quarter turn on the surface.
            material.normal_scale = 1;
            material.normal_texture.transform[0] = {0, 1, 0};
            material.normal_texture.transform[1] = {-1, 0, 0};
            expectAll(valuesOf(scene, Channel::kNormal),
                      glm::normalize(glm::dvec3(-mapped.y, mapped.x, mapped.z)));
        }
    }
}

TEST(SurfaceValues, ColorsAreFactorTimesTextureTimesVertex) {
    Primitive primitive = facing();
    Scene scene = oneMesh({primitive});
    scene.images = {texel(128, 255, 0), texel(10, 64, 192)};
    Material& material = scene.materials[0];
    material.base_color = {0.5F, 0.25F, 1, 1};
    expectAll(valuesOf(scene, Channel::kBaseColor), {0.5, 0.25, 1});
    material.base_color_texture.image = 0;
    const double half = std::pow((128.0 / 255 + 0.055) / 1.055, 2.4);
    expectAll(valuesOf(scene, Channel::kBaseColor), {0.5 * half, 0.25, 0});
    scene.meshes[0].primitives[0].colors.assign(4, {0.5F, 1, 1, 1});
    expectAll(valuesOf(scene, Channel::kBaseColor), {0.25 * half, 0.25, 0});
    material.emissive = {2, 3, 4};
    expectAll(valuesOf(scene, Channel::kEmissive), {2, 3, 4});
    material.emissive_texture.image = 0;
    expectAll(valuesOf(scene, Channel::kEmissive), {2 * half, 3, 0});
    material.roughness = 0.5F;
    material.metallic = 0.25F;
    expectAll(valuesOf(scene, Channel::kRoughnessMetallic), {0.5, 0.25, 0});
    material.metallic_roughness_texture.image = 1;
    expectAll(valuesOf(scene, Channel::kRoughnessMetallic), {0.5 * 64 / 255, 0.25 * 192 / 255, 0});
    material.specular_glossiness.emplace();
    material.specular_glossiness->glossiness = 0.75F;
    expectAll(valuesOf(scene, Channel::kRoughnessMetallic), {0.25, 0, 0});
}

TEST(SurfaceValues, CoordinatesOfTheFirstSet) {
    const auto values = valuesOf(oneMesh({facing()}), Channel::kUv);
    for (std::size_t i = 0; i < values.size(); ++i) {
        EXPECT_NEAR(values[i].x, (static_cast<double>(i % 8) + 0.5) / 8, 1e-6);
        EXPECT_NEAR(values[i].y, (static_cast<double>(i / 8) + 0.5) / 8, 1e-6);
    }
}

TEST(SurfaceValues, TexturesAreWrappedAndFiltered) {
    Image image;
    image.width = 2;
    image.height = 1;
    image.rgba = {0, 0, 0, 0, 255, 255, 255, 255};
    TextureRef texture;
    texture.image = 0;
    struct Row {
        int filter, wrap;
        double u, expected;
    };
    constexpr int kNearest = 9728, kLinear = 9729, kRepeat = 10497, kMirror = 33648, kClamp = 33071;
    for (const Row& row :
         {Row{kNearest, kRepeat, 0.4, 0}, Row{kNearest, kRepeat, 0.6, 1},
          Row{kNearest, kRepeat, 1.4, 0}, Row{kNearest, kRepeat, -0.4, 1},
          Row{kNearest, kMirror, 1.4, 1}, Row{kNearest, kMirror, -0.4, 0},
          Row{kNearest, kMirror, -1.4, 1}, Row{kNearest, kClamp, 7, 1},
          Row{kNearest, kClamp, -7, 0}, Row{kLinear, kClamp, 0.5, 0.5},
          Row{kLinear, kClamp, 0.25, 0}, Row{kLinear, kClamp, 0.375, 0.25},
          Row{kLinear, kRepeat, 0, 0.5}, Row{kLinear, kRepeat, 1, 0.5}, Row{kLinear, kMirror, 0, 0},
          Row{kLinear, kMirror, 1, 1}, Row{kLinear, kRepeat, NAN, 0.5}}) {
        texture.sampler.mag_filter = row.filter;
        texture.sampler.wrap_s = row.wrap;
        EXPECT_NEAR(texelAt(image, texture, {row.u, 0.5}).a, row.expected, 1e-12)
            << row.filter << " " << row.wrap << " " << row.u;
    }
    // Coordinates too large to have a fraction may select any texel, but nothing outside the image.
    for (const double far : {1e30, -1e30, 1e300})
        for (const int wrap : {kRepeat, kMirror, kClamp}) {
            texture.sampler.wrap_s = wrap;
            const double value = texelAt(image, texture, {far, 0.5}).a;
            EXPECT_TRUE(value >= 0 && value <= 1) << far << " " << wrap;
        }
}

}  // namespace
}  // namespace peeler::test
