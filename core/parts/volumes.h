// SPDX-License-Identifier: Apache-2.0
// Nesting of the shells of a mesh, and enclosed volumes.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <peeler/work.h>
#include "core/parts/crossings.h"
#include "core/parts/part_mesh.h"
#include "core/parts/triangle_tree.h"

namespace peeler {

/// Role of a shell within its mesh. The sign of its volume gives the orientation, the number of
/// shells around it the depth.
enum class ShellSide : std::uint8_t {
    kOpen,       ///< no inside
    kFlat,       ///< its sides touch everywhere, so it encloses nothing
    kOutside,    ///< outside of a body: faces outwards, an even number of shells around it
    kCavity,     ///< inner surface of a cavity: faces inwards, an odd number of shells around it
    kInsideOut,  ///< faces inwards, an even number of shells around it
    kInside,     ///< faces outwards, an odd number of shells around it: overlap
};

/// Returns the sides of PartTopology::shells.
std::vector<ShellSide> findSides(const TriangleTree& tree, const PartTopology& topology);

/// Returns the mesh with turned triangles and inside-out shells flipped.
PartMesh turnedBack(const PartMesh& mesh, const PartTopology& topology,
                    const std::vector<ShellSide>& sides);

/// Returns the area of all triangles, scene units squared.
double areaOf(const PartMesh& mesh);
/// Returns the volume enclosed by closed meshes that face outwards, scene units cubed. Cavities are
/// subtracted; overlaps count once per body.
double volumeOf(const PartMesh& mesh);
/// Returns the volume inside at least one body, scene units cubed. Its boundary is the part of the
/// surface without a body in front of it (FreeArea). Returns nothing if the surfaces cross so much
/// that it would take long. `topology` and `crossings` are those of the tree's mesh, which is
/// closed and faces outwards.
std::optional<double> unionVolume(const TriangleTree& tree, const PartTopology& topology,
                                  const Crossings& crossings, const Progress& progress = {});

}  // namespace peeler
