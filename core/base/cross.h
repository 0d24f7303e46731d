// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <glm/vec2.hpp>

namespace peeler {

/// Returns the z of the cross product of two vectors in a plane: the signed area of their
/// parallelogram, positive if `b` is counter-clockwise of `a` (y upwards).
inline double cross(const glm::dvec2& a, const glm::dvec2& b) {
    return a.x * b.y - a.y * b.x;
}

}  // namespace peeler
