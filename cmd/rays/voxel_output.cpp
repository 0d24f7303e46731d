// SPDX-License-Identifier: Apache-2.0
#include "cmd/rays/voxel_output.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <vector>

#include "cmd/cli/report.h"
#include "core/base/error.h"
#include "formats/arrays/vdb_writer.h"
#include "formats/file/file_extension.h"

namespace peeler::cmd {

namespace {

bool isGrid(const std::string& path) {
    const std::string extension = lowerExtension(path);
    if (extension == ".vdb") return true;
    if (extension == ".npz") return false;
    throw Error(ErrorKind::kUsage, "expected a name that ends in .npz or .vdb", path);
}

/// The lattice, once it is known that its cells may be kept.
const AxisBundles& withinBudget(const AxisBundles& lattice, const MemoryBudget& memory) {
    const std::uint64_t cells = VoxelVotes::cellsOf(lattice);
    if (memory != 0 && cells > memory) {
        throw Error(
            ErrorKind::kMemory, groupedText(cells) + " voxels do not fit into " + bytesText(memory),
            memory.where(), "a byte each is needed: ask for fewer of them, or allow more memory");
    }
    return lattice;
}

}  // namespace

VoxelOutput::VoxelOutput(std::string path, const Solids& solids, AxisBundles lattice,
                         const MemoryBudget& memory, std::string creator)
    : path_(std::move(path)),
      lattice_(std::move(lattice)),
      creator_(std::move(creator)),
      is_grid_(isGrid(path_)),
      votes_(withinBudget(lattice_, memory), solids) {}

void VoxelOutput::begin(std::span<const Bundle> bundles, std::span<const std::uint64_t>) {
    if (bundles.size() != 3) {
        throw Error(ErrorKind::kInternal, "voxels are made of three bundles", path_);
    }
    if (is_grid_) {
        grid_.emplace(path_);
        return;
    }
    std::vector<std::uint64_t> shape;
    for (int axis = 0; axis < 3; ++axis)
        shape.push_back(static_cast<std::uint64_t>(lattice_.cells[axis]));
    arrays_.emplace(path_, std::vector<NpzArray>{{"occupancy", NumberType::kUint8, shape},
                                                 {"votes", NumberType::kUint8, shape},
                                                 {"corner", NumberType::kDouble, {3}},
                                                 {"spacing", NumberType::kDouble, {}}});
}

void VoxelOutput::take(std::size_t bundle, const LayeredImage& band) {
    votes_.add(bundle, lattice_.bundles[bundle], band);
}

void VoxelOutput::finish() {
    if (!is_grid_) return writeArrays();
    writeVdb(
        *grid_,
        {lattice_.cells, lattice_.corner, lattice_.spacing, votes_.votes(), VoxelVotes::kMajority},
        creator_);
    grid_->commit();
}

void VoxelOutput::writeArrays() {
    constexpr std::size_t kAtOnce = std::size_t{1} << 20;
    const std::span<const std::uint8_t> votes = votes_.votes();
    std::vector<std::uint8_t> inside;
    for (std::size_t i = 0; i < votes.size(); i += kAtOnce) {
        const auto some = votes.subspan(i, std::min(kAtOnce, votes.size() - i));
        inside.resize(some.size());
        std::ranges::transform(some, inside.begin(), VoxelVotes::inside);
        arrays_->append(0, asBytes(inside));
    }
    arrays_->append(1, asBytes(votes));
    const std::array<double, 3> corner{lattice_.corner.x, lattice_.corner.y, lattice_.corner.z};
    arrays_->append(2, asBytes(corner));
    arrays_->append(3, asBytes(std::span(&lattice_.spacing, 1)));
    arrays_->finish();
}

void VoxelOutput::tell(nlohmann::ordered_json& result) const {
    const std::uint64_t occupied = votes_.occupied();
    const double cell = lattice_.spacing * lattice_.spacing * lattice_.spacing;
    result["voxels"] = {{"output", path_},
                        {"cells", {lattice_.cells.x, lattice_.cells.y, lattice_.cells.z}},
                        {"spacing", lattice_.spacing},
                        {"occupied", occupied},
                        {"disputed", votes_.disputed()},
                        {"volume", static_cast<double>(occupied) * cell}};
}

}  // namespace peeler::cmd
