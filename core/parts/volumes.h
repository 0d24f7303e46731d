// SPDX-License-Identifier: Apache-2.0
// Nesting of the shells of a mesh, and enclosed volumes.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <peeler/work.h>
#include "core/parts/crossings.h"
#include "core/parts/part_mesh.h"
#include "core/parts/part_tree.h"

namespace peeler {

/// The role of a shell within its mesh. It follows from the sign of the shell's volume (negative if
/// the shell faces inwards) and the number of shells around it.
enum class ShellSide : std::uint8_t {
    kOpen,       ///< the shell is open or not orientable, so it has no inside
    kFlat,       ///< the shell's two sides touch, so it encloses nothing
    kOutside,    ///< boundary of a body: faces outwards, an even number of shells around it
    kCavity,     ///< inner surface of a cavity: faces inwards, an odd number of shells around it
    kInsideOut,  ///< faces inwards although an even number of shells surround it
    kInside,     ///< faces outwards, an odd number of shells around it: bodies overlap
};

/// Returns the role of each shell in PartTopology::shells.
std::vector<ShellSide> findSides(const PartTree& tree, const PartTopology& topology);

/// Returns the mesh with a consistent orientation: flips the triangles in PartTopology::turned, and
/// all triangles of inside-out shells.
PartMesh turnedBack(const PartMesh& mesh, const PartTopology& topology,
                    const std::vector<ShellSide>& sides);

/// Returns the area of all triangles, in square scene units.
double areaOf(const PartMesh& mesh);
/// Returns the volume, in cubic scene units, of a closed mesh that faces outwards. Cavities are
/// subtracted. Overlapping bodies each count in full.
double volumeOf(const PartMesh& mesh);
/// Returns the volume inside at least one body, in cubic scene units. The boundary of this volume
/// is the part of the surface without a body in front (FreeArea). Returns nullopt if the surfaces
/// cross so often that the calculation would take too long. `topology` and `crossings` belong to
/// the tree's mesh, which must be closed and face outwards.
std::optional<double> unionVolume(const PartTree& tree, const PartTopology& topology,
                                  const Crossings& crossings, const Progress& progress = {});

}  // namespace peeler
