// SPDX-License-Identifier: Apache-2.0
// Integration of the lobes in shaders/lobes.glsl.
#include "core/shading/albedo_table.h"

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

/// Returns Smith's lambda, which gives the masked fraction of the microfacets.
double smith(double a2, double cosine) {
    return 0.5 * (std::sqrt(1 + a2 * (1 - cosine * cosine) / (cosine * cosine)) - 1);
}

constexpr std::size_t kGgxSamples = 192;

/// Returns evenly distributed points on the unit disk.
std::array<glm::dvec2, kGgxSamples> diskSamples() {
    std::array<glm::dvec2, kGgxSamples> points{};
    for (std::size_t i = 0; i < kGgxSamples; ++i) {
        const double r = std::sqrt((static_cast<double>(i) + 0.5) / kGgxSamples),
                     phi = 2 * std::numbers::pi * vanDerCorput(static_cast<int>(i));
        points[i] = {r * std::cos(phi), r * std::sin(phi)};
    }
    return points;
}

/// A part of a lobe: its weight and the weighted sum of its directions.
struct Part {
    double share = 0;
    glm::dvec3 moment{0};

    void add(double more, const glm::dvec3& direction) {
        share += more;
        moment += more * direction;
    }
};

/// A lobe in two parts: `scale` is multiplied by F0, and `bias` is multiplied by F90.
struct GgxLobe {
    Part scale, bias;
};

/// Integrates a GGX lobe by sampling visible normals (Heitz, "Sampling the GGX Distribution of
/// Visible Normals", 2018), so that the remaining integrand is between 0 and 1. The view is in the
/// plane y = 0.
GgxLobe ggxLobe(double alpha, double n_dot_v) {
    static const auto points = diskSamples();
    const double a2 = alpha * alpha, hidden = smith(a2, n_dot_v);
    const glm::dvec3 v(std::sqrt(1 - n_dot_v * n_dot_v), 0, n_dot_v);
    const glm::dvec3 stretched = glm::normalize(glm::dvec3(alpha * v.x, 0, v.z));
    const glm::dvec3 across(0, 1, 0), along = glm::cross(stretched, across);
    const double s = 0.5 * (1 + stretched.z);
    GgxLobe lobe;
    for (const glm::dvec2& point : points) {
        const double t1 = point.x, t2 = (1 - s) * std::sqrt(1 - t1 * t1) + s * point.y;
        const glm::dvec3 facet =
            t1 * across + t2 * along + std::sqrt(std::max(0.0, 1 - t1 * t1 - t2 * t2)) * stretched;
        const glm::dvec3 h =
            glm::normalize(glm::dvec3(alpha * facet.x, alpha * facet.y, std::max(1e-9, facet.z)));
        const double v_dot_h = glm::dot(v, h);
        const glm::dvec3 l = 2 * v_dot_h * h - v;
        if (l.z <= 0 || v_dot_h <= 0) continue;
        const double share =
            (1 + hidden) / (1 + hidden + smith(a2, l.z)) / static_cast<double>(kGgxSamples);
        const double x = 1 - v_dot_h, fresnel = x * x * x * x * x;
        lobe.scale.add((1 - fresnel) * share, l);
        lobe.bias.add(fresnel * share, l);
    }
    return lobe;
}

/// Returns the mean cosine between the normal and a level's filter lobe: GGX seen head-on, weighted
/// by the cosine. The distribution is a function of x, the squared cosine of the half vector, and
/// the solid angle is proportional to dx. So the integrals have a closed form in u = 1 - (1 -
/// alpha²) x.
double levelCosine(double alpha) {
    const double a2 = std::min(alpha * alpha, 0.998), k = 1 - a2, m = 1 + a2;
    const auto weights = [m](double u) { return -m / u - 2 * std::log(u); };
    const auto cosines = [m](double u) { return 4 * u - m * m / u - 4 * m * std::log(u); };
    return (cosines(1 - k / 2) - cosines(a2)) / (weights(1 - k / 2) - weights(a2)) / k;
}

/// Returns the roughness of the level whose mean cosine is `cosine`.
double levelOfCosine(double cosine) {
    double least = 0, greatest = 1;
    for (int i = 0; i < 20; ++i) {
        const double middle = 0.5 * (least + greatest);
        (levelCosine(middle * middle) > cosine ? least : greatest) = middle;
    }
    return 0.5 * (least + greatest);
}

/// Returns the position of the part's mean direction on the line from the normal (0) to the
/// mirrored view (1).
double turnOf(const Part& part, double n_dot_v) {
    if (!(part.share > 1e-12)) return 1;
    const double slope = -part.moment.x / part.moment.z;
    return slope / (std::sqrt(1 - n_dot_v * n_dot_v) + slope * (1 - n_dot_v));
}

/// Returns the roughness of the level whose filter is as wide as the part, as a multiple of
/// `roughness` (the lobe's).
double widthOf(const Part& part, double roughness) {
    if (!(part.share > 1e-12)) return 1;
    return levelOfCosine(glm::length(part.moment) / part.share) / roughness;
}

struct GgxEntry {
    glm::vec2 albedo;
    glm::vec4 lobe;
};

GgxEntry ggxEntry(double roughness, double n_dot_v) {
    // Below this roughness, widths are computed for a lobe of this roughness: narrower lobes would
    // have too few samples in their tails, and all narrow lobes have the same shape.
    constexpr double kNarrow = 0.2;
    // Above this view cosine, mean directions are computed at this cosine: if the surface is seen
    // head-on, the normal and the mirrored view coincide, and there is no line between them.
    constexpr double kHeadOn = 0.995;
    const auto lobeOf = [](double rough, double cosine) {
        return ggxLobe(std::max(rough * rough, kLeastAlpha), cosine);
    };
    const GgxLobe own = lobeOf(roughness, n_dot_v);
    const double leaning = std::min(n_dot_v, kHeadOn), wide = std::max(roughness, kNarrow);
    const GgxLobe turned = n_dot_v > leaning ? lobeOf(roughness, leaning) : own;
    const GgxLobe widened = roughness < wide ? lobeOf(wide, n_dot_v) : own;
    // The tails of a narrow lobe affect the mean cosine more than the appearance, so the lobe's
    // width is reduced (tests/benchmarks/referee.py).
    const double seen = std::min(1.0, 0.9 + 0.25 * roughness);
    return {{own.scale.share, own.bias.share},
            {turnOf(turned.scale, leaning), seen * widthOf(widened.scale, wide),
             turnOf(turned.bias, leaning), seen * widthOf(widened.bias, wide)}};
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

/// Returns the Charlie lobe (sheen) times `n_dot_l`. `shadowing` is 1 plus the sum of lambda() over
/// both directions.
double charlie(double alpha, double n_dot_v, double n_dot_l, double cos_phi, double shadowing) {
    const double visibility = std::min(1.0, 1 / (shadowing * 4 * n_dot_l * n_dot_v));
    const double sines = std::sqrt((1 - n_dot_l * n_dot_l) * (1 - n_dot_v * n_dot_v));
    const double l_dot_v = sines * cos_phi + n_dot_l * n_dot_v;
    const double n_dot_h = (n_dot_l + n_dot_v) / std::sqrt(2 + 2 * l_dot_v);
    const double h_sine2 = std::max(0.0, 1 - n_dot_h * n_dot_h);
    return n_dot_l * visibility * (2 + 1 / alpha) / (2 * std::numbers::pi) *
           std::pow(h_sine2, 0.5 / alpha);
}

/// Returns the albedo of sheen, a sum over cells of equal solid angle.
double sheenAlbedo(double alpha, double n_dot_v) {
    constexpr int kCosines = 32, kAngles = 32;
    const double v_lambda = lambda(n_dot_v, alpha);
    double sum = 0;
    for (int i = 0; i < kCosines; ++i) {
        const double n_dot_l = (i + 0.5) / kCosines;
        const double shadowing = 1 + v_lambda + lambda(n_dot_l, alpha);
        for (int j = 0; j < kAngles; ++j) {
            const double cos_phi = std::cos(std::numbers::pi * (j + 0.5) / kAngles);
            sum += charlie(alpha, n_dot_v, n_dot_l, cos_phi, shadowing);
        }
    }
    return std::min(1.0, sum * 2 * std::numbers::pi / (kCosines * kAngles));
}

/// Evaluates `integrand` (a function of roughness and view cosine) for every entry.
template <typename Entry, typename Integrand>
std::vector<Entry> tabulated(const Integrand& integrand) {
    constexpr std::size_t kSide = kAlbedoTableSize;
    std::vector<Entry> table(kSide * kSide);
    parallelFor(kSide, [&](std::size_t row) {
        const double roughness = static_cast<double>(row) / (kSide - 1);
        for (std::size_t column = 0; column < kSide; ++column)
            table[row * kSide + column] = integrand(
                roughness, std::max(kLeastCosine, static_cast<double>(column) / (kSide - 1)));
    });
    return table;
}

// Returns the entries that both tables are made from. Computed once.
const std::vector<GgxEntry>& ggxEntries() {
    static const auto entries = tabulated<GgxEntry>(ggxEntry);
    return entries;
}

std::vector<double> sheenAlbedos() {
    return tabulated<double>([](double roughness, double n_dot_v) {
        return sheenAlbedo(std::max(roughness * roughness, kLeastSheenAlpha), n_dot_v);
    });
}

}  // namespace

std::vector<glm::vec4> albedoTable() {
    const std::vector<double> sheen = sheenAlbedos();
    std::vector<glm::vec4> table;
    for (const GgxEntry& entry : ggxEntries())
        table.emplace_back(entry.albedo, sheen[table.size()], 0);
    return table;
}

std::vector<glm::vec4> lobeTable() {
    std::vector<glm::vec4> table;
    for (const GgxEntry& entry : ggxEntries())
        table.push_back(entry.lobe);
    return table;
}

}  // namespace peeler
