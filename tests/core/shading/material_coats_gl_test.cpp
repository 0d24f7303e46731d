// SPDX-License-Identifier: Apache-2.0
// Compares coatings with the formulas for their reflection and attenuation: clearcoat
// (KHR_materials_clearcoat), fibres (sheen) and thin films (iridescence).
#include <gtest/gtest.h>

#include <cmath>

#include "support/lit_wall.h"
#include "support/numbers.h"

namespace peeler::test {
namespace {

TEST(Clearcoat, ReflectsFourPercentAtNormalIncidence) {
    Material m = black();
    m.specular.factor = 0;  // only the clearcoat reflects
    m.clearcoat.factor = 0.5F;
    for (const float roughness : {0.4F, 1.0F}) {
        m.clearcoat.roughness = roughness;
        EXPECT_NEAR(LitWall(m).radiance(0).g,
                    0.5 * 0.04 * ggxAlongNormal(double(roughness * roughness), 0), 2e-6);
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
    // The normal leans by 30 degrees toward +X, so the light of a lamp at 60 degrees is reflected
    // straight at the viewer.
    const glm::vec3 n(0.5F, 0, std::sqrt(0.75F));
    const auto byte = [](float v) {
        return static_cast<std::uint8_t>(std::lround((v * 0.5F + 0.5F) * 255));
    };
    wall.scene().images.push_back({"leaning", 1, 1, {byte(n.x), 128, byte(n.z), 255}});
    wall.scene().materials.back().clearcoat.normal_texture.image = 0;
    EXPECT_GT(wall.radiance(60).g, 20 * wall.radiance(0).g);
    EXPECT_GT(wall.radiance(60).g, 20 * wall.radiance(-60).g);
    // The normal map of the surface does not affect the clearcoat.
    wall.scene().materials.back().clearcoat.normal_texture.image = -1;
    wall.scene().materials.back().normal_texture.image = 0;
    EXPECT_GT(wall.radiance(0).g, 20 * wall.radiance(60).g);
}

/// Returns Estevez & Kulla's sheen lobe, viewed along the normal.
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

/// Returns the reflectance, at normal incidence, of a film of this refractive index and thickness
/// (nm) between air and a dielectric, for one wavelength (nm): Airy's sum of all reflections.
double airy(double film, double base, double thickness, double wavelength) {
    const double r1 = (1 - film) / (1 + film), r2 = (film - base) / (film + base);
    const double phase = 4 * kPi * film * thickness / wavelength;
    return (r1 * r1 + r2 * r2 + 2 * r1 * r2 * std::cos(phase)) /
           (1 + r1 * r1 * r2 * r2 + 2 * r1 * r2 * std::cos(phase));
}

TEST(Iridescence, IsTheInterferenceOfAThinFilm) {
    // Green is near 540 nm, red near 610 nm and blue near 450 nm. Each colour is a band. For films
    // of moderate thickness, the reflectance is the integral over the band.
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
    // A green of 0 gives the minimum thickness; a red of 0.2 scales the factor.
    LitWall textured(m);
    textured.scene().images.push_back({"thin", 1, 1, {51, 0, 0, 255}});
    Iridescence& film = textured.scene().materials.back().iridescence;
    film.factor = 1;
    film.texture.image = film.thickness_texture.image = 0;
    m.iridescence.factor = 0.2F;
    m.iridescence.thickness_max = 100;
    EXPECT_LT(glm::distance(textured.radiance(0), LitWall(m).radiance(0)), 1e-5);
}

}  // namespace
}  // namespace peeler::test
