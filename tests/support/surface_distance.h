// SPDX-License-Identifier: Apache-2.0
// Distances between points and a scene's triangles. Embree finds the candidates.
#pragma once

#include <algorithm>
#include <glm/glm.hpp>

#include "support/embree.h"
#include "support/embree_oracle.h"

namespace peeler::test {

/// Returns the point of a triangle that is nearest to p (Ericson, "Real-Time Collision Detection",
/// 2005, 5.1.5).
inline glm::dvec3 nearestPoint(const Triangle& triangle, const glm::dvec3& p) {
    const glm::dvec3 &a = triangle.corner[0], &b = triangle.corner[1], &c = triangle.corner[2];
    const glm::dvec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return a;
    const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return b;
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
    const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return c;
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
        return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
    const double scale = 1 / (va + vb + vc);
    return a + vb * scale * ab + vc * scale * ac;
}

/// A finder of the distance from a point to the nearest triangle of a soup. The soup must outlive
/// this object.
class SurfaceDistance {
  public:
    explicit SurfaceDistance(const TriangleSoup& soup)
        : soup_(soup), scene_(soup, nullptr, RTC_SCENE_FLAG_NONE) {}

    /// Returns the distance in scene units, or `limit` if no triangle is nearer than `limit`.
    double operator()(const glm::dvec3& point, double limit) const {
        Search search{&soup_, point, limit};
        RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        RTCPointQuery query{};
        query.x = static_cast<float>(point.x);
        query.y = static_cast<float>(point.y);
        query.z = static_cast<float>(point.z);
        query.radius = static_cast<float>(limit);
        rtcPointQuery(scene_, &query, &context, &SurfaceDistance::visit, &search);
        return search.distance;
    }

  private:
    struct Search {
        const TriangleSoup* soup;
        glm::dvec3 point;
        double distance;
    };
    static bool visit(RTCPointQueryFunctionArguments* arguments) {
        auto* search = static_cast<Search*>(arguments->userPtr);
        const glm::dvec3 nearest =
            nearestPoint(search->soup->triangles[arguments->primID], search->point);
        search->distance = std::min(search->distance, glm::distance(nearest, search->point));
        return false;  // the search radius stays the same
    }

    const TriangleSoup& soup_;
    EmbreeScene scene_;
};

}  // namespace peeler::test
