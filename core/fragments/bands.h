// SPDX-License-Identifier: Apache-2.0
// Cutting a picture into bands of rows that fit the memory budget and the driver's buffer limit.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <peeler/memory_budget.h>
#include <peeler/sink.h>
#include <peeler/window.h>
#include "core/base/memory_budget.h"

namespace peeler {

/// What a band may hold at most.
struct BandLimits {
    std::uint64_t fragments = 0;
    std::uint64_t pixels = 0;
    std::uint64_t row_fragments = 0;  ///< of a band of one row, if it may hold more than others
};

/// What one band costs.
struct BandCosts {
    MemoryUse use{};                        ///< in the buffers, in the hand-over and in the sink
    std::uint64_t band_bytes = 0;           ///< most bytes to spend on a band of several rows
    std::uint64_t largest_array_bytes = 0;  ///< bytes a fragment in the largest single buffer
    std::uint64_t storage_block_bytes = 0;  ///< the driver's limit of one buffer binding
};

/// Bytes of a pixel of a band: a list head, an offset here and in the hand-over, and what a sink
/// composites into.
inline constexpr std::uint64_t kBandPixelBytes = 3 * sizeof(std::uint32_t) + 5 * sizeof(float);

/// Returns the memory that a sink takes besides the band that it is given. `fragment`: bytes of a
/// fragment; `most_fragments(rows)`: the most fragments of any `rows` successive rows.
MemoryUse sinkUse(const Sink& sink, const Plan& plan, std::uint64_t fragment,
                  const std::function<std::uint64_t(int rows)>& most_fragments);

/// Limits under a budget of which `used` bytes are in use already (usedBytes()).
/// Throws Error (kMemory) if next to nothing is left; a limit may still come out too small for a
/// row: cutBands says so.
BandLimits bandLimits(const MemoryBudget& budget, std::uint64_t used, const BandCosts& costs);

/// Whether a budget leaves at least as much again as is used and as a full band takes: nothing
/// is gained by giving buffers back between bands then. Always without one.
bool isRoomy(const MemoryBudget& budget, std::uint64_t used, const BandCosts& costs);

/// Whether a budget leaves a quarter of a full band besides what is taken. Always without one.
bool hasRoom(const MemoryBudget& budget, std::uint64_t used, const BandCosts& costs);

/// Cuts the crop's rows into bands, top to bottom, as few as the limits allow. `row_fragments(y)`
/// is the number of fragments of a row. Throws Error (kMemory) if one row alone is over a limit.
std::vector<Window> cutBands(const Window& crop, const BandLimits& limits,
                             const std::function<std::uint64_t(int y)>& row_fragments);

/// What the largest of some bands takes at those costs, besides what is fixed.
std::uint64_t largestBandBytes(std::span<const Window> bands, const BandCosts& costs,
                               const std::function<std::uint64_t(int y)>& row_fragments);

}  // namespace peeler
