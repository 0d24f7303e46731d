// SPDX-License-Identifier: Apache-2.0
// Edge functions and nearest points on edges.
#include "core/bake/texel_coverage.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <peeler/error.h>
#include "core/base/cross.h"

namespace peeler {
namespace {

// Half the diagonal of a texel, rounded up so that rounding errors exclude no triangle.
constexpr double kReach = 0.7072;
constexpr double kMostLookedAt = 536870912;  // 2^29 texels

/// Returns twice the signed area of (a, b, p), positive if p is left of a → b. Always starts from
/// the same end of the edge. So two triangles that traverse a shared edge in opposite directions
/// get exactly opposite values.
double edge(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& p) {
    if (a.x < b.x || (a.x == b.x && a.y < b.y)) return cross(b - a, p - a);
    return -cross(a - b, p - b);
}

/// Whether a triangle owns the texel centres on its edge a → b. The triangle on the other side has
/// the edge as b → a. Exactly one of the two triangles owns the centres.
bool ownsEdge(const glm::dvec2& a, const glm::dvec2& b) {
    return b.y < a.y || (b.y == a.y && b.x > a.x);
}

struct EdgePoint {
    double distance2 = std::numeric_limits<double>::infinity();
    glm::dvec3 weights{1, 0, 0};
};

/// Returns the point of the triangle's edges nearest to `p`.
EdgePoint nearestOnEdges(const UvTriangle& t, const glm::dvec2& p) {
    EdgePoint nearest;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        const glm::dvec2& a = t[static_cast<std::size_t>(i)];
        const glm::dvec2 side = t[static_cast<std::size_t>(j)] - a;
        const double length2 = glm::dot(side, side);
        const double s = length2 > 0 ? std::clamp(glm::dot(p - a, side) / length2, 0.0, 1.0) : 0;
        const glm::dvec2 away = a + s * side - p;
        const double distance2 = glm::dot(away, away);
        if (distance2 >= nearest.distance2) continue;
        nearest.distance2 = distance2;
        nearest.weights = glm::dvec3(0);
        nearest.weights[i] = 1 - s;
        nearest.weights[j] = s;
    }
    return nearest;
}

/// Whether the texel centre p is in the triangle; if so, sets its barycentric weights.
bool covers(const UvTriangle& t, const glm::dvec2& p, glm::dvec3& weights) {
    const double area = edge(t[0], t[1], t[2]);
    if (area == 0) return false;
    const double side = area < 0 ? -1 : 1;
    for (std::size_t i = 0; i < 3; ++i) {
        const glm::dvec2 &a = t[(i + 1) % 3], &b = t[(i + 2) % 3];
        const double e = side * edge(a, b, p);
        if (e < 0 || (e == 0 && !(side > 0 ? ownsEdge(a, b) : ownsEdge(b, a)))) return false;
        weights[static_cast<int>(i)] = e / std::abs(area);
    }
    return true;
}

/// Returns the minimum and maximum x of the triangle between y − kReach and y + kReach.
std::array<double, 2> extentAt(const UvTriangle& t, double y) {
    std::array<double, 2> x{std::numeric_limits<double>::infinity(),
                            -std::numeric_limits<double>::infinity()};
    for (std::size_t i = 0; i < 3; ++i) {
        const glm::dvec2 &a = t[i], &b = t[(i + 1) % 3];
        const double low = y - kReach, high = y + kReach;
        if (std::max(a.y, b.y) < low || std::min(a.y, b.y) > high) continue;
        for (const double end : {low, high}) {
            const double at = std::clamp(end, std::min(a.y, b.y), std::max(a.y, b.y));
            // A horizontal edge contributes both ends.
            const double s = a.y == b.y ? (end == low ? 0.0 : 1.0) : (at - a.y) / (b.y - a.y);
            const double there = a.x + s * (b.x - a.x);
            x = {std::min(x[0], there), std::max(x[1], there)};
        }
    }
    return x;
}

/// Return the first and the last texel with a centre between two coordinates.
std::int32_t firstTexel(double from) {
    return static_cast<std::int32_t>(std::ceil(from - 0.5));
}
std::int32_t lastTexel(double to) {
    return static_cast<std::int32_t>(std::floor(to - 0.5));
}

std::size_t wrapped(std::int32_t i, int size) {
    const std::int32_t r = i % size;
    return static_cast<std::size_t>(r < 0 ? r + size : r);
}

}  // namespace

template <class Body>
void TexelCoverage::forEachReach(const Body& body) const {
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
        const auto [low, high] =
            std::minmax({triangles_[i][0].y, triangles_[i][1].y, triangles_[i][2].y});
        body(static_cast<std::uint32_t>(i), firstTexel(low - kReach), lastTexel(high + kReach));
    }
}

TexelCoverage::TexelCoverage(std::span<const UvTriangle> triangles, int size)
    : triangles_(triangles), size_(size) {
    double looked_at = 0;
    for (const UvTriangle& t : triangles) {
        const glm::dvec2 box = glm::max(t[0], glm::max(t[1], t[2])) -
                               glm::min(t[0], glm::min(t[1], t[2])) + 2 * kReach;
        looked_at += box.x * box.y;
        if (looked_at <= kMostLookedAt) continue;
        throw Error(ErrorKind::kInput, "the UVs repeat the texture too often to bake into it", "",
                    "use " + Parameter::kTarget + " vertices, another " + Parameter::kUvSet +
                        ", or a smaller " + Parameter::kSize);
    }
    first_crossing_.assign(static_cast<std::size_t>(size) + 1, 0);
    forEachReach([&](std::uint32_t, std::int32_t low, std::int32_t high) {
        for (std::int32_t y = low; y <= high; ++y)
            ++first_crossing_[wrapped(y, size) + 1];
    });
    for (std::size_t y = 0; y < static_cast<std::size_t>(size); ++y)
        first_crossing_[y + 1] += first_crossing_[y];
    crossings_.resize(first_crossing_.back());
    std::vector<std::size_t> next(first_crossing_.begin(), first_crossing_.end() - 1);
    forEachReach([&](std::uint32_t triangle, std::int32_t low, std::int32_t high) {
        for (std::int32_t y = low; y <= high; ++y)
            crossings_[next[wrapped(y, size)]++] = {triangle, y};
    });
}

TexelRow TexelCoverage::row(int y) const {
    const auto width = static_cast<std::size_t>(size_);
    std::vector<std::uint32_t> covering(width, 0);  // number of triangles that cover each texel
    std::vector<TexelSample> kept(width * kMostSamples);
    // For each texel: the squared distance of the nearest triangle that touches the texel's
    // circumscribed circle.
    std::vector<double> nearest(width, kReach * kReach);
    const auto sample = [](std::uint32_t triangle, const glm::dvec3& weights) {
        return TexelSample{triangle, glm::vec2(weights.y, weights.z)};
    };
    const auto row = static_cast<std::size_t>(y);
    for (std::size_t c = first_crossing_[row]; c < first_crossing_[row + 1]; ++c) {
        const UvTriangle& t = triangles_[crossings_[c].triangle];
        const double centre = crossings_[c].y + 0.5;
        const auto [left, right] = extentAt(t, centre);
        for (std::int32_t i = firstTexel(left - kReach); i <= lastTexel(right + kReach); ++i) {
            const glm::dvec2 p(i + 0.5, centre);
            const std::size_t x = wrapped(i, size_);
            TexelSample* const samples = kept.data() + x * kMostSamples;
            glm::dvec3 weights(0);
            if (covers(t, p, weights)) {
                if (covering[x] < kMostSamples)
                    samples[covering[x]] = sample(crossings_[c].triangle, weights);
                ++covering[x];
            } else if (covering[x] == 0) {
                const EdgePoint touch = nearestOnEdges(t, p);
                if (touch.distance2 >= nearest[x]) continue;
                nearest[x] = touch.distance2;
                samples[0] = sample(crossings_[c].triangle, touch.weights);
            }
        }
    }
    TexelRow result;
    result.first.resize(width + 1);
    for (std::size_t x = 0; x < width; ++x) {
        std::uint32_t count = std::min(covering[x], kMostSamples);
        if (covering[x] > 0) ++result.covered;
        if (covering[x] > 1) ++result.shared;
        if (count == 0 && nearest[x] < kReach * kReach) count = 1;
        const TexelSample* const samples = kept.data() + x * kMostSamples;
        result.samples.insert(result.samples.end(), samples, samples + count);
        result.first[x + 1] = static_cast<std::uint32_t>(result.samples.size());
    }
    return result;
}

}  // namespace peeler
