// SPDX-License-Identifier: Apache-2.0
// How far a point is from the edges of a projected triangle.
#pragma once

#include <algorithm>
#include <glm/glm.hpp>
#include <limits>

namespace peeler::test {

inline double distanceToEdges(const glm::dvec2 (&corners)[3], const glm::dvec2& point) {
    double nearest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
        const glm::dvec2 a = corners[i], ab = corners[(i + 1) % 3] - a;
        const double length = glm::dot(ab, ab);
        const double t = length > 0 ? std::clamp(glm::dot(point - a, ab) / length, 0.0, 1.0) : 0;
        nearest = std::min(nearest, glm::length(point - a - t * ab));
    }
    return nearest;
}

}  // namespace peeler::test
