// SPDX-License-Identifier: Apache-2.0
// The thinnest wall of a part, and its sharp edges.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include <peeler/work.h>
#include "core/parts/part_mesh.h"
#include "core/parts/triangle_tree.h"

namespace peeler {

/// A wall at its thinnest point.
struct Wall {
    double thickness = 0;       ///< scene units
    glm::dvec3 from{0}, to{0};  ///< on its two sides, world space
    std::uint32_t triangle = 0, opposite = 0;
};

/// The largest angle, in degrees, by which two faces may deviate from opposite directions and still
/// have a wall between them. Faces that share a corner form an edge instead, however thin the part
/// gets toward it.
inline constexpr double kWallAngle = 30;
/// Relative tolerance of thinnestWall(): no wall is thinner than the returned one by more than this
/// fraction.
inline constexpr double kWallTolerance = 1e-4;

/// The result of a search for the thinnest wall.
struct FoundWall {
    std::optional<Wall> wall;  ///< nothing if no two faces have a wall between them
    bool certain = true;  ///< false: the search was cut short, because it took too many steps; a
                          ///< thinner wall may exist
};

/// Finds the thinnest wall. Thickness is measured from a surface point straight into the material,
/// against the normal of its triangle, to where that line leaves the material through another face,
/// which faces the opposite direction to within kWallAngle and shares no corner with that triangle.
/// The search covers all points of the surface, not samples: it compares pairs of faces that lie
/// one behind the other. Where they overlap, their distance is linear, so its minimum is at a
/// corner of the overlap. The tree's mesh must face outwards.
FoundWall thinnestWall(const TriangleTree& tree, const Progress& progress = {});

/// Returns the edges whose two faces enclose less than kWallAngle of material; a part gets
/// arbitrarily thin toward such edges. The mesh must face outwards.
std::vector<PartEdge> sharpEdges(const PartMesh& mesh, const PartTopology& topology);

}  // namespace peeler
