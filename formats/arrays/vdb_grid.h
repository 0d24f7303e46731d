// SPDX-License-Identifier: Apache-2.0
// OpenVDB, a module that is loaded for the first grid: modules/vdb_grid.cpp.
#pragma once

#include <iosfwd>
#include <string>

#include "formats/arrays/vdb_writer.h"

namespace peeler {

/// What the module exports, under the name kVdbModuleFunction: writes the grid of writeVdb() to a
/// stream, its UUID as OpenVDB draws it, with at most so many threads (from 1). Throws what OpenVDB
/// throws, all of it std::exception.
using VdbModuleFunction = void(std::ostream& stream, const VdbVoxels& voxels,
                               const std::string& creator, int threads);
inline constexpr char kVdbModule[] = "peeler_vdb";
inline constexpr char kVdbModuleFunction[] = "peelerWriteVdbGrid";

}  // namespace peeler
