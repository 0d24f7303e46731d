// SPDX-License-Identifier: Apache-2.0
// The thinnest wall of a part, and its sharp edges.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include <peeler/work.h>
#include "core/parts/part_mesh.h"
#include "core/parts/part_tree.h"

namespace peeler {

/// A wall at its thinnest point.
struct Wall {
    double thickness = 0;       ///< scene units
    glm::dvec3 from{0}, to{0};  ///< ends on the two sides of the wall, world space
    std::uint32_t triangle = 0, opposite = 0;
};

/// The largest angle, in degrees, by which two faces with a wall between them may deviate from
/// opposite directions. Two faces that share a corner form an edge instead of a wall, although the
/// part gets arbitrarily thin near the edge.
inline constexpr double kWallAngle = 30;
/// The relative tolerance of thinnestWall(). Any thinner wall is thinner than the returned one by
/// at most this fraction.
inline constexpr double kWallTolerance = 1e-4;

struct FoundWall {
    std::optional<Wall> wall;  ///< nullopt if no two faces have a wall between them
    /// False if the search exceeded its step limit. Then a thinner wall may exist.
    bool certain = true;
};

/// Finds the thinnest wall. Thickness is measured from a surface point straight into the material,
/// against the normal of the point's triangle, to the point where the line leaves the material
/// through another face. This face must face the opposite direction within kWallAngle, and share no
/// corner with the triangle. The search covers all points of the surface, not samples: it compares
/// pairs of faces of which one lies behind the other. Where two faces overlap, their distance is
/// linear, so its minimum is at a corner of the overlap. The tree's mesh must face outwards.
/// `omitted` (1 per triangle to omit; empty = none): these triangles are not faces of a wall.
FoundWall thinnestWall(const PartTree& tree, const std::vector<char>& omitted = {},
                       const Progress& progress = {});

/// Returns the edges whose two faces enclose material at less than kWallAngle. A part gets
/// arbitrarily thin toward such edges. The mesh must face outwards.
std::vector<PartEdge> sharpEdges(const PartMesh& mesh, const PartTopology& topology);

}  // namespace peeler
