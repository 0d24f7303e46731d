// SPDX-License-Identifier: Apache-2.0
// Deep half of ExrInput.
//
// OpenEXRCore finds and reads the packed chunks. This file checks all sizes and unpacks, since the
// deep pipeline of OpenEXRCore 3.1.5 has known overflows.
#include <OpenEXR/openexr.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "formats/exr/exr_chunks.h"
#include "formats/exr/exr_input.h"

namespace peeler {
namespace {

/// The size of a part's blocks in pixels, and the number of blocks across and down.
struct Grid {
    int width = 0, height = 1, across = 1, down = 1;
};

Grid gridOf(const ExrInputPart& part) {
    const Window& window = part.data_window;
    if (part.type != "deeptile") return {window.width(), 1, 1, window.height()};
    Grid grid{part.tile_width, part.tile_height};
    grid.across = (window.width() + grid.width - 1) / grid.width;
    grid.down = (window.height() + grid.height - 1) / grid.height;
    return grid;
}

/// Converts the running sums along each row of a block to counts. Returns false if a sum is less
/// than the previous one.
bool toCounts(std::span<std::uint32_t> table, std::size_t width) {
    for (std::size_t begin = 0; begin < table.size(); begin += width) {
        std::uint32_t last = 0;
        for (std::size_t x = begin; x < begin + width; ++x) {
            const std::uint32_t sum = table[x];
            if (sum < last) return false;
            table[x] = sum - last;
            last = sum;
        }
    }
    return true;
}

/// Unpacks a block's table of sample counts. OpenEXR's writer stores a table unpacked unless
/// packing makes it smaller than the unpacked table of a whole tile. An unpacked table of a tile at
/// the edge, which has fewer pixels, also has the size of a whole tile; only its first entries are
/// valid.
bool unpackTable(const ExrInputPart& part, std::span<const std::byte> table,
                 std::span<std::byte> out) {
    const Grid grid = gridOf(part);
    const std::size_t whole = sizeof(std::uint32_t) * static_cast<std::size_t>(grid.width) *
                              static_cast<std::size_t>(grid.height);
    if (table.size() < whole && exrUnpackAlways(part.compression, table, out)) return true;
    if (table.size() != whole && table.size() != out.size()) return false;
    std::memcpy(out.data(), table.data(), out.size());
    return true;
}

}  // namespace

std::size_t ExrInput::deepBlocks(std::size_t part) const {
    const Grid grid = gridOf(parts_[part]);
    return static_cast<std::size_t>(grid.across) * static_cast<std::size_t>(grid.down);
}

Window ExrInput::deepBlockWindow(std::size_t part, std::size_t block) const {
    const Grid grid = gridOf(parts_[part]);
    const Window& all = parts_[part].data_window;
    const auto across = static_cast<std::size_t>(grid.across);
    const int x = all.x0 + static_cast<int>(block % across) * grid.width;
    const int y = all.y0 + static_cast<int>(block / across) * grid.height;
    return intersect({x, y, x + grid.width, y + grid.height}, all);
}

void ExrInput::readDeepBlock(std::size_t part, std::size_t block, bool counts_only,
                             ExrDeepBlock& out) const {
    const ExrInputPart& info = parts_[part];
    const int index = static_cast<int>(part);
    out.window = deepBlockWindow(part, block);
    exr_chunk_info_t chunk{};
    if (info.type == "deeptile") {
        const auto across = static_cast<std::size_t>(gridOf(info).across);
        check(exr_read_tile_chunk_info(context_, index, static_cast<int>(block % across),
                                       static_cast<int>(block / across), 0, 0, &chunk),
              info.name);
    } else {
        check(exr_read_scanline_chunk_info(context_, index, out.window.y0 + origin_y_, &chunk),
              info.name);
    }

    const std::uint64_t table_bytes = out.window.pixels() * sizeof(std::uint32_t);
    std::uint64_t sample_bytes = 0;
    for (const ExrInputChannel& channel : info.channels)
        sample_bytes += pixelTypeSize(channel.type);
    if (chunk.sample_count_table_size > bytes_ || chunk.packed_size > bytes_ ||
        table_bytes > exrMostUnpacked(info.compression, chunk.sample_count_table_size) ||
        chunk.unpacked_size > exrMostUnpacked(info.compression, chunk.packed_size)) {
        refuse("a chunk has an implausible size", info);
    }
    // OpenEXRCore reads no samples if their pointer is null.
    const std::size_t packed_size = counts_only ? 0 : chunk.packed_size;
    const auto packed = std::make_unique_for_overwrite<std::byte[]>(packed_size);
    const auto table = std::make_unique_for_overwrite<std::byte[]>(chunk.sample_count_table_size);
    check(exr_read_deep_chunk(context_, index, &chunk, packed_size > 0 ? packed.get() : nullptr,
                              table.get()),
          info.name);

    out.counts.resize(out.window.pixels());
    if (!unpackTable(info, {table.get(), chunk.sample_count_table_size},
                     std::as_writable_bytes(std::span(out.counts))) ||
        !toCounts(out.counts, static_cast<std::size_t>(out.window.width()))) {
        refuse("the sample counts of a chunk are damaged", info);
    }
    std::uint64_t samples = 0;
    for (const std::uint32_t count : out.counts)
        samples += count;
    if (samples * sample_bytes != chunk.unpacked_size)
        refuse("the sample counts of a chunk do not fit its size", info);
    out.samples.clear();
    if (counts_only) return;
    out.samples.resize(chunk.unpacked_size);
    if (!exrUnpack(info.compression, {packed.get(), packed_size}, out.samples))
        refuse("the samples of a chunk are damaged", info);
}

}  // namespace peeler
