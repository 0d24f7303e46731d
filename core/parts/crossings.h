// SPDX-License-Identifier: Apache-2.0
// Self-contacts and self-intersections of a part's surface.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <utility>
#include <vector>

#include <peeler/work.h>
#include "core/parts/triangle_tree.h"

namespace peeler {

/// Surfaces closer than this fraction of the part's size touch. It is about ten times the precision
/// of 32-bit float positions.
inline constexpr double kTouching = 1e-6;

/// Relation between two triangles.
enum class Meeting : std::uint8_t {
    kApart,
    kTouch,  ///< common points, but neither has points on both sides of the other
    kCross,  ///< they pass through each other, or overlap in one plane
};

/// Returns the relation between two triangles with at most two common corners (Möller 1997, "A Fast
/// Triangle-Triangle Intersection Test": the intervals that both cut out of the line where their
/// planes meet). Points within `near` (scene units) of a plane or line count as on it. `shared` is
/// the number of common corners; these do not count as a touch.
Meeting meetingOf(const std::array<glm::dvec3, 3>& a, const std::array<glm::dvec3, 3>& b,
                  int shared, double near);

/// Self-contacts and self-intersections of a surface.
struct Crossings {
    bool more = false;  ///< `pairs` was cut short at its limit
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;  ///< each and all in ascending
                                                                 ///< order
    /// Triangles touched or crossed by one that is not their neighbour; incomplete if `more`.
    std::vector<char> touched;
};
Crossings findCrossings(const TriangleTree& tree, const Progress& progress = {});
/// Whether another triangle passes through `triangle`.
bool isCrossed(const TriangleTree& tree, std::uint32_t triangle);

}  // namespace peeler
