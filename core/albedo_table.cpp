// SPDX-License-Identifier: Apache-2.0
// The integrands are those of shaders/lobes.glsl.
#include "core/albedo_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.h"

namespace peeler {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLeastCosine = 1e-4, kLeastAlpha = 0.002, kLeastSheenAlpha = 0.005;

double vanDerCorput(int i) {
    double sum = 0, digit = 0.5;
    for (int n = i; n > 0; n /= 2, digit /= 2)
        sum += digit * (n % 2);
    return sum;
}

/// Samples of the half vector, in proportion to GGX.
glm::vec2 ggxAlbedo(double alpha, double n_dot_v) {
    constexpr int kSamples = 512;
    const double a2 = alpha * alpha, v_sine = std::sqrt(1 - n_dot_v * n_dot_v);
    double scale = 0, bias = 0;
    for (int i = 0; i < kSamples; ++i) {
        const double u = (i + 0.5) / kSamples, phi = 2 * kPi * vanDerCorput(i);
        const double n_dot_h = std::sqrt((1 - u) / (1 + (a2 - 1) * u));
        const double h_sine = std::sqrt(1 - n_dot_h * n_dot_h);
        const double v_dot_h = v_sine * h_sine * std::cos(phi) + n_dot_v * n_dot_h;
        const double n_dot_l = 2 * v_dot_h * n_dot_h - n_dot_v;
        if (n_dot_l <= 0 || v_dot_h <= 0) continue;
        const double visibility = 0.5 / (n_dot_l * std::sqrt(n_dot_v * n_dot_v * (1 - a2) + a2) +
                                         n_dot_v * std::sqrt(n_dot_l * n_dot_l * (1 - a2) + a2));
        const double share = 4 * visibility * n_dot_l * v_dot_h / n_dot_h;
        const double fresnel = std::pow(1 - v_dot_h, 5);
        scale += (1 - fresnel) * share;
        bias += fresnel * share;
    }
    scale /= kSamples;
    bias /= kSamples;
    const double most = std::max(1.0, scale + bias);
    return {scale / most, bias / most};
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

/// The middles of equal solid angles.
double sheenAlbedo(double alpha, double n_dot_v) {
    constexpr int kCosines = 32, kAngles = 32;
    const double v_sine = std::sqrt(1 - n_dot_v * n_dot_v), v_lambda = lambda(n_dot_v, alpha);
    double sum = 0;
    for (int i = 0; i < kCosines; ++i) {
        const double n_dot_l = (i + 0.5) / kCosines, l_sine = std::sqrt(1 - n_dot_l * n_dot_l);
        const double visibility =
            std::min(1.0, 1 / ((1 + v_lambda + lambda(n_dot_l, alpha)) * 4 * n_dot_l * n_dot_v));
        for (int j = 0; j < kAngles; ++j) {
            const double phi = kPi * (j + 0.5) / kAngles;
            const double l_dot_v = l_sine * v_sine * std::cos(phi) + n_dot_l * n_dot_v;
            const double n_dot_h = (n_dot_l + n_dot_v) / std::sqrt(2 + 2 * l_dot_v);
            const double h_sine2 = std::max(0.0, 1 - n_dot_h * n_dot_h);
            sum +=
                n_dot_l * visibility * (2 + 1 / alpha) / (2 * kPi) * std::pow(h_sine2, 0.5 / alpha);
        }
    }
    return std::min(1.0, sum * 2 * kPi / (kCosines * kAngles));
}

}  // namespace

std::vector<glm::vec3> albedoTable(bool sheen) {
    constexpr std::size_t kSide = kAlbedoTableSize;
    std::vector<glm::vec3> table(kSide * kSide);
    parallelFor(kSide, [&](std::size_t row) {
        const double roughness = static_cast<double>(row) / (kSide - 1);
        for (std::size_t column = 0; column < kSide; ++column) {
            const double cosine = std::max(kLeastCosine, static_cast<double>(column) / (kSide - 1));
            const glm::vec2 ggx = ggxAlbedo(std::max(roughness * roughness, kLeastAlpha), cosine);
            const double fibres =
                sheen ? sheenAlbedo(std::max(roughness * roughness, kLeastSheenAlpha), cosine) : 0;
            table[row * kSide + column] = glm::vec3(ggx, fibres);
        }
    });
    return table;
}

}  // namespace peeler
