// SPDX-License-Identifier: Apache-2.0
// Directions of vectors, of which some may have none.
#pragma once

#include <glm/glm.hpp>

namespace peeler {

/// `v` scaled to unit length; 0 if it has no length.
template <class T>
glm::vec<3, T> unitOrZero(const glm::vec<3, T>& v) {
    const T length = glm::length(v);
    return length > 0 ? v / length : glm::vec<3, T>(0);
}

}  // namespace peeler
