// SPDX-License-Identifier: Apache-2.0
// The integrands are those of shaders/lobes.glsl.
#include "core/shading/environment_maps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/parallel.h"

namespace peeler {
namespace {

constexpr double kLeastCosine = 1e-4, kLeastAlpha = 0.002, kLeastSheenAlpha = 0.005;

double vanDerCorput(int i) {
    double sum = 0, digit = 0.5;
    for (int n = i; n > 0; n /= 2, digit /= 2)
        sum += digit * (n % 2);
    return sum;
}

/// Smith's function of how much of the microfacets is hidden.
double smith(double a2, double cosine) {
    return 0.5 * (std::sqrt(1 + a2 * (1 - cosine * cosine) / (cosine * cosine)) - 1);
}

constexpr std::size_t kGgxSamples = 192;

/// Points of a disk, evenly spread.
std::array<glm::dvec2, kGgxSamples> diskSamples() {
    std::array<glm::dvec2, kGgxSamples> points{};
    for (std::size_t i = 0; i < kGgxSamples; ++i) {
        const double r = std::sqrt((static_cast<double>(i) + 0.5) / kGgxSamples),
                     phi = 2 * std::numbers::pi * vanDerCorput(static_cast<int>(i));
        points[i] = {r * std::cos(phi), r * std::sin(phi)};
    }
    return points;
}

/// Samples of the normals that are visible (Heitz, "Sampling the GGX Distribution of Visible
/// Normals", 2018): what remains to average is between 0 and 1. The view lies in the plane y = 0.
glm::vec2 ggxAlbedo(double alpha, double n_dot_v) {
    static const auto points = diskSamples();
    const double a2 = alpha * alpha, hidden = smith(a2, n_dot_v);
    const glm::dvec3 v(std::sqrt(1 - n_dot_v * n_dot_v), 0, n_dot_v);
    const glm::dvec3 stretched = glm::normalize(glm::dvec3(alpha * v.x, 0, v.z));
    const glm::dvec3 across(0, 1, 0), along = glm::cross(stretched, across);
    const double s = 0.5 * (1 + stretched.z);
    double scale = 0, bias = 0;
    for (const glm::dvec2& point : points) {
        const double t1 = point.x, t2 = (1 - s) * std::sqrt(1 - t1 * t1) + s * point.y;
        const glm::dvec3 facet =
            t1 * across + t2 * along + std::sqrt(std::max(0.0, 1 - t1 * t1 - t2 * t2)) * stretched;
        const glm::dvec3 h =
            glm::normalize(glm::dvec3(alpha * facet.x, alpha * facet.y, std::max(1e-9, facet.z)));
        const double v_dot_h = glm::dot(v, h), n_dot_l = 2 * v_dot_h * h.z - v.z;
        if (n_dot_l <= 0 || v_dot_h <= 0) continue;
        const double share = (1 + hidden) / (1 + hidden + smith(a2, n_dot_l));
        const double x = 1 - v_dot_h, fresnel = x * x * x * x * x;
        scale += (1 - fresnel) * share;
        bias += fresnel * share;
    }
    return glm::dvec2(scale, bias) / double(kGgxSamples);
}

double lambdaFit(double x, double alpha) {
    const double t = (1 - alpha) * (1 - alpha);
    const auto mixed = [t](double a, double b) { return a + t * (b - a); };
    return mixed(21.5473, 25.3245) /
               (1 + mixed(3.82987, 3.32435) * std::pow(x, mixed(0.19823, 0.16801))) +
           mixed(-1.97760, -1.27393) * x + mixed(-4.32054, -4.85967);
}

double lambda(double cosine, double alpha) {
    return std::exp(cosine < 0.5 ? lambdaFit(cosine, alpha)
                                 : 2 * lambdaFit(0.5, alpha) - lambdaFit(1 - cosine, alpha));
}

/// Charlie's lobe times the cosine at the surface; `shadowing` is 1 + lambda of both directions.
double charlie(double alpha, double n_dot_v, double n_dot_l, double cos_phi, double shadowing) {
    const double visibility = std::min(1.0, 1 / (shadowing * 4 * n_dot_l * n_dot_v));
    const double sines = std::sqrt((1 - n_dot_l * n_dot_l) * (1 - n_dot_v * n_dot_v));
    const double l_dot_v = sines * cos_phi + n_dot_l * n_dot_v;
    const double n_dot_h = (n_dot_l + n_dot_v) / std::sqrt(2 + 2 * l_dot_v);
    const double h_sine2 = std::max(0.0, 1 - n_dot_h * n_dot_h);
    return n_dot_l * visibility * (2 + 1 / alpha) / (2 * std::numbers::pi) *
           std::pow(h_sine2, 0.5 / alpha);
}

/// x: albedo; y: the part of the lobe's mean direction that lies along the surface, toward the
/// viewer. Over the middles of equal solid angles.
glm::vec2 sheenAlbedo(double alpha, double n_dot_v) {
    constexpr int kCosines = 32, kAngles = 32;
    const double v_lambda = lambda(n_dot_v, alpha);
    double sum = 0, along = 0;
    for (int i = 0; i < kCosines; ++i) {
        const double n_dot_l = (i + 0.5) / kCosines, l_sine = std::sqrt(1 - n_dot_l * n_dot_l);
        const double shadowing = 1 + v_lambda + lambda(n_dot_l, alpha);
        for (int j = 0; j < kAngles; ++j) {
            const double cos_phi = std::cos(std::numbers::pi * (j + 0.5) / kAngles);
            const double share = charlie(alpha, n_dot_v, n_dot_l, cos_phi, shadowing);
            sum += share;
            along += share * l_sine * cos_phi;
        }
    }
    return {std::min(1.0, sum * 2 * std::numbers::pi / (kCosines * kAngles)),
            sum > 0 ? along / sum : 0};
}

std::vector<glm::vec4> integrate(bool sheen) {
    constexpr std::size_t kSide = kAlbedoTableSize;
    std::vector<glm::vec4> table(kSide * kSide);
    parallelFor(kSide, [&](std::size_t row) {
        const double roughness = static_cast<double>(row) / (kSide - 1);
        for (std::size_t column = 0; column < kSide; ++column) {
            const double cosine = std::max(kLeastCosine, static_cast<double>(column) / (kSide - 1));
            const glm::vec2 ggx = ggxAlbedo(std::max(roughness * roughness, kLeastAlpha), cosine);
            const glm::vec2 fibres =
                sheen ? sheenAlbedo(std::max(roughness * roughness, kLeastSheenAlpha), cosine)
                      : glm::vec2(0);
            table[row * kSide + column] = glm::vec4(ggx, fibres);
        }
    });
    return table;
}

}  // namespace

double sheenLobe(double roughness, double n_dot_v, double n_dot_l, double azimuth) {
    const double alpha = std::max(roughness * roughness, kLeastSheenAlpha);
    return charlie(alpha, n_dot_v, n_dot_l, std::cos(azimuth),
                   1 + lambda(n_dot_v, alpha) + lambda(n_dot_l, alpha));
}

const std::vector<glm::vec4>& albedoTable(bool sheen) {
    // It depends on nothing, and takes a tenth of a second.
    if (sheen) {
        static const auto with_sheen = integrate(true);
        return with_sheen;
    }
    static const auto plain = integrate(false);
    return plain;
}

}  // namespace peeler
