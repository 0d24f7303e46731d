// SPDX-License-Identifier: Apache-2.0
// Clip volumes: half-spaces and closed meshes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <glm/glm.hpp>
#include <vector>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// A clip volume: the intersection of all half-spaces and the interior of the closed meshes,
/// including their surfaces. The idea is from Everitt 2001: the second depth test of peeling "can
/// have an arbitrary location".
struct ClipVolume {
    /// The points p in world space with dot(normal, p) >= offset.
    struct HalfSpace {
        glm::dvec3 normal{0};
        double offset = 0;
        bool operator==(const HalfSpace&) const = default;
    };
    static constexpr std::size_t kMaxHalfSpaces = 32;

    std::vector<HalfSpace> half_spaces;
    /// Nodes whose meshes, taken together, bound the volume. These meshes are not drawn. A point is
    /// inside if its winding number is not 0.
    std::vector<int> nodes;
    bool keep_inside = true;

    bool operator==(const ClipVolume&) const = default;
    bool active() const { return !half_spaces.empty() || !nodes.empty(); }
    /// Restricts the volume to the box between two opposite corners, given in either order.
    void addBox(const glm::dvec3& a, const glm::dvec3& b) {
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 normal{0};
            normal[axis] = 1;
            half_spaces.push_back({normal, std::min(a[axis], b[axis])});
            half_spaces.push_back({-normal, -std::max(a[axis], b[axis])});
        }
    }
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
