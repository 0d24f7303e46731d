// SPDX-License-Identifier: Apache-2.0
// Compares reflections of environment light with integrals of the lobes, computed here direction by
// direction.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "support/capture.h"
#include "support/lights.h"
#include "support/numbers.h"

namespace peeler::test {
namespace {

using Light3 = std::function<double(const glm::dvec3&)>;

/// Returns the radiance of an environment that is brighter along +Y. A lobe with a wrong direction
/// or width gathers too little or too much of this light.
double slope(const glm::dvec3& direction) {
    return 1 + direction.y;
}

double upperHalf(const glm::dvec3& direction) {
    return direction.y > 0 ? 1 : 0;
}

Environment pictureOf(const Light3& light) {
    Environment picture;
    picture.width = 256;
    picture.height = 128;
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            const double longitude = (0.5 - (x + 0.5) / picture.width) * 2 * kPi;
            const double latitude = (0.5 - (y + 0.5) / picture.height) * kPi;
            picture.radiance.emplace_back(static_cast<float>(
                light({std::sin(longitude) * std::cos(latitude), std::sin(latitude),
                       std::cos(longitude) * std::cos(latitude)})));
        }
    }
    return picture;
}

/// Returns unit normals at an angle of `degrees` to the viewer's direction (+Z): leaning upward,
/// obliquely up and down, and downward.
std::vector<glm::dvec3> leaningBy(double degrees) {
    std::vector<glm::dvec3> normals;
    const double a = degrees * kPi / 180;
    for (const double azimuth : {90.0, 20.0, -60.0, -90.0}) {
        const double b = azimuth * kPi / 180;
        normals.emplace_back(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
    }
    return normals;
}

/// Returns the radiance of facets of this material, one per normal, in an orthographic view along
/// -Z.
std::vector<double> seen(const Material& material, const Light3& light,
                         const std::vector<glm::dvec3>& normals) {
    SceneBuilder builder;
    const int index = builder.material({1, 1, 1, 1}, AlphaMode::kOpaque);
    builder.scene().materials[static_cast<std::size_t>(index)] = material;
    const auto count = static_cast<float>(normals.size());
    for (std::size_t i = 0; i < normals.size(); ++i) {
        const float left = 2 * static_cast<float>(i) - count;
        builder.quad({left, -1, -4}, {left + 2, -1, -4}, {left + 2, 1, -4}, {left, 1, -4}, index);
        Primitive& p = builder.scene().meshes.back().primitives[0];
        p.normals.assign(p.positions.size(), glm::vec3(normals[i]));
    }
    builder.scene().environment = pictureOf(light);
    View view = testView(static_cast<int>(normals.size()), 1);
    view.projection.perspective = false;
    view.projection.far = 100;
    view.projection.half_width = static_cast<double>(count);
    view.projection.half_height = 1;
    CaptureSettings s;
    s.color_type = PixelType::kFloat;
    const LayeredImage image = capture(builder.scene(), view, s).image;
    EXPECT_EQ(image.fragments(), normals.size());
    std::vector<double> found;
    for (std::uint32_t i = 0; i < image.fragments(); ++i)
        found.push_back(static_cast<double>(color(image, i).g));
    return found;
}

/// Integrates `lobe` times light over the hemisphere above the normal. `lobe` is BRDF times cosine,
/// for a direction in the tangent frame, whose X points to the viewer's side.
double integral(const glm::dvec3& n, const std::function<double(const glm::dvec3&)>& lobe,
                const Light3& light) {
    constexpr int kSteps = 240;
    const glm::dvec3 toward = glm::normalize(glm::dvec3(0, 0, 1) - n * n.z);
    const glm::dvec3 aside = glm::cross(n, toward);
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double angle = (i + 0.5) / kSteps * kPi / 2;
        for (int j = 0; j < kSteps; ++j) {
            const double azimuth = (j + 0.5) / kSteps * 2 * kPi;
            const glm::dvec3 l(std::sin(angle) * std::cos(azimuth),
                               std::sin(angle) * std::sin(azimuth), std::cos(angle));
            sum += std::sin(angle) * lobe(l) * light(l.x * toward + l.y * aside + l.z * n);
        }
    }
    return sum * (kPi / 2 / kSteps) * (2 * kPi / kSteps);
}

glm::dvec3 halfVector(const glm::dvec3& l, double n_dot_v) {
    return glm::normalize(l + glm::dvec3(std::sqrt(1 - n_dot_v * n_dot_v), 0, n_dot_v));
}

/// Returns the GGX lobe with height-correlated Smith shadowing and Schlick's Fresnel term from f0
/// to 1.
double ggx(double f0, double alpha, double n_dot_v, const glm::dvec3& l) {
    const double a2 = alpha * alpha;
    const glm::dvec3 h = halfVector(l, n_dot_v);
    const double d = h.z * h.z * (a2 - 1) + 1;
    const auto lambda = [a2](double c) {
        return 0.5 * (std::sqrt(1 + a2 * (1 - c * c) / (c * c)) - 1);
    };
    const double fresnel = f0 + (1 - f0) * std::pow(1 - glm::dot(h, l), 5);
    return fresnel * a2 / (kPi * d * d) / (1 + lambda(l.z) + lambda(n_dot_v)) / (4 * n_dot_v);
}

/// Returns the light reflected by single scattering plus multiple scattering between microfacets
/// (Fdez-Agüera 2019).
double reflectedByGgx(double f0, double alpha, const glm::dvec3& n, const Light3& light) {
    const auto lobe = [&](const glm::dvec3& l) { return ggx(f0, alpha, n.z, l); };
    const auto white = [](const glm::dvec3&) { return 1.0; };
    const double albedo = integral(n, lobe, white);
    const double missing =
        1 - integral(
                n, [&](const glm::dvec3& l) { return ggx(1, alpha, n.z, l); }, white);
    const double around = integral(
        n, [](const glm::dvec3& l) { return l.z / kPi; }, light);
    const double mean = f0 + (1 - f0) / 21;
    return integral(n, lobe, light) + albedo * mean * missing / (1 - mean * missing) * around;
}

// If light is linear in the direction, a lobe's result depends only on the lobe's mean direction
// and on the mean cosine of the angle to the mean direction. These are the two parameters of the
// lookup.
TEST(EnvironmentLobes, OfRoughMetalsLookWhereTheyReflect) {
    Material m;
    m.metallic = 1;
    for (const double roughness : {0.3, 0.5, 0.7, 1.0}) {
        m.roughness = static_cast<float>(roughness);
        for (const double degrees : {20.0, 50.0, 75.0}) {
            const auto normals = leaningBy(degrees);
            const auto found = seen(m, slope, normals);
            for (std::size_t i = 0; i < normals.size(); ++i)
                EXPECT_NEAR(found[i], reflectedByGgx(1, roughness * roughness, normals[i], slope),
                            0.04)
                    << roughness << ", " << degrees << ", " << i;
        }
    }
}

TEST(EnvironmentLobes, OfDielectricsLookWhereFresnelsTermSendsThem) {
    Material m;
    m.metallic = 0;
    m.base_color = {0, 0, 0, 1};
    for (const double roughness : {0.3, 0.5, 0.7, 1.0}) {
        m.roughness = static_cast<float>(roughness);
        for (const double degrees : {20.0, 50.0, 75.0}) {
            const auto normals = leaningBy(degrees);
            const auto found = seen(m, slope, normals);
            for (std::size_t i = 0; i < normals.size(); ++i) {
                const double expected =
                    reflectedByGgx(0.04, roughness * roughness, normals[i], slope);
                EXPECT_NEAR(found[i], expected, 0.002 + 0.03 * expected)
                    << roughness << ", " << degrees << ", " << i;
            }
        }
    }
}

/// Returns the sheen BRDF of Estevez & Kulla, "Production Friendly Microfacet Sheen BRDF", 2017,
/// times the cosine.
double fibres(double alpha, double n_dot_v, const glm::dvec3& l) {
    const glm::dvec3 h = halfVector(l, n_dot_v);
    const double t = (1 - alpha) * (1 - alpha);
    const auto fit = [t](double x) {
        const auto mixed = [t](double a, double b) { return a + t * (b - a); };
        return mixed(21.5473, 25.3245) /
                   (1 + mixed(3.82987, 3.32435) * std::pow(x, mixed(0.19823, 0.16801))) +
               mixed(-1.97760, -1.27393) * x + mixed(-4.32054, -4.85967);
    };
    const auto lambda = [&](double c) {
        return std::exp(c < 0.5 ? fit(c) : 2 * fit(0.5) - fit(1 - c));
    };
    const double visibility = 1 / ((1 + lambda(n_dot_v) + lambda(l.z)) * 4 * l.z * n_dot_v);
    return (2 + 1 / alpha) * std::pow(std::max(0.0, 1 - h.z * h.z), 0.5 / alpha) / (2 * kPi) *
           std::min(visibility, 1.0) * l.z;
}

TEST(EnvironmentLobes, OfFibresLookWhereTheyShineBack) {
    Material m;
    m.base_color = {0, 0, 0, 1};
    m.metallic = 0;
    m.specular.factor = 0;
    m.sheen.color = {1, 1, 1};
    for (const auto& light : {slope, upperHalf}) {
        for (const double roughness : {0.2, 0.4, 0.7, 1.0}) {
            m.sheen.roughness = static_cast<float>(roughness);
            for (const double degrees : {20.0, 50.0, 75.0}) {
                const auto normals = leaningBy(degrees);
                const auto found = seen(m, light, normals);
                for (std::size_t i = 0; i < normals.size(); ++i) {
                    const double n_dot_v = normals[i].z;
                    const auto lobe = [&](const glm::dvec3& l) {
                        return fibres(roughness * roughness, n_dot_v, l);
                    };
                    const double albedo =
                        integral(normals[i], lobe, [](const glm::dvec3&) { return 1.0; });
                    const double expected = integral(normals[i], lobe, light);
                    EXPECT_NEAR(found[i], expected, 0.002 + 0.09 * albedo)
                        << roughness << ", " << degrees << ", " << i;
                }
            }
        }
    }
}

}  // namespace
}  // namespace peeler::test
