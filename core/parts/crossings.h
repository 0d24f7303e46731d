// SPDX-License-Identifier: Apache-2.0
// Self-contacts and self-intersections of a part's surface.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <utility>
#include <vector>

#include <peeler/work.h>
#include "core/parts/part_tree.h"

namespace peeler {

/// The largest distance between touching surfaces, as a fraction of PartMesh::size(). It is about
/// ten times the precision of 32-bit float positions.
inline constexpr double kTouching = 1e-6;

/// The relation between two triangles.
enum class Meeting : std::uint8_t {
    kApart,
    kTouch,  ///< the triangles share points but do not pass through each other
    kCross,  ///< the triangles pass through each other, or overlap in one plane
};

/// Returns the relation between two triangles that share at most two corners. Compares their
/// intervals on the line where their planes intersect (Möller 1997, "A Fast Triangle-Triangle
/// Intersection Test"). Points within `near` (scene units) of a plane or line are taken to lie on
/// it. `shared` is the number of shared corners; triangles that share corners are never kTouch.
Meeting meetingOf(const std::array<glm::dvec3, 3>& a, const std::array<glm::dvec3, 3>& b,
                  int shared, double near);

/// The ends of a segment in space.
using Segment = std::array<glm::dvec3, 2>;

/// Returns the segment along which two triangles pass through each other; nothing if they overlap
/// in one plane. The triangles must be kCross for the same `near`.
std::optional<Segment> crossingSegment(const std::array<glm::dvec3, 3>& a,
                                       const std::array<glm::dvec3, 3>& b, double near);

using CrossingPair = std::pair<std::uint32_t, std::uint32_t>;

/// Self-contacts and self-intersections of a surface.
struct Crossings {
    bool more = false;  ///< whether `pairs` is incomplete, because a step limit was reached
    /// Pairs of triangles in ascending order. The smaller index of a pair comes first.
    std::vector<CrossingPair> pairs;
    /// For each triangle: 1 if another triangle crosses it, or touches it without sharing a corner.
    /// Incomplete if `more` is true.
    std::vector<char> touched;
};
Crossings findCrossings(const PartTree& tree, const Progress& progress = {});
/// Returns 1 for each triangle of the mesh that another triangle crosses, else 0. Complete unless
/// Crossings::more.
std::vector<char> crossedTriangles(const Crossings& crossings);

/// The crossings of a mesh as segments. The mesh must outlive the object.
class CrossingCurve {
  public:
    explicit CrossingCurve(const PartMesh& mesh) : mesh_(mesh), near_(kTouching * mesh.size()) {}

    /// Returns a pair's crossingSegment().
    std::optional<Segment> segment(const CrossingPair& pair) const {
        return crossingSegment(mesh_.corners(pair.first), mesh_.corners(pair.second), near_);
    }
    /// Returns the middle of a pair's segment; without a segment, the middle of its first triangle.
    glm::dvec3 middle(const CrossingPair& pair) const;
    /// Returns the sum of the segments' lengths.
    double length(const std::vector<CrossingPair>& pairs) const;

  private:
    const PartMesh& mesh_;
    double near_;
};

}  // namespace peeler
