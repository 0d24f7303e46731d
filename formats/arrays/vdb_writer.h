// SPDX-License-Identifier: Apache-2.0
// OpenVDB writer: .vdb files with one grid of voxels.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <iosfwd>
#include <span>
#include <string>

#include "formats/file/atomic_file.h"

namespace peeler {

/// A lattice of cubic cells of side `spacing` (scene units). The least corner of the first cell is
/// at `corner`, in world space.
struct VdbVoxels {
    glm::ivec3 cells{0};
    glm::dvec3 corner{0};
    double spacing = 1;
    /// Occupancy bits: cell (x, y, z) is bit z % 64 of word z / 64 in line x · cells.y + y. Every
    /// line begins on a word boundary.
    std::span<const std::uint64_t> inside{};
};

/// Writes a fog volume: a float grid `density` that is 1 and active inside, 0 elsewhere. Integer
/// index coordinates are cell centres. The same voxels produce the same bytes: the file's UUID,
/// which OpenVDB would draw at random, is a hash of the content. Takes about 4 bytes of memory per
/// cell near the boundary, and little inside. Does not commit `file`. Throws Error (kOutput) if
/// writing fails, Error (kMemory) if memory runs out.
void writeVdb(AtomicFile& file, const VdbVoxels& voxels, const std::string& creator);

/// The type of the function that the OpenVDB module (formats/modules/vdb_grid.cpp) exports as
/// kVdbModuleFunction; the module is loaded when the first grid is written. The function writes the
/// grid of writeVdb() to a stream, with OpenVDB's random UUID, on at most `threads` (1 or more)
/// threads. Throws OpenVDB's exceptions, all derived from std::exception.
using VdbModuleFunction = void(std::ostream& stream, const VdbVoxels& voxels,
                               const std::string& creator, int threads);
inline constexpr char kVdbModule[] = "peeler_vdb";
inline constexpr char kVdbModuleFunction[] = "peelerWriteVdbGrid";

}  // namespace peeler
