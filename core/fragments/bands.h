// SPDX-License-Identifier: Apache-2.0
// Division of a picture into bands of rows that fit the memory budget and the driver's buffer
// limit.
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

/// The maximum contents of a band.
struct BandLimits {
    std::uint64_t fragments = 0;
    std::uint64_t pixels = 0;
    /// Limit for a band of a single row; applies if it is higher than `fragments`.
    std::uint64_t row_fragments = 0;
};

struct BandCosts {
    /// Memory for the buffers, for the image that goes to the sink, and for the sink.
    MemoryUse use{};
    std::uint64_t band_bytes = 0;           ///< maximum bytes of a band of several rows
    std::uint64_t largest_array_bytes = 0;  ///< bytes per fragment in the largest single buffer
    std::uint64_t storage_block_bytes = 0;  ///< the driver's limit on one buffer binding
};

/// The bytes per pixel of a band: a list head, an offset in the lists, an offset in the image that
/// goes to the sink, and the pixel of the sink's composite.
inline constexpr std::uint64_t kBandPixelBytes = 3 * sizeof(std::uint32_t) + 5 * sizeof(float);

/// Returns the memory that a sink needs in addition to the band itself. `fragment`: bytes per
/// fragment; `most_fragments(rows)`: the maximum number of fragments in any `rows` successive rows.
MemoryUse sinkUse(const Sink& sink, const Plan& plan, std::uint64_t fragment,
                  const std::function<std::uint64_t(int rows)>& most_fragments);

/// Returns the limits of bands. `used` is the number of bytes of the budget that are in use
/// (usedBytes()). Throws Error (kMemory) if the remaining bytes are too few for the smallest band.
/// Only cutBands() checks that every row fits.
BandLimits bandLimits(const MemoryBudget& budget, std::uint64_t used, const BandCosts& costs);

/// Whether half of the budget is enough for the used bytes and a full band. If so, freeing buffers
/// between bands gains nothing. Always true without a budget.
bool isRoomy(const MemoryBudget& budget, std::uint64_t used, const BandCosts& costs);

/// Whether the budget leaves room for a quarter of a full band. Always true without a budget.
bool hasRoom(const MemoryBudget& budget, std::uint64_t used, const BandCosts& costs);

/// Cuts the crop's rows into as few bands as the limits allow, top to bottom. `row_fragments(y)` is
/// the number of fragments of a row. Throws Error (kMemory) if a single row exceeds a limit.
std::vector<Window> cutBands(const Window& crop, const BandLimits& limits,
                             const std::function<std::uint64_t(int y)>& row_fragments);

/// Returns the bytes of the largest of these bands, without the fixed costs.
std::uint64_t largestBandBytes(std::span<const Window> bands, const BandCosts& costs,
                               const std::function<std::uint64_t(int y)>& row_fragments);

}  // namespace peeler
