// SPDX-License-Identifier: Apache-2.0
// Voxels for OpenVDB: .vdb with one grid.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <iosfwd>
#include <span>
#include <string>

#include "formats/file/atomic_file.h"

namespace peeler {

/// Cubes of side `spacing`, the first one's least corner at `corner`, world space.
struct VdbVoxels {
    glm::ivec3 cells{0};
    glm::dvec3 corner{0};
    double spacing = 1;
    /// Of the cell (x, y, z) at (x · cells.y + y) · cells.z + z.
    std::span<const std::uint8_t> values{};
    std::uint8_t least_inside = 1;  ///< cells of this value or a greater one are inside
};

/// Writes a fog volume: a grid `density` of floats that is 1 and active inside, 0 elsewhere. Whole
/// index coordinates are cell centres. The same voxels make the same bytes: the file's UUID, which
/// OpenVDB draws by chance, is a hash of its content. In memory it takes about 4 bytes a cell on
/// the boundary and little inside. `file` is not committed. Throws Error (kOutput), (kMemory).
void writeVdb(AtomicFile& file, const VdbVoxels& voxels, const std::string& creator);

/// What the module of OpenVDB (modules/vdb_grid.cpp), which is loaded for the first grid, exports,
/// under the name kVdbModuleFunction: writes the grid of writeVdb() to a stream, its UUID as
/// OpenVDB draws it, with at most so many threads (from 1). Throws what OpenVDB throws, all of it
/// std::exception.
using VdbModuleFunction = void(std::ostream& stream, const VdbVoxels& voxels,
                               const std::string& creator, int threads);
inline constexpr char kVdbModule[] = "peeler_vdb";
inline constexpr char kVdbModuleFunction[] = "peelerWriteVdbGrid";

}  // namespace peeler
