// SPDX-License-Identifier: Apache-2.0
// Distance of a point from the edges of a projected triangle, which may be clipped.
#pragma once

#include <algorithm>
#include <cstddef>
#include <glm/glm.hpp>
#include <limits>
#include <span>

namespace peeler::test {

/// Returns the distance between the point and the polygon's edges; infinite for a polygon without
/// corners.
inline double distanceToEdges(std::span<const glm::dvec2> corners, const glm::dvec2& point) {
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const glm::dvec2 a = corners[i], ab = corners[(i + 1) % corners.size()] - a;
        const double length = glm::dot(ab, ab);
        const double t = length > 0 ? std::clamp(glm::dot(point - a, ab) / length, 0.0, 1.0) : 0;
        nearest = std::min(nearest, glm::length(point - a - t * ab));
    }
    return nearest;
}

/// Returns the least angle, in radians, at which the origin of a ray sees a triangle's edges beside
/// the ray. `direction` has length 1.
inline double angleToEdges(std::span<const glm::dvec3> corners, const glm::dvec3& origin,
                           const glm::dvec3& direction) {
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const glm::dvec3 a = corners[i] - origin;
        const glm::dvec3 ab = corners[(i + 1) % corners.size()] - origin - a;
        // The point of the edge that is nearest to the line of the ray.
        const glm::dvec3 p = a - glm::dot(a, direction) * direction;
        const glm::dvec3 q = ab - glm::dot(ab, direction) * direction;
        const double length = glm::dot(q, q);
        const double s = length > 0 ? std::clamp(-glm::dot(p, q) / length, 0.0, 1.0) : 0;
        nearest = std::min(nearest, glm::length(p + s * q) / glm::length(a + s * ab));
    }
    return nearest;
}

}  // namespace peeler::test
