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
    glm::dvec3 from{0}, to{0};  ///< on both of its sides, world space
    std::uint32_t triangle = 0, opposite = 0;
};

/// Faces that are opposite within this angle have a wall between them, in degrees; faces that share
/// a corner are an edge, however thin the part gets towards it.
inline constexpr double kWallAngle = 30;
/// No place has a wall thinner by more than this share than the one that is found.
inline constexpr double kWallTolerance = 1e-4;

/// The result of a search for the thinnest wall.
struct FoundWall {
    std::optional<Wall> wall;  ///< none if no faces are opposite
    bool certain = true;       ///< otherwise so much crosses that there may be a thinner one
};

/// The thinnest wall: from a point of the surface straight into the material, against the normal of
/// its triangle, to where that leaves it again, through a face that looks the other way within
/// kWallAngle and has no corner in common with it. Of all points of the surface, not of some: pairs
/// of faces are compared where one lies behind the other, and their distance there, which is a
/// linear function, is least at a corner of what they have in common. The tree's mesh faces
/// outwards.
FoundWall thinnestWall(const TriangleTree& tree, const Progress& progress = {});

/// Edges at which the two faces of a mesh that faces outwards enclose less than kWallAngle of
/// material: towards these a part gets thin without an end.
std::vector<PartEdge> sharpEdges(const PartMesh& mesh, const PartTopology& topology);

}  // namespace peeler
