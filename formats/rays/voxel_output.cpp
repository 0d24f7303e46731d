// SPDX-License-Identifier: Apache-2.0
// Writer of voxelised solids, as arrays or as an OpenVDB grid.

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "core/rays/voxels.h"
#include "formats/arrays/table_writers.h"
#include "formats/arrays/vdb_writer.h"
#include "formats/file/atomic_file.h"
#include "formats/file/file_name.h"
#include "formats/rays/ray_output.h"

namespace peeler {
namespace {

bool isVdb(const std::string& path) {
    if (lowerExtension(path) == ".vdb") return true;
    if (isArrayName(path)) return false;
    throw Error(ErrorKind::kUsage, "expected a name that ends in .npz, .safetensors or .vdb", path);
}

class VoxelOutput final : public RayOutput {
  public:
    VoxelOutput(std::string path, const Solids& solids, AxisBundles lattice, std::string creator,
                Overlap overlap)
        : path_(std::move(path)),
          lattice_(std::move(lattice)),
          creator_(std::move(creator)),
          is_grid_(isVdb(path_)),
          votes_(lattice_, solids, overlap) {}

    SizeForecast forecast(std::span<const Bundle>, std::span<const std::uint64_t>) const override;
    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override;
    void take(std::size_t bundle, const LayeredImage& band) override {
        votes_.add(bundle, lattice_.bundles[bundle], band);
    }
    void finish() override;
    RayResults results() const override;
    /// Includes OpenVDB's grid, which takes hardly more memory than the file has bytes.
    SinkMemory memory(const Bundle&) const override {
        return {.bytes = VoxelVotes::bytesOf(lattice_) + votes_.sidesBytes() +
                         (is_grid_ ? forecast({}, {}).bytes : 0)};
    }

  private:
    std::vector<NamedArray> arrays() const;
    void writeArrays();

    std::string path_;
    AxisBundles lattice_;
    std::string creator_;
    bool is_grid_;                    ///< whether the output is a .vdb
    std::optional<AtomicFile> grid_;  ///< file of a .vdb
    std::optional<ArrayWriter> arrays_;
    VoxelVotes votes_;
};

std::vector<NamedArray> VoxelOutput::arrays() const {
    std::vector<std::uint64_t> shape;
    for (int axis = 0; axis < 3; ++axis)
        shape.push_back(static_cast<std::uint64_t>(lattice_.cells[axis]));
    return {{"occupancy", NumberType::kUint8, shape},
            {"votes", NumberType::kUint8, shape},
            {"corner", NumberType::kDouble, {3}},
            {"spacing", NumberType::kDouble, {}}};
}

/// Returns the size of the file; for an OpenVDB file, an upper bound. OpenVDB's FloatGrid is a tree
/// of leaves (8³ floats and two masks) and of nodes with 16³ and 32³ children. The file omits empty
/// leaves and nodes, and compresses the others.
SizeForecast VoxelOutput::forecast(std::span<const Bundle>, std::span<const std::uint64_t>) const {
    if (!is_grid_) return {ArrayWriter::fileBytes(path_, arrays())};
    constexpr std::uint64_t kFileBytes = 4096;
    SizeForecast size{kFileBytes, Certainty::kAtMost};
    struct Level {
        int cells;
        std::uint64_t bytes;  ///< bytes per node
    };
    for (const auto& [cells, bytes] :
         {Level{8, sizeof(float) * 512 + 192}, Level{128, sizeof(float) * 4096 + 1088},
          Level{4096, sizeof(float) * 32768 + 8256}}) {
        std::uint64_t nodes = bytes;
        for (int axis = 0; axis < 3; ++axis)
            nodes *= static_cast<std::uint64_t>((lattice_.cells[axis] + cells - 1) / cells);
        size.bytes += nodes;
    }
    return size;
}

void VoxelOutput::begin(std::span<const Bundle> bundles, std::span<const std::uint64_t>) {
    if (bundles.size() != 3) {
        throw Error(ErrorKind::kInternal, "voxels are made of three bundles", path_);
    }
    if (is_grid_) {
        grid_.emplace(path_);
        return;
    }
    arrays_.emplace(path_, arrays());
}

void VoxelOutput::finish() {
    votes_.finish();
    if (!is_grid_) return writeArrays();
    writeVdb(*grid_, {lattice_.cells, lattice_.corner, lattice_.spacing, votes_.inside()},
             creator_);
    grid_->commit();
}

void VoxelOutput::writeArrays() {
    std::vector<std::uint8_t> plane(static_cast<std::size_t>(lattice_.cells.y) *
                                    static_cast<std::size_t>(lattice_.cells.z));
    for (int x = 0; x < lattice_.cells.x; ++x) {
        votes_.insideAt(x, plane);
        arrays_->append(0, asBytes(plane));
    }
    for (int x = 0; x < lattice_.cells.x; ++x) {
        votes_.votesAt(x, plane);
        arrays_->append(1, asBytes(plane));
    }
    const std::array<double, 3> corner{lattice_.corner.x, lattice_.corner.y, lattice_.corner.z};
    arrays_->append(2, asBytes(corner));
    arrays_->append(3, asBytes(std::span(&lattice_.spacing, 1)));
    arrays_->finish();
}

RayResults VoxelOutput::results() const {
    const std::uint64_t occupied = votes_.occupied();
    const double cell = lattice_.spacing * lattice_.spacing * lattice_.spacing;
    RayResults results;
    results.voxels = {path_,    lattice_.cells,    lattice_.spacing,
                      occupied, votes_.disputed(), static_cast<double>(occupied) * cell};
    return results;
}

}  // namespace

std::unique_ptr<RayOutput> makeVoxelOutput(std::string path, const Solids& solids,
                                           AxisBundles lattice, std::string creator,
                                           Overlap overlap) {
    return std::make_unique<VoxelOutput>(std::move(path), solids, std::move(lattice),
                                         std::move(creator), overlap);
}

}  // namespace peeler
