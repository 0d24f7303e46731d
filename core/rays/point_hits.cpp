// SPDX-License-Identifier: Apache-2.0
#include "core/rays/point_hits.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel.h"
#include "core/scene/elements.h"

namespace peeler {
namespace {

constexpr std::size_t kPointsAtOnce = 1024;
// A surface touches a point if it is within this distance of the point, as a fraction of the
// coordinates. The distance allows for a few rounding errors of doubles.
constexpr double kOnSurface = 1e-12;
// The number of hits to consider after the first. More than one is needed, because the parallel ray
// through the point may meet the primitives in a different order.
constexpr int kBeyond = 2;
// The maximum difference, in ray spacings, between two distances: from the point to the element's
// plane, and from the point to the element. If the difference is larger, the distance to the
// element is used.
constexpr double kSteepestPlane = 4;

double largestComponent(const glm::dvec3& v) {
    return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

/// Finds the hits next to one point on its nearest ray.
class Search {
  public:
    Search(const PosedScene& posed, const Bundle& bundle, const glm::dvec3& point)
        : posed_(posed),
          direction_(bundle.direction()),
          point_(point),
          farthest_(kSteepestPlane * bundle.size().x / bundle.view.width) {}

    PointHits among(std::span<const float> z, std::span<const std::uint32_t> keys, double at) {
        const auto place = static_cast<std::size_t>(std::ranges::upper_bound(z, at) - z.begin());
        int beyond = 0;
        for (std::size_t i = place; i > 0; --i) {
            // Does not stop between coincident hits.
            if (beyond > kBeyond && z[i - 1] != z[i]) break;
            consider(keys[i - 1], false);
            if (hits_.before.key != 0) ++beyond;
        }
        beyond = 0;
        for (std::size_t i = place; i < z.size(); ++i) {
            if (beyond > kBeyond && z[i] != z[i - 1]) break;
            consider(keys[i], true);
            if (hits_.after.key != 0) ++beyond;
        }
        return hits_;
    }

  private:
    /// Records the hit if it is the nearest so far on its side of the point. `later`: whether the
    /// search moves towards later hits.
    void consider(std::uint32_t key, bool later) {
        WorldElement element = elementOf(posed_, key);
        placeCorners(posed_, element);
        const glm::dvec3 hit = element.weighted(element.weightsAt(point_, direction_));
        double along = glm::dot(hit - point_, direction_);
        const glm::dvec3 normal = element.normal();
        const double plane =
            glm::dot(element.corner[0] - point_, normal) / glm::dot(direction_, normal);
        // Uses the distance to the element's plane, unless the element has no plane or is seen
        // edge-on.
        if (std::abs(plane - along) <= farthest_) along = plane;
        if (std::abs(along) <= kOnSurface * (largestComponent(hit) + largestComponent(point_)))
            along = 0;
        // Among coincident hits before the point, the last one wins. Among coincident hits after
        // the point, the first one wins.
        const bool is_after = along > 0;
        NextHit& next = is_after ? hits_.after : hits_.before;
        const double distance = std::abs(along);
        const bool wins_tie = is_after != later;
        if (distance < next.distance || (wins_tie && distance == next.distance))
            next = {distance, key};
    }

    const PosedScene& posed_;
    const glm::dvec3 direction_, point_;
    const double farthest_;
    PointHits hits_;
};

}  // namespace

std::optional<glm::ivec2> nearestRay(const Bundle& bundle, const glm::dvec3& point) {
    const View& view = bundle.view;
    const glm::dvec3 from = point - bundle.origin();
    const glm::dvec2 across(glm::dot(from, bundle.right()), -glm::dot(from, bundle.up()));
    const glm::dvec2 at =
        glm::floor((across / bundle.size() + 0.5) * glm::dvec2(view.width, view.height));
    const Window& crop = view.crop;
    // The comparison uses doubles, since the coordinates of far points overflow an int.
    if (!(at.x >= crop.x0 && at.x < crop.x1 && at.y >= crop.y0 && at.y < crop.y1)) return {};
    return glm::ivec2(at);
}

void findPointHits(const PosedScene& posed, const Bundle& bundle, const LayeredImage& band,
                   std::span<const glm::dvec3> points, std::span<PointHits> found) {
    const auto keys = band.extra.at(0).as<const std::uint32_t>();
    const glm::dvec3 origin = bundle.origin(), direction = bundle.direction();
    const std::span<const float> z(band.z);
    const std::size_t parts = (points.size() + kPointsAtOnce - 1) / kPointsAtOnce;
    parallelFor(parts, [&](std::size_t part) {
        const std::size_t end = std::min(points.size(), (part + 1) * kPointsAtOnce);
        for (std::size_t i = part * kPointsAtOnce; i < end; ++i) {
            const std::optional<glm::ivec2> ray = nearestRay(bundle, points[i]);
            if (!ray || ray->y < band.window.y0 || ray->y >= band.window.y1) continue;
            const std::size_t pixel = band.pixelIndex(ray->x, ray->y);
            const std::size_t first = band.offsets[pixel], count = band.count(pixel);
            Search search(posed, bundle, points[i]);
            found[i] = search.among(z.subspan(first, count), keys.subspan(first, count),
                                    glm::dot(points[i] - origin, direction));
        }
    });
}

}  // namespace peeler
