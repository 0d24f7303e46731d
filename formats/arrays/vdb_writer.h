// SPDX-License-Identifier: Apache-2.0
// Writes voxels for OpenVDB: .vdb files with one grid.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <iosfwd>
#include <span>
#include <string>

#include "formats/file/atomic_file.h"

namespace peeler {

/// A lattice of cubes of side `spacing` (scene units); the least corner of the first one is at
/// `corner`, in world space.
struct VdbVoxels {
    glm::ivec3 cells{0};
    glm::dvec3 corner{0};
    double spacing = 1;
    /// Whether the cell (x, y, z) is inside says bit z % 64 of the word z / 64 of a line, which is
    /// the (x · cells.y + y)-th; every line begins with a word of its own.
    std::span<const std::uint64_t> inside{};
};

/// Writes a fog volume: a grid `density` of floats that is 1 and active inside, 0 elsewhere. Whole
/// index coordinates are cell centres. The same voxels make the same bytes: the file's UUID, which
/// OpenVDB draws by chance, is replaced by a hash of the content. Takes about 4 bytes of memory for
/// each cell near the boundary, and little inside. `file` is not committed. Throws Error (kOutput),
/// (kMemory).
void writeVdb(AtomicFile& file, const VdbVoxels& voxels, const std::string& creator);

/// The function that the module of OpenVDB (formats/modules/vdb_grid.cpp) exports under the name
/// kVdbModuleFunction; the module is loaded for the first grid. Writes the grid of writeVdb() to a
/// stream, with the UUID that OpenVDB draws, and with at most so many threads (from 1). Throws what
/// OpenVDB throws, all of it std::exception.
using VdbModuleFunction = void(std::ostream& stream, const VdbVoxels& voxels,
                               const std::string& creator, int threads);
inline constexpr char kVdbModule[] = "peeler_vdb";
inline constexpr char kVdbModuleFunction[] = "peelerWriteVdbGrid";

}  // namespace peeler
