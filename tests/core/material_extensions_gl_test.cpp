// SPDX-License-Identifier: Apache-2.0
// What the KHR_materials extensions reflect, against their formulas: one lamp, and a black
// environment.
#include <gtest/gtest.h>

#include <cmath>

#include "core/scene/view.h"
#include "support/capture.h"
#include "support/numbers.h"

namespace peeler::test {
namespace {

/// Radiance at the middle of a wall with this material, which faces the viewer, for light of
/// irradiance 1 at normal incidence from `degrees` toward +X. The U axis is along +X, tangents are
/// given.
class LitWall {
  public:
    explicit LitWall(const Material& material) {
        const int index = builder_.material({1, 1, 1, 1}, AlphaMode::kOpaque);
        scene().materials[static_cast<std::size_t>(index)] = material;
        builder_.rectangle(4, 4, -4, index);
        Primitive& p = scene().meshes[0].primitives[0];
        for (const glm::vec3& at : p.positions) {
            p.normals.emplace_back(0, 0, 1);
            p.tangents.emplace_back(1, 0, 0, 1);
            p.texcoords[0].emplace_back(at.x / 8 + 0.5F, 0.5F - at.y / 8);
        }
        Environment black;
        black.width = black.height = 1;
        black.radiance.assign(1, glm::vec3(0));
        scene().environment = black;
    }

    Scene& scene() { return builder_.scene(); }

    glm::dvec3 radiance(double degrees, double azimuth = 0) {
        const double a = degrees * kPi / 180, b = azimuth * kPi / 180;
        const glm::dvec3 toward(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
        scene().lights.clear();
        while (scene().nodes.size() > 1) {
            scene().nodes.pop_back();
            scene().scenes[0].roots.pop_back();
        }
        builder_.light({}, *lookAlong({0, 0, 0}, -toward, {0, 1, 0.1}));
        return middle();
    }

    /// Without any lamp.
    glm::dvec3 middle() {
        CaptureSettings s;
        s.color_type = PixelType::kFloat;
        const LayeredImage image = capture(scene(), testView(9, 9), s).image;
        EXPECT_EQ(image.fragments(), 81U);
        return color(image, 40);
    }

  private:
    SceneBuilder builder_;
};

Material black(float roughness = 1) {
    Material m;
    m.base_color = {0, 0, 0, 1};
    m.metallic = 0;
    m.roughness = roughness;
    return m;
}

Material whiteMetal(float roughness) {
    Material m = black(roughness);
    m.base_color = {1, 1, 1, 1};
    m.metallic = 1;
    return m;
}

/// Distribution times visibility of GGX for the view along the normal.
double ggx(double alpha, double degrees) {
    const double a2 = alpha * alpha, l = std::cos(degrees * kPi / 180);
    const double h2 = (1 + l) / 2, d = h2 * (a2 - 1) + 1;
    return a2 / (kPi * d * d) * 0.5 / (l + std::sqrt(l * l * (1 - a2) + a2));
}

/// Schlick's Fresnel term there.
double fresnel(double f0, double f90, double degrees) {
    const double v_dot_h = std::cos(degrees * kPi / 360);
    return f0 + (f90 - f0) * std::pow(1 - v_dot_h, 5);
}

double lobe(double f0, double f90, double roughness, double degrees) {
    return fresnel(f0, f90, degrees) * ggx(roughness * roughness, degrees) *
           std::cos(degrees * kPi / 180);
}

TEST(Ior, GivesTheReflectanceAtNormalIncidence) {
    for (const float ior : {1.0F, 1.33F, 1.5F, 2.42F}) {
        Material m = black();
        m.ior = ior;
        const double f0 = std::pow((double(ior) - 1) / (double(ior) + 1), 2);
        for (const double degrees : {0.0, 60.0})
            EXPECT_NEAR(LitWall(m).radiance(degrees).g, lobe(f0, 1, 1, degrees), 1e-6) << ior;
    }
    Material mirror = black();
    mirror.ior = 0;  // infinite
    EXPECT_NEAR(LitWall(mirror).radiance(0).g, lobe(1, 1, 1, 0), 1e-6);
}

TEST(Specular, ScalesAndTintsReflections) {
    Material m = black(0.6F);
    m.specular.factor = 0.5F;
    m.specular.color = {0.5F, 1, 40};
    const glm::dvec3 seen = LitWall(m).radiance(50);
    EXPECT_NEAR(seen.r, lobe(0.5 * 0.02, 0.5, 0.6, 50), 1e-6);
    EXPECT_NEAR(seen.g, lobe(0.5 * 0.04, 0.5, 0.6, 50), 1e-6);
    EXPECT_NEAR(seen.b, lobe(0.5 * 1, 0.5, 0.6, 50), 1e-6);  // no more than all of it
    m.specular.factor = 0;
    m.base_color = {1, 1, 1, 1};
    EXPECT_NEAR(LitWall(m).radiance(50).g, std::cos(50 * kPi / 180) / kPi, 1e-6);  // Lambert
}

TEST(Specular, LeavesDiffuseLightItsColour) {
    Material m = black(1);
    m.base_color = {1, 1, 1, 1};
    m.specular.color = {5, 0, 0};
    const glm::dvec3 seen = LitWall(m).radiance(0);
    // The strongest component is what does not get through.
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

TEST(Clearcoat, ReflectsFourPercentAtNormalIncidence) {
    Material m = black();
    m.specular.factor = 0;  // only the varnish reflects
    m.clearcoat.factor = 0.5F;
    for (const float roughness : {0.4F, 1.0F}) {
        m.clearcoat.roughness = roughness;
        EXPECT_NEAR(LitWall(m).radiance(0).g, 0.5 * 0.04 * ggx(double(roughness * roughness), 0),
                    2e-6);
    }
}

TEST(Clearcoat, TakesItsShareOfWhatIsBelow) {
    Material m = black();
    m.emissive = {1, 0.5F, 100};
    m.clearcoat.factor = 1;
    const glm::dvec3 seen = LitWall(m).middle();
    EXPECT_NEAR(seen.r, 0.96, 1e-5);
    EXPECT_NEAR(seen.g, 0.48, 1e-5);
    EXPECT_NEAR(seen.b, 96, 1e-3);
}

TEST(Clearcoat, HasANormalOfItsOwn) {
    Material m = black(1);
    m.specular.factor = 0;
    m.clearcoat.factor = 1;
    m.clearcoat.roughness = 0.3F;
    LitWall wall(m);
    // Leans by 30 degrees toward +X: mirrors a lamp at 60 degrees straight at the viewer.
    const glm::vec3 n(0.5F, 0, std::sqrt(0.75F));
    const auto byte = [](float v) {
        return static_cast<std::uint8_t>(std::lround((v * 0.5F + 0.5F) * 255));
    };
    wall.scene().images.push_back({"leaning", 1, 1, {byte(n.x), 128, byte(n.z), 255}});
    wall.scene().materials.back().clearcoat.normal_texture.image = 0;
    EXPECT_GT(wall.radiance(60).g, 20 * wall.radiance(0).g);
    EXPECT_GT(wall.radiance(60).g, 20 * wall.radiance(-60).g);
    // The surface's own map has no say.
    wall.scene().materials.back().clearcoat.normal_texture.image = -1;
    wall.scene().materials.back().normal_texture.image = 0;
    EXPECT_GT(wall.radiance(0).g, 20 * wall.radiance(60).g);
}

TEST(EmissiveStrength, GoesBeyondOne) {
    Material m = black();
    m.emissive = {250, 0.5F, 60000};
    const glm::dvec3 seen = LitWall(m).middle();
    EXPECT_NEAR(seen.r, 250, 1e-3);
    EXPECT_NEAR(seen.g, 0.5, 1e-6);
    EXPECT_NEAR(seen.b, 60000, 0.1);
}

/// Estevez & Kulla's lobe for the view along the normal.
double charlie(double roughness, double degrees) {
    const double alpha = roughness * roughness, l = std::cos(degrees * kPi / 180);
    const double sine = std::sin(degrees * kPi / 360);
    const double t = (1 - alpha) * (1 - alpha);
    const auto fit = [t](double x) {
        const auto p = [t](double smooth, double rough) { return rough + (smooth - rough) * t; };
        return p(25.3245, 21.5473) / (1 + p(3.32435, 3.82987) * std::pow(x, p(0.16801, 0.19823))) +
               p(-1.27393, -1.97760) * x + p(-4.85967, -4.32054);
    };
    const auto lambda = [&](double c) {
        return std::exp(c < 0.5 ? fit(c) : 2 * fit(0.5) - fit(1 - c));
    };
    return (2 + 1 / alpha) * std::pow(sine, 1 / alpha) / (2 * kPi) /
           ((1 + lambda(1) + lambda(l)) * 4 * l);
}

TEST(Sheen, IsTheLobeOfFibres) {
    for (const double roughness : {0.4, 0.7, 1.0}) {
        Material m = black();
        m.specular.factor = 0;
        m.sheen.color = {1, 0.5F, 0};
        m.sheen.roughness = static_cast<float>(roughness);
        for (const double degrees : {20.0, 60.0, 80.0}) {
            const double expected = charlie(roughness, degrees) * std::cos(degrees * kPi / 180);
            const glm::dvec3 seen = LitWall(m).radiance(degrees);
            EXPECT_NEAR(seen.r, expected, 1e-5 + 1e-3 * expected) << roughness << ", " << degrees;
            EXPECT_NEAR(seen.g, expected / 2, 1e-5 + 1e-3 * expected);
            EXPECT_NEAR(seen.b, 0, 1e-7);
        }
    }
}

TEST(Sheen, DarkensWhatIsBelow) {
    Material m = black();
    m.base_color = {1, 1, 1, 1};
    m.specular.factor = 0;
    const double plain = LitWall(m).radiance(70).b;
    m.sheen.color = {1, 0, 0};
    m.sheen.roughness = 0.8F;
    const double below = LitWall(m).radiance(70).b;
    EXPECT_LT(below, 0.95 * plain);
    EXPECT_GT(below, 0.3 * plain);
}

/// GGX with a roughness along X and another along Y (KHR_materials_anisotropy), the view along the
/// normal.
double stretchedGgx(double at, double ab, double degrees, double azimuth) {
    const double a = degrees * kPi / 180, b = azimuth * kPi / 180;
    const glm::dvec3 l(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
    const glm::dvec3 h = glm::normalize(l + glm::dvec3(0, 0, 1));
    const double e = h.x * h.x / (at * at) + h.y * h.y / (ab * ab) + h.z * h.z;
    const double d = 1 / (kPi * at * ab * e * e);
    // Smith's height-correlated term with the roughness along each direction.
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
    // Turned by a quarter.
    wall.scene().materials.back().anisotropy.rotation = static_cast<float>(kPi / 2);
    EXPECT_NEAR(wall.radiance(25, 90).g, stretchedGgx(at, ab, 25, 0), 1e-4);
}

TEST(Anisotropy, FollowsItsTextureWithOrWithoutTangents) {
    Material m = whiteMetal(0.5F);
    m.anisotropy.strength = 1;
    LitWall wall(m);
    // Along the bitangent, which is up; strength 0.6.
    wall.scene().images.push_back({"up", 1, 1, {128, 255, 153, 255}});
    wall.scene().materials.back().anisotropy.texture.image = 0;
    const double ab = 0.25, at = ab + (1 - ab) * 0.36;
    EXPECT_NEAR(wall.radiance(40, 90).g, stretchedGgx(at, ab, 40, 0), 2e-3);
    EXPECT_NEAR(wall.radiance(40, 0).g, stretchedGgx(at, ab, 40, 90), 2e-3);
    // The rotation comes on top, from the tangent toward the bitangent: 90 − 60 degrees.
    wall.scene().materials.back().anisotropy.rotation = static_cast<float>(-kPi / 3);
    EXPECT_NEAR(wall.radiance(40, 30).g, stretchedGgx(at, ab, 40, 0), 2e-3);
    wall.scene().materials.back().anisotropy.rotation = 0;
    wall.scene().meshes[0].primitives[0].tangents.clear();
    EXPECT_NEAR(wall.radiance(40, 90).g, stretchedGgx(at, ab, 40, 0), 2e-3);
    // Strength 0 in the texture: the same lobe as without the extension.
    wall.scene().images[0].rgba[2] = 0;
    const double none = wall.radiance(40, 90).g;
    wall.scene().materials.back().anisotropy = {};
    EXPECT_NEAR(none, wall.radiance(40, 90).g, 1e-6);
    // No direction to stretch along: likewise.
    wall.scene().materials.back().anisotropy.strength = 1;
    wall.scene().meshes[0].primitives[0].texcoords[0].clear();
    EXPECT_NEAR(none, wall.radiance(40, 90).g, 1e-6);
}

TEST(Anisotropy, TurnsWithTheTransformOfItsTexture) {
    Material m = whiteMetal(0.5F);
    m.anisotropy.strength = 0.6F;
    const double ab = 0.25, at = ab + (1 - ab) * 0.36;
    // U' = cos U + sin V, and V runs down: U' grows at −35 degrees.
    const double c = std::cos(35 * kPi / 180), s = std::sin(35 * kPi / 180);
    const glm::mat3 turn(glm::dmat3(c, -s, 0, s, c, 0, 0, 0, 1));
    LitWall wall(m);
    Material& material = wall.scene().materials.back();
    Primitive& mesh = wall.scene().meshes[0].primitives[0];
    wall.scene().images.push_back({"along U", 1, 1, {255, 128, 255, 255}});
    wall.scene().images.push_back({"flat", 1, 1, {128, 128, 255, 255}});
    material.anisotropy.texture.image = 0;
    material.anisotropy.texture.transform = turn;
    // The mesh's tangents are taken as they are.
    EXPECT_NEAR(wall.radiance(40, 0).g, stretchedGgx(at, ab, 40, 0), 2e-3);
    mesh.tangents.clear();
    for (const double azimuth : {-35.0, 0.0, 55.0})
        EXPECT_NEAR(wall.radiance(40, azimuth).g, stretchedGgx(at, ab, 40, azimuth + 35), 2e-3)
            << azimuth;
    // Beside a normal texture it is that one's coordinates that count. 128 is not quite flat.
    material.normal_texture.image = 1;
    EXPECT_NEAR(wall.radiance(40, 0).g, stretchedGgx(at, ab, 40, 0), 5e-3);
    material.normal_texture.transform = turn;
    EXPECT_NEAR(wall.radiance(40, -35).g, stretchedGgx(at, ab, 40, 0), 5e-3);
}

/// Reflectance at normal incidence of a film of this index and thickness (nm) between air and a
/// dielectric, for one wavelength (nm): Airy's sum of all reflections.
double airy(double film, double base, double thickness, double wavelength) {
    const double r1 = (1 - film) / (1 + film), r2 = (film - base) / (film + base);
    const double phase = 4 * kPi * film * thickness / wavelength;
    return (r1 * r1 + r2 * r2 + 2 * r1 * r2 * std::cos(phase)) /
           (1 + r1 * r1 * r2 * r2 + 2 * r1 * r2 * std::cos(phase));
}

TEST(Iridescence, IsTheInterferenceOfAThinFilm) {
    // The eye's green is near 540 nm, red near 610 and blue near 450, each a band: the sum over the
    // band is what a film of moderate thickness shows.
    const auto band = [](double film, double base, double thickness, double middle) {
        double sum = 0, weights = 0;
        for (double w = middle - 60; w <= middle + 60; w += 2) {
            const double weight = std::exp(-0.5 * std::pow((w - middle) / 25, 2));
            sum += weight * airy(film, base, thickness, w);
            weights += weight;
        }
        return sum / weights;
    };
    for (const double thickness : {150.0, 250.0, 350.0}) {
        Material m = black();
        m.ior = 2.2F;
        m.iridescence.factor = 1;
        m.iridescence.ior = 1.4F;
        m.iridescence.thickness_max = static_cast<float>(thickness);
        const glm::dvec3 seen = LitWall(m).radiance(0) * (4 * kPi);
        EXPECT_NEAR(seen.g, band(1.4, 2.2, thickness, 545), 0.035) << thickness;
        EXPECT_NEAR(seen.b, band(1.4, 2.2, thickness, 450), 0.05) << thickness;
        EXPECT_NEAR(seen.r, band(1.4, 2.2, thickness, 605), 0.05) << thickness;
    }
}

TEST(Iridescence, IsMixedByItsFactorAndTextures) {
    Material m = black();
    const glm::dvec3 none = LitWall(m).radiance(0);
    m.iridescence.factor = 1;
    m.iridescence.thickness_max = 500;
    m.iridescence.thickness_min = 100;
    const glm::dvec3 all = LitWall(m).radiance(0);
    m.iridescence.factor = 0.25F;
    EXPECT_LT(glm::distance(LitWall(m).radiance(0), glm::mix(none, all, 0.25)), 1e-5);
    // Green 0 is the least thickness; red 0.2 of the factor.
    LitWall textured(m);
    textured.scene().images.push_back({"thin", 1, 1, {51, 0, 0, 255}});
    Iridescence& film = textured.scene().materials.back().iridescence;
    film.factor = 1;
    film.texture.image = film.thickness_texture.image = 0;
    m.iridescence.factor = 0.2F;
    m.iridescence.thickness_max = 100;
    EXPECT_LT(glm::distance(textured.radiance(0), LitWall(m).radiance(0)), 1e-5);
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
    // sRGB 188 is 0.5 of linear light; alpha is linear.
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
    // Every texture there is, shadows, an environment, and the method that reads the most textures.
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
    wall.radiance(10);  // adds the lamp
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
    // Every texture holds one colour; the factors that multiply with it give the same picture.
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
