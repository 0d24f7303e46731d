// SPDX-License-Identifier: Apache-2.0
// How the shells of a mesh lie to each other, and how much they enclose.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <peeler/work.h>
#include "core/parts/crossings.h"
#include "core/parts/part_mesh.h"
#include "core/parts/triangle_tree.h"

namespace peeler {

/// What a shell is to the others of its mesh. Outwards and inwards are told by the sign of what it
/// encloses, depth by how many of the others are around it.
enum class ShellSide : std::uint8_t {
    kOpen,       ///< it has no inside
    kFlat,       ///< its sides touch everywhere, so that it encloses nothing
    kOutside,    ///< of a body: it faces outwards, as many shells around it as make an even number
    kCavity,     ///< of a hollow: it faces inwards, an odd number of shells around it
    kInsideOut,  ///< it faces inwards, an even number of shells around it
    kInside,     ///< it faces outwards, an odd number of shells around it: overlap
};

/// Sides of PartTopology::shells.
std::vector<ShellSide> findSides(const TriangleTree& tree, const PartTopology& topology);

/// The mesh with turned triangles, and shells that are inside out, turned back.
PartMesh turnedBack(const PartMesh& mesh, const PartTopology& topology,
                    const std::vector<ShellSide>& sides);

/// The area of all triangles, scene units squared.
double areaOf(const PartMesh& mesh);
/// What the triangles enclose, cavities taken away, what overlaps as often as it is there; scene
/// units cubed. Of closed meshes that face outwards.
double volumeOf(const PartMesh& mesh);
/// What is inside at least once, scene units cubed. The surface of that is those places of the
/// surface that have no body in front of them (FreeArea). Nothing if so much crosses that it would
/// take long. `topology` and `crossings` are those of the tree's mesh, which is closed and faces
/// outwards.
std::optional<double> unionVolume(const TriangleTree& tree, const PartTopology& topology,
                                  const Crossings& crossings, const Progress& progress = {});

}  // namespace peeler
