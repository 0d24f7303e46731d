// SPDX-License-Identifier: Apache-2.0
// Tests the KHR_materials extensions that change the surface itself. The scene has one lamp and a
// black environment. Tests each extension against its formulas, and all extensions together.
#include <gtest/gtest.h>

#include <cmath>

#include "support/capture.h"
#include "support/lit_wall.h"
#include "support/numbers.h"

#include "core/scene/material.h"

namespace peeler::test {
namespace {

TEST(Ior, GivesTheReflectanceAtNormalIncidence) {
    for (const float ior : {1.0F, 1.33F, 1.5F, 2.42F}) {
        Material m = black();
        m.ior = ior;
        const double f0 = std::pow((double(ior) - 1) / (double(ior) + 1), 2);
        for (const double degrees : {0.0, 60.0})
            EXPECT_NEAR(LitWall(m).radiance(degrees).g, lobe(f0, 1, 1, degrees), 1e-6) << ior;
    }
    Material mirror = black();
    mirror.ior = 0;  // an index of refraction of 0 means infinity
    EXPECT_NEAR(LitWall(mirror).radiance(0).g, lobe(1, 1, 1, 0), 1e-6);
}

TEST(Specular, ScalesAndTintsReflections) {
    Material m = black(0.6F);
    m.specular.factor = 0.5F;
    m.specular.color = {0.5F, 1, 40};
    const glm::dvec3 seen = LitWall(m).radiance(50);
    EXPECT_NEAR(seen.r, lobe(0.5 * 0.02, 0.5, 0.6, 50), 1e-6);
    EXPECT_NEAR(seen.g, lobe(0.5 * 0.04, 0.5, 0.6, 50), 1e-6);
    // The colour 40 · 0.04 is capped at 1, full reflection.
    EXPECT_NEAR(seen.b, lobe(0.5 * 1, 0.5, 0.6, 50), 1e-6);
    m.specular.factor = 0;
    m.base_color = {1, 1, 1, 1};
    EXPECT_NEAR(LitWall(m).radiance(50).g, std::cos(50 * kPi / 180) / kPi, 1e-6);  // Lambert's law
}

TEST(Specular, LeavesDiffuseLightItsColour) {
    Material m = black(1);
    m.base_color = {1, 1, 1, 1};
    m.specular.color = {5, 0, 0};
    const glm::dvec3 seen = LitWall(m).radiance(0);
    // The diffuse share is 1 minus the strongest specular component, red.
    EXPECT_NEAR(seen.g, (1 - 0.2) / kPi, 1e-6);
    EXPECT_NEAR(seen.b, seen.g, 1e-7);
}

TEST(Specular, OfMetalsChangesNothing) {
    Material m = black(0.5F);
    m.metallic = 1;
    m.base_color = {0.9F, 0.6F, 0.3F, 1};
    const glm::dvec3 plain = LitWall(m).radiance(30);
    m.specular.factor = 0;
    m.ior = 1.2F;
    EXPECT_LT(glm::distance(LitWall(m).radiance(30), plain), 1e-6);
}

TEST(EmissiveStrength, GoesBeyondOne) {
    Material m = black();
    m.emissive = {250, 0.5F, 60000};
    const glm::dvec3 seen = LitWall(m).middle();
    EXPECT_NEAR(seen.r, 250, 1e-3);
    EXPECT_NEAR(seen.g, 0.5, 1e-6);
    EXPECT_NEAR(seen.b, 60000, 0.1);
}

/// Returns the GGX BRDF times the cosine, with different roughnesses along X and Y
/// (KHR_materials_anisotropy), viewed along the normal.
double stretchedGgx(double at, double ab, double degrees, double azimuth) {
    const double a = degrees * kPi / 180, b = azimuth * kPi / 180;
    const glm::dvec3 l(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
    const glm::dvec3 h = glm::normalize(l + glm::dvec3(0, 0, 1));
    const double e = h.x * h.x / (at * at) + h.y * h.y / (ab * ab) + h.z * h.z;
    const double d = 1 / (kPi * at * ab * e * e);
    // Smith's height-correlated term, with the roughness along each direction.
    const double lambda_l =
        0.5 * (std::sqrt(1 + (at * at * l.x * l.x + ab * ab * l.y * l.y) / (l.z * l.z)) - 1);
    return d / (1 + lambda_l) / (4 * l.z) * l.z;
}

TEST(Anisotropy, StretchesHighlightsAlongTheTangent) {
    Material m = whiteMetal(0.5F);
    m.anisotropy.strength = 0.6F;
    const double ab = 0.25, at = ab + (1 - ab) * 0.36;
    LitWall wall(m);
    for (const double azimuth : {0.0, 35.0, 90.0})
        for (const double degrees : {0.0, 25.0, 60.0})
            EXPECT_NEAR(wall.radiance(degrees, azimuth).g, stretchedGgx(at, ab, degrees, azimuth),
                        1e-4)
                << degrees << ", " << azimuth;
    // Rotates the anisotropy by a quarter turn.
    wall.scene().materials.back().anisotropy.rotation = static_cast<float>(kPi / 2);
    EXPECT_NEAR(wall.radiance(25, 90).g, stretchedGgx(at, ab, 25, 0), 1e-4);
}

TEST(Anisotropy, FollowsItsTextureWithOrWithoutTangents) {
    Material m = whiteMetal(0.5F);
    m.anisotropy.strength = 1;
    LitWall wall(m);
    // The texture's direction is the bitangent (up), and its strength is 0.6.
    wall.scene().images.push_back({"up", 1, 1, {128, 255, 153, 255}});
    wall.scene().materials.back().anisotropy.texture.image = 0;
    const double ab = 0.25, at = ab + (1 - ab) * 0.36;
    EXPECT_NEAR(wall.radiance(40, 90).g, stretchedGgx(at, ab, 40, 0), 2e-3);
    EXPECT_NEAR(wall.radiance(40, 0).g, stretchedGgx(at, ab, 40, 90), 2e-3);
    // The factor's rotation is added to the texture's, from the tangent toward the bitangent: 90 −
    // 60 degrees.
    wall.scene().materials.back().anisotropy.rotation = static_cast<float>(-kPi / 3);
    EXPECT_NEAR(wall.radiance(40, 30).g, stretchedGgx(at, ab, 40, 0), 2e-3);
    wall.scene().materials.back().anisotropy.rotation = 0;
    wall.scene().meshes[0].primitives[0].tangents.clear();
    EXPECT_NEAR(wall.radiance(40, 90).g, stretchedGgx(at, ab, 40, 0), 2e-3);
    // Strength 0 in the texture gives the isotropic lobe.
    wall.scene().images[0].rgba[2] = 0;
    const double none = wall.radiance(40, 90).g;
    wall.scene().materials.back().anisotropy = {};
    EXPECT_NEAR(none, wall.radiance(40, 90).g, 1e-6);
    // Without texture coordinates the direction is undefined, so the lobe is isotropic, too.
    wall.scene().materials.back().anisotropy.strength = 1;
    wall.scene().meshes[0].primitives[0].texcoords[0].clear();
    EXPECT_NEAR(none, wall.radiance(40, 90).g, 1e-6);
}

TEST(Anisotropy, TurnsWithTheTransformOfItsTexture) {
    Material m = whiteMetal(0.5F);
    m.anisotropy.strength = 0.6F;
    const double ab = 0.25, at = ab + (1 - ab) * 0.36;
    // U' = cos 35° · U + sin 35° · V, and V runs down the image, so U' grows in the direction of
    // −35 degrees.
    const double c = std::cos(35 * kPi / 180), s = std::sin(35 * kPi / 180);
    const glm::mat3 turn(glm::dmat3(c, -s, 0, s, c, 0, 0, 0, 1));
    LitWall wall(m);
    Material& material = wall.scene().materials.back();
    Primitive& mesh = wall.scene().meshes[0].primitives[0];
    wall.scene().images.push_back({"along U", 1, 1, {255, 128, 255, 255}});
    wall.scene().images.push_back({"flat", 1, 1, {128, 128, 255, 255}});
    material.anisotropy.texture.image = 0;
    material.anisotropy.texture.transform = turn;
    // The mesh's own tangents are used unchanged, for any texture transform.
    EXPECT_NEAR(wall.radiance(40, 0).g, stretchedGgx(at, ab, 40, 0), 2e-3);
    mesh.tangents.clear();
    for (const double azimuth : {-35.0, 0.0, 55.0})
        EXPECT_NEAR(wall.radiance(40, azimuth).g, stretchedGgx(at, ab, 40, azimuth + 35), 2e-3)
            << azimuth;
    // The coordinates of a normal texture define the tangents. Its texel 128 is not exactly flat;
    // hence the tolerance.
    material.normal_texture.image = 1;
    EXPECT_NEAR(wall.radiance(40, 0).g, stretchedGgx(at, ab, 40, 0), 5e-3);
    material.normal_texture.transform = turn;
    EXPECT_NEAR(wall.radiance(40, -35).g, stretchedGgx(at, ab, 40, 0), 5e-3);
}

TEST(SpecularGlossiness, EqualsTheMetallicRoughnessThatItStandsFor) {
    Material paint = black(0.3F);
    paint.base_color = {0.2F, 0.5F, 0.8F, 1};
    Material same = black();
    same.base_color = paint.base_color / 0.96F;
    same.specular_glossiness.emplace();
    same.specular_glossiness->specular = glm::vec3(0.04F);
    same.specular_glossiness->glossiness = 0.7F;
    Material metal = paint;
    metal.metallic = 1;
    Material same_metal = same;
    same_metal.base_color = {0, 0, 0, 1};
    same_metal.specular_glossiness->specular = glm::vec3(paint.base_color);
    for (const double degrees : {0.0, 40.0, 75.0}) {
        EXPECT_LT(glm::distance(LitWall(paint).radiance(degrees), LitWall(same).radiance(degrees)),
                  1e-5);
        EXPECT_LT(
            glm::distance(LitWall(metal).radiance(degrees), LitWall(same_metal).radiance(degrees)),
            1e-5);
    }
}

TEST(SpecularGlossiness, HasOneTextureForBoth) {
    Material m = black();
    m.specular_glossiness.emplace();
    LitWall wall(m);
    // The sRGB value 188 is 0.5 in linear light; alpha is linear.
    wall.scene().images.push_back({"both", 1, 1, {188, 255, 0, 102}});
    wall.scene().materials.back().specular_glossiness->texture.image = 0;
    const glm::dvec3 seen = wall.radiance(30);
    EXPECT_NEAR(seen.r, lobe(0.5029, 1, 0.6, 30), 1e-3);
    EXPECT_NEAR(seen.g, lobe(1, 1, 0.6, 30), 1e-4);
    EXPECT_NEAR(seen.b, lobe(0, 1, 0.6, 30), 1e-6);
}

TEST(MaterialExtensions, AtTheirDefaultsAreThePlainMaterialBitForBit) {
    Material m = black(0.4F);
    m.base_color = {0.7F, 0.5F, 0.3F, 1};
    LitWall plain(m);
    m.clearcoat.roughness = 0.7F;
    m.sheen.roughness = 0.7F;
    m.anisotropy.rotation = 1;
    m.iridescence.ior = 2;
    m.transmission.thickness = 3;
    LitWall dressed(m);
    EXPECT_EQ(plain.radiance(35), dressed.radiance(35));
}

TEST(MaterialExtensions, FitTheDeviceAllAtOnce) {
    // The scene uses all textures at once, shadows, an environment, and the method that reads the
    // most textures.
    Material m = black(0.5F);
    m.base_color = {1, 1, 1, 1};
    m.clearcoat.factor = 1;
    m.sheen.color = {1, 1, 1};
    m.anisotropy.strength = 1;
    m.iridescence.factor = 1;
    m.transmission.factor = 0.5F;
    m.transmission.thickness = m.transmission.attenuation_distance = 1;
    LitWall wall(m);
    wall.scene().images.push_back({"grey", 1, 1, {128, 128, 200, 255}});
    for (const MaterialTexture& texture : texturesOf(wall.scene().materials.back()))
        texture.ref->image = 0;
    wall.radiance(10);  // adds the lamp to the scene
    CaptureSettings s;
    s.shadows = true;
    s.shadow_size = 64;
    s.surfaces = Surfaces::kVisible;
    const LayeredImage expected = capture(wall.scene(), testView(9, 9), s).image;
    EXPECT_GT(color(expected, 40).g, 0.001F);
    EXPECT_LT(color(expected, 40).a, 1);
    s.method = "front-to-back";
    EXPECT_EQ(difference(capture(wall.scene(), testView(9, 9), s).image, expected), "");
}

TEST(MaterialExtensions, AreScaledByTheirTextures) {
    // Every texture has a single colour, so factors multiplied by that colour must give the same
    // picture without textures.
    const auto picture = [](bool textured) {
        Material m = black(0.5F);
        m.base_color = {0.3F, 0.3F, 0.3F, 1};
        const float r = textured ? 1 : 51 / 255.0F, g = textured ? 1 : 102 / 255.0F;
        const float a = textured ? 1 : 204 / 255.0F;
        m.specular.factor = a;
        m.clearcoat.factor = r;
        m.clearcoat.roughness = g;
        m.sheen.color = {1, 1, 1};
        m.sheen.roughness = a;
        LitWall wall(m);
        wall.scene().images.push_back({"factors", 1, 1, {51, 102, 153, 204}});
        Material& made = wall.scene().materials.back();
        if (textured) {
            for (TextureRef* ref :
                 {&made.specular.texture, &made.clearcoat.texture,
                  &made.clearcoat.roughness_texture, &made.sheen.roughness_texture})
                ref->image = 0;
        }
        return wall.radiance(40);
    };
    EXPECT_LT(glm::distance(picture(true), picture(false)), 1e-5);
}

}  // namespace
}  // namespace peeler::test
