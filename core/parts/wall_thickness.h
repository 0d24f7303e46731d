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

/// The thinnest place of a wall.
struct Wall {
    double thickness = 0;       ///< scene units
    glm::dvec3 from{0}, to{0};  ///< on its two sides, world space
    std::uint32_t triangle = 0, opposite = 0;
};

/// Faces that are opposite within this angle, in degrees, have a wall between them. Faces that
/// share a corner form an edge, however thin the part gets toward it.
inline constexpr double kWallAngle = 30;
/// No wall is thinner than the one found by more than this fraction.
inline constexpr double kWallTolerance = 1e-4;

/// The result of a search for the thinnest wall.
struct FoundWall {
    std::optional<Wall> wall;  ///< none if no faces are opposite
    bool certain = true;       ///< otherwise the surfaces cross so much that a thinner one may
                               ///< exist
};

/// Finds the thinnest wall. Thickness is measured from a surface point straight into the material,
/// against the normal of its triangle, to the exit through a face that is opposite within
/// kWallAngle and shares no corner with it. The search covers all points of the surface, not
/// samples: it compares pairs of faces where one lies behind the other. Their distance is linear
/// there, so its minimum is at a corner of their overlap. The tree's mesh faces outwards.
FoundWall thinnestWall(const TriangleTree& tree, const Progress& progress = {});

/// Returns the edges whose two faces enclose less than kWallAngle of material; a part gets
/// arbitrarily thin toward these. The mesh faces outwards.
std::vector<PartEdge> sharpEdges(const PartMesh& mesh, const PartTopology& topology);

}  // namespace peeler
