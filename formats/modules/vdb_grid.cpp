// SPDX-License-Identifier: Apache-2.0
// The module peeler_vdb: implements formats/arrays/vdb_writer.h with OpenVDB.
// https://www.openvdb.org/documentation/doxygen/
#include "formats/arrays/vdb_writer.h"

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <tbb/task_arena.h>

#include <ostream>
#include <string>

namespace peeler {
namespace {

using Grid = openvdb::FloatGrid;
using openvdb::Coord;

/// Calls visit(coordinates) for every inside cell of a block.
template <class Visit>
void forEachInside(const VdbVoxels& voxels, const glm::ivec3& begin, const glm::ivec3& end,
                   Visit&& visit) {
    const std::size_t words = (static_cast<std::size_t>(voxels.cells.z) + 63) / 64;
    for (int x = begin.x; x < end.x; ++x) {
        for (int y = begin.y; y < end.y; ++y) {
            const std::size_t line = (static_cast<std::size_t>(x) * std::size_t(voxels.cells.y) +
                                      static_cast<std::size_t>(y)) *
                                     words;
            for (int z = begin.z; z < end.z; ++z)
                if (voxels.inside[line + static_cast<std::size_t>(z) / 64] >> z % 64 & 1)
                    visit(Coord(x, y, z));
        }
    }
}

/// Fills the grid in blocks of the size of OpenVDB's leaves. Full blocks become tiles, so that the
/// interior takes no memory.
void fill(Grid& grid, const VdbVoxels& voxels) {
    constexpr int kSide = Grid::TreeType::LeafNodeType::DIM;
    Grid::Accessor accessor = grid.getAccessor();
    for (int x = 0; x < voxels.cells.x; x += kSide) {
        for (int y = 0; y < voxels.cells.y; y += kSide) {
            for (int z = 0; z < voxels.cells.z; z += kSide) {
                const glm::ivec3 begin(x, y, z), end = glm::min(begin + kSide, voxels.cells);
                int inside = 0;
                forEachInside(voxels, begin, end, [&](const Coord&) { ++inside; });
                if (inside == kSide * kSide * kSide) {
                    accessor.addTile(1, Coord(x, y, z), 1.0F, true);
                } else if (inside > 0) {
                    forEachInside(voxels, begin, end,
                                  [&](const Coord& cell) { accessor.setValueOn(cell, 1.0F); });
                }
            }
        }
    }
    grid.tree().prune();
}

void write(std::ostream& stream, const VdbVoxels& voxels, const std::string& creator) {
    openvdb::initialize();
    const Grid::Ptr grid = Grid::create(0.0F);
    grid->setName("density");
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    const glm::dvec3 first = voxels.corner + 0.5 * voxels.spacing;
    const auto transform = openvdb::math::Transform::createLinearTransform(voxels.spacing);
    transform->postTranslate({first.x, first.y, first.z});
    grid->setTransform(transform);
    fill(*grid, voxels);

    const openvdb::io::Stream archive(stream);  // compresses with Blosc if available
    openvdb::MetaMap metadata;
    metadata.insertMeta("creator", openvdb::StringMetadata(creator));
    archive.write(openvdb::GridCPtrVec{grid}, metadata);
    stream.flush();
}

}  // namespace
}  // namespace peeler

extern "C" __attribute__((visibility("default"))) void peelerWriteVdbGrid(
    std::ostream& stream, const peeler::VdbVoxels& voxels, const std::string& creator,
    int threads) {
    // tbb::global_control would also limit other work of a host program.
    tbb::task_arena(threads).execute([&] { peeler::write(stream, voxels, creator); });
}
