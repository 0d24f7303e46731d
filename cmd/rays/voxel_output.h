// SPDX-License-Identifier: Apache-2.0
// rays --voxels: what is inside of solids, cell by cell.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "cmd/rays/ray_output.h"
#include "core/base/memory_budget.h"
#include "core/rays/voxels.h"
#include "formats/arrays/npz_writer.h"
#include "formats/file/atomic_file.h"

namespace peeler::cmd {

/// Takes the three bundles of `lattice` and writes which cells' centres are inside of some solid,
/// by the majority of the three axes.
///
/// .npz: `occupancy` (uint8, 0 or 1; shape (nx, ny, nz), so that occupancy[x, y, z] is the cell at
/// corner + (x, y, z) · spacing), `votes` (uint8, likewise: how many axes found it inside),
/// `corner` (double, 3: least corner of the first cell, world space), `spacing` (double).
/// .vdb: see formats/arrays/vdb_writer.h.
///
/// One byte a cell is kept, and for .vdb what OpenVDB takes.
class VoxelOutput : public RayOutput {
  public:
    /// `memory` is all that may be taken. Everything referred to must outlive it.
    /// Throws Error (kUsage) unless the path ends in .npz or .vdb, and (kMemory) if the cells are
    /// more than the budget or more than there is room for.
    VoxelOutput(std::string path, const Solids& solids, AxisBundles lattice,
                const MemoryBudget& memory, std::string creator);

    /// Creates the hidden file.
    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override;
    void take(std::size_t bundle, const LayeredImage& band) override;
    void finish() override;
    /// "voxels": {"output", "cells", "spacing", "occupied", "disputed", "volume"}.
    void tell(nlohmann::ordered_json& result) const override;

  private:
    void writeArrays();

    std::string path_;
    AxisBundles lattice_;
    std::string creator_;
    bool is_grid_;                    ///< .vdb
    std::optional<AtomicFile> grid_;  ///< one of the two
    std::optional<NpzWriter> arrays_;
    VoxelVotes votes_;
};

}  // namespace peeler::cmd
