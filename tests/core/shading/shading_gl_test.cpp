// SPDX-License-Identifier: Apache-2.0
// Tests the results of the surface shaders.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "core/capture/method.h"
#include "support/capture.h"

namespace peeler::test {
namespace {

/// Returns a 2x2 quad at z = -2 that faces the camera, with UVs and, optionally, normals and
/// tangents. If `mapped`, a normal map tilts the normals toward +X; otherwise the vertex normals
/// are tilted.
Scene leaningQuad(bool mapped, bool normals, bool tangents) {
    SceneBuilder builder;
    Scene& scene = builder.scene();
    const int lit = builder.material({0.8F, 0.6F, 0.4F, 1}, AlphaMode::kOpaque);
    builder.rectangle(1, 1, -2, lit);
    Material& material = scene.materials[static_cast<std::size_t>(lit)];
    material.unlit = false;
    material.metallic = 0;
    material.roughness = 0.5F;
    const glm::vec3 texel = glm::vec3(218, 150, 200) / 255.0F * 2.0F - 1.0F;
    Primitive& p = scene.meshes[0].primitives[0];
    for (const glm::vec3& position : p.positions) {
        p.texcoords[0].push_back({position.x / 2 + 0.5F, 0.5F - position.y / 2});
        if (normals) p.normals.push_back(mapped ? glm::vec3(0, 0, 1) : glm::normalize(texel));
        if (tangents) p.tangents.push_back({1, 0, 0, 1});
    }
    if (mapped) {
        scene.images.push_back({"leaning", 1, 1, {218, 150, 200, 255}});
        material.normal_texture.image = 0;
    }
    return scene;
}

TEST(Shading, NormalMapsTurnWithTheSurface) {
    // A normal map must look like the geometry that it represents, also on rotated, mirrored and
    // scaled surfaces.
    const auto scaled = [](double x, double y, double z, double back) {
        glm::dmat4 m(1);
        m[0][0] = x, m[1][1] = y, m[2][2] = z, m[3][2] = back;
        return m;
    };
    const std::pair<const char*, glm::dmat4> placements[] = {
        {"as it is", scaled(1, 1, 1, 0)},
        {"large", scaled(50, 50, 50, 48)},
        {"small", scaled(0.01, 0.01, 0.01, -0.18)},
        {"mirrored", scaled(-1, 1, 1, 0)},
        {"turned around", scaled(-1, 1, -1, -4)},
        {"turned around and mirrored", scaled(1, 1, -1, -4)}};
    for (const auto& [name, placement] : placements) {
        const auto seen = [&, &m = placement](bool mapped, bool normals, bool tangents) {
            Scene scene = leaningQuad(mapped, normals, tangents);
            scene.nodes[0].local = m;
            const auto result = capture(scene, testView(9, 9));
            const std::size_t center = result.image.pixelIndex(4, 4);
            EXPECT_EQ(result.image.count(center), 1U) << name;
            return color(result.image, result.image.offsets[center]);
        };
        const glm::vec4 expected = seen(false, true, false);
        for (const auto& [normals, tangents] :
             {std::pair{true, true}, {true, false}, {false, false}}) {
            const glm::vec4 mapped = seen(true, normals, tangents);
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(mapped[c], expected[c], 2e-3 * expected[c])
                    << name << ", normals " << normals << ", tangents " << tangents;
        }
    }
}

/// Returns the middle pixel's colour of a quad that faces the camera.
glm::vec4 middle(const Scene& scene) {
    const auto result = capture(scene, testView(9, 9));
    const std::size_t center = result.image.pixelIndex(4, 4);
    EXPECT_EQ(result.image.count(center), 1U);
    return color(result.image, result.image.offsets[center]);
}

void expectAlike(const glm::vec4& seen, const glm::vec4& expected) {
    for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(seen[c], expected[c], 2e-3 * expected[c]);
}

/// Returns the UV transform of KHR_texture_transform for a rotation (in degrees) and a scale.
glm::mat3 turnedAndScaled(double degrees, double u, double v) {
    const double angle = degrees * std::acos(-1.0) / 180;
    const double c = std::cos(angle), s = std::sin(angle);
    return glm::mat3(glm::dmat3(c * u, -s * u, 0, s * v, c * v, 0, 0.25, 0.5, 1));
}

/// The texture that takes the tilted normal map: the surface's, or its clearcoat's.
using MapOf = std::function<TextureRef&(Material&)>;
const std::pair<const char*, MapOf> kNormalMaps[] = {
    {"normal texture", [](Material& m) -> TextureRef& { return m.normal_texture; }},
    {"clearcoat's normal texture", [](Material& m) -> TextureRef& {
         m.base_color = {0, 0, 0, 1};
         m.clearcoat.factor = 1;
         m.clearcoat.roughness = 0.5F;
         return m.clearcoat.normal_texture;
     }}};

TEST(Shading, NormalMapsTurnWithTheirTextures) {
    // Without tangents, transforming a texture must equal transforming its coordinates.
    const glm::mat3 transforms[] = {turnedAndScaled(90, 1, 1), turnedAndScaled(-37, 1, 1),
                                    turnedAndScaled(0, -1, 1), turnedAndScaled(0, 1, -1),
                                    turnedAndScaled(20, 4, 4), turnedAndScaled(65, -0.5, 2)};
    for (const auto& [name, map] : kNormalMaps) {
        Scene plain = leaningQuad(false, true, false);
        plain.images.push_back({"leaning", 1, 1, {218, 150, 200, 255}});
        plain.meshes[0].primitives[0].normals.assign(6, {0, 0, 1});
        map(plain.materials.back()).image = 0;
        const glm::vec4 as_it_is = middle(plain);
        for (const glm::mat3& transform : transforms) {
            SCOPED_TRACE(std::string(name) + ", " + std::to_string(transform[0][0]) + ", " +
                         std::to_string(transform[1][0]));
            Scene turned = plain, in_mesh = plain;
            map(turned.materials.back()).transform = transform;
            for (glm::vec2& uv : in_mesh.meshes[0].primitives[0].texcoords[0])
                uv = glm::vec2(transform * glm::vec3(uv, 1));
            const glm::vec4 expected = middle(in_mesh);
            EXPECT_GT(glm::distance(expected, as_it_is), 0.02F * glm::length(glm::vec3(as_it_is)));
            expectAlike(middle(turned), expected);
            // The mesh's own tangents are used unchanged, for any texture transform.
            turned.meshes[0].primitives[0].tangents.assign(6, {1, 0, 0, 1});
            expectAlike(middle(turned), as_it_is);
        }
    }
}

TEST(Shading, ATurnedNormalMapLeansAsFarTheOtherWay) {
    // U' = cos φ · U + sin φ · V, and U and V are along +X and −Y. So rotating the map by φ rotates
    // its tilt by −φ about the surface's normal.
    const glm::vec3 texel = glm::vec3(218, 150, 200) / 255.0F * 2.0F - 1.0F;
    for (const double degrees : {0.0, 90.0, 180.0, -50.0}) {
        SCOPED_TRACE(degrees);
        const glm::mat3 transform = turnedAndScaled(degrees, 1, 1);
        const float c = transform[0][0], s = transform[1][0];
        Scene bent = leaningQuad(false, true, false), mapped = leaningQuad(true, true, false);
        bent.meshes[0].primitives[0].normals.assign(
            6, glm::normalize(
                   glm::vec3(c * texel.x + s * texel.y, c * texel.y - s * texel.x, texel.z)));
        mapped.materials.back().normal_texture.transform = transform;
        expectAlike(middle(mapped), middle(bent));
    }
}

TEST(Shading, NoColourIsBeyondAHalfOrNegative) {
    SceneBuilder builder;
    builder.rectangle(1, 1, -2, builder.material({1, 1, 1, 1}));
    auto& primitive = builder.scene().meshes[0].primitives[0];
    primitive.colors.assign(primitive.positions.size(), {1e30F, -1e30F, 0.5F, 1});
    for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
        CaptureSettings s;
        s.color_type = type;
        const auto result = capture(builder.scene(), testView(4, 4), s);
        EXPECT_EQ(color(result.image, 0), glm::vec4(65504, 0, 0.5F, 1));
    }
}

}  // namespace
}  // namespace peeler::test
