// SPDX-License-Identifier: Apache-2.0
// Decoding of all chunks of a part, as a check.
#include <OpenEXR/openexr.h>

#include <algorithm>
#include <vector>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "formats/exr/exr_classes.h"
#include "formats/exr/exr_input.h"

namespace peeler {
namespace {

/// The number of chunks that are looked up before they are decoded. Limits the memory that a header
/// can make the reader use.
constexpr std::size_t kBatch = 1024;
/// Maximum unpacked bytes of a chunk.
constexpr std::uint64_t kMaxUnpacked = std::uint64_t{1} << 30;

exr_result_t unpackChunk(exr_const_context_t context, int part, const exr_chunk_info_t& chunk) {
    exr_decode_pipeline_t pipeline{};
    exr_result_t result = exr_decoding_initialize(context, part, &chunk, &pipeline);
    // Without destinations for the channels, OpenEXRCore unpacks the pixels and discards them.
    if (result == EXR_ERR_SUCCESS)
        result = exr_decoding_choose_default_routines(context, part, &pipeline);
    if (result == EXR_ERR_SUCCESS) result = exr_decoding_run(context, part, &pipeline);
    exr_decoding_destroy(context, &pipeline);
    return result;
}

/// Calls visit(level x, level y, tile columns, tile rows) for every level of a tiled part.
template <class Visit>
exr_result_t forEachLevel(exr_const_context_t context, int part, Visit&& visit) {
    std::uint32_t width = 0, height = 0;
    exr_tile_level_mode_t mode{};
    exr_tile_round_mode_t rounding{};
    int32_t levels_x = 0, levels_y = 0;
    exr_result_t result = exr_get_tile_descriptor(context, part, &width, &height, &mode, &rounding);
    if (result == EXR_ERR_SUCCESS)
        result = exr_get_tile_levels(context, part, &levels_x, &levels_y);
    for (int y = 0; y < levels_y && result == EXR_ERR_SUCCESS; ++y) {
        for (int x = 0; x < levels_x && result == EXR_ERR_SUCCESS; ++x) {
            if (mode != EXR_TILE_RIPMAP_LEVELS && x != y) continue;
            int32_t level_width = 0, level_height = 0;
            result = exr_get_level_sizes(context, part, x, y, &level_width, &level_height);
            if (result != EXR_ERR_SUCCESS) break;
            const auto tiles = [](int32_t pixels, std::uint32_t size) {
                return static_cast<int>((static_cast<std::uint32_t>(pixels) + size - 1) / size);
            };
            visit(x, y, tiles(level_width, width), tiles(level_height, height));
        }
    }
    return result;
}

}  // namespace

/// Implements decodeAll() for a part that needs OpenEXR's classes. The classes unpack all channels
/// of a block even if only one channel has a destination.
void ExrInput::decodeDwa(std::size_t part) const {
    const ExrInputPart& info = parts_[part];
    if (info.type == "tiledimage")
        return classes_->decodeTiles(static_cast<int>(part), path_ + ": " + info.name);
    const int rows = rowsPerChunk(part);
    const std::size_t stride = static_cast<std::size_t>(info.data_window.width()) * sizeof(float);
    std::vector<std::byte> first(stride * static_cast<std::size_t>(rows));
    const ExrTarget target{info.channels.front().name, PixelType::kFloat, first.data(), stride};
    for (int y = info.data_window.y0; y < info.data_window.y1; y += rows) {
        const Window block{info.data_window.x0, y, info.data_window.x1,
                           std::min(y + rows, info.data_window.y1)};
        readChunk(part, y, block, {&target, 1});
    }
}

void ExrInput::decodeAll(std::size_t part) const {
    const ExrInputPart& info = parts_[part];
    if (info.deep()) {
        return parallelFor(deepBlocks(part), [&](std::size_t block) {
            ExrDeepBlock samples;
            readDeepBlock(part, block, false, samples);
        });
    }
    if (info.channels.empty()) return;
    if (info.compression.starts_with("dwa")) return decodeDwa(part);
    const int index = static_cast<int>(part);
    std::vector<exr_chunk_info_t> batch;
    const auto flush = [&] {
        parallelFor(batch.size(), [&](std::size_t i) {
            check(unpackChunk(context_, index, batch[i]), info.name);
        });
        batch.clear();
    };
    const auto add = [&](int result, const exr_chunk_info_t& chunk) {
        check(result, info.name);
        if (chunk.packed_size > bytes_ || chunk.unpacked_size > kMaxUnpacked ||
            (info.compression == "none" && chunk.packed_size != chunk.unpacked_size)) {
            throw Error(ErrorKind::kInput, "a chunk has an implausible size",
                        path_ + ": " + info.name);
        }
        batch.push_back(chunk);
        if (batch.size() == kBatch) flush();
    };
    if (info.type == "scanlineimage") {
        const int rows = rowsPerChunk(part);
        for (int y = info.data_window.y0; y < info.data_window.y1; y += rows) {
            exr_chunk_info_t chunk{};
            add(exr_read_scanline_chunk_info(context_, index, y + origin_y_, &chunk), chunk);
        }
    } else {
        check(forEachLevel(context_, index,
                           [&](int level_x, int level_y, int columns, int rows) {
                               for (int tile = 0; tile < columns * rows; ++tile) {
                                   exr_chunk_info_t chunk{};
                                   const int result = exr_read_tile_chunk_info(
                                       context_, index, tile % columns, tile / columns, level_x,
                                       level_y, &chunk);
                                   add(result, chunk);
                               }
                           }),
              info.name);
    }
    flush();
}

}  // namespace peeler
