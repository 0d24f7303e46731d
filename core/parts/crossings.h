// SPDX-License-Identifier: Apache-2.0
// Where the surface of a part touches or crosses itself.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <utility>
#include <vector>

#include <peeler/work.h>
#include "core/parts/triangle_tree.h"

namespace peeler {

/// What is nearer than this share of a part's size touches: as much as positions in 32-bit floats
/// are unsure of, some ten times over.
inline constexpr double kTouching = 1e-6;

/// How two triangles lie to each other.
enum class Meeting : std::uint8_t {
    kApart,
    kTouch,  ///< they have points in common, and none of them lies on both sides of the other
    kCross,  ///< they go through each other, or lie in one plane and overlap
};

/// The meeting of two triangles with at most two common corners; `near` is the distance (scene
/// units) up to which points count as lying in a plane or on a line (Möller 1997, "A Fast
/// Triangle-Triangle Intersection Test": the intervals that both cut out of the line in which their
/// planes meet). `shared` is how many corners they have in common, which is no touch.
Meeting meetingOf(const std::array<glm::dvec3, 3>& a, const std::array<glm::dvec3, 3>& b,
                  int shared, double near);

/// Where a surface goes through itself.
struct Crossings {
    bool more = false;  ///< so much touches or crosses that `pairs` has only the first
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;  ///< the lesser first, sorted
    /// Triangles that something not next to them touches or crosses; not all if there are more.
    std::vector<char> touched;
};
Crossings findCrossings(const TriangleTree& tree, const Progress& progress = {});
/// Whether another triangle goes through one.
bool isCrossed(const TriangleTree& tree, std::uint32_t triangle);

}  // namespace peeler
