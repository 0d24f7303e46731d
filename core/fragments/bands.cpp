// SPDX-License-Identifier: Apache-2.0
#include "core/fragments/bands.h"

#include <algorithm>
#include <limits>
#include <string>

#include <peeler/error.h>

namespace peeler {
namespace {

// The memory of a budget that is reserved for uses without an estimate: the writers' chunks and the
// driver's command buffers.
constexpr std::uint64_t kMegabyte = 1ULL << 20;
constexpr std::uint64_t kReserve = 96 * kMegabyte;
constexpr std::uint64_t kLeastBand = 8 * kMegabyte;

}  // namespace

MemoryUse sinkUse(const Sink& sink, const Plan& plan, std::uint64_t fragment,
                  const std::function<std::uint64_t(int rows)>& most_fragments) {
    const SinkMemory memory = sink.memory(plan);
    const std::uint64_t pixels = static_cast<std::uint64_t>(memory.rows) *
                                 static_cast<std::uint64_t>(plan.view.crop.width());
    const std::uint64_t rows =
        most_fragments(memory.rows) * fragment + pixels * (kBandPixelBytes + memory.pixel_bytes);
    const auto kept = static_cast<std::uint64_t>(memory.bands);
    // The factor 2: a sink may hold rows of the previous band and of this one.
    return {.fixed = 2 * rows + memory.bytes,
            .pixel = memory.pixel_bytes + kept * sizeof(std::uint32_t),
            .fragment = memory.fragment_bytes + kept * fragment};
}

bool isRoomy(const MemoryBudget& budget, std::uint64_t used, const BandCosts& costs) {
    if (budget == 0) return true;
    return budget / 2 >= used + costs.use.fixed + kReserve + costs.band_bytes;
}

bool hasRoom(const MemoryBudget& budget, std::uint64_t used, const BandCosts& costs) {
    if (budget == 0) return true;
    return budget >= used + costs.use.fixed + kReserve + costs.band_bytes / 4;
}

BandLimits bandLimits(const MemoryBudget& budget, std::uint64_t used, const BandCosts& costs) {
    std::uint64_t available = costs.band_bytes, hard = std::numeric_limits<std::uint64_t>::max();
    if (budget != 0) {
        const std::uint64_t taken = used + costs.use.fixed + kReserve;
        checkMemory(budget, taken + kLeastBand, "for the smallest bands");
        hard = budget - taken;
        available = std::min(available, hard);
    }
    BandLimits limits;
    // A quarter of the memory is for the costs per pixel, the rest for the costs per fragment.
    limits.pixels = std::min(available / 4 / costs.use.pixel,
                             costs.storage_block_bytes / sizeof(std::uint32_t));
    const std::uint64_t driver = costs.storage_block_bytes / costs.largest_array_bytes;
    limits.fragments = std::min(available * 3 / 4 / costs.use.fragment, driver);
    limits.row_fragments = std::min(hard / 4 * 3 / costs.use.fragment, driver);
    return limits;
}

std::vector<Window> cutBands(const Window& crop, const BandLimits& limits,
                             const std::function<std::uint64_t(int y)>& row_fragments) {
    const auto width = static_cast<std::uint64_t>(crop.width());
    std::vector<Window> bands;
    std::uint64_t fragments = 0;
    for (int y = crop.y0; y < crop.y1; ++y) {
        const std::uint64_t row = row_fragments(y);
        if (row > std::max(limits.fragments, limits.row_fragments) || width > limits.pixels) {
            throw Error(
                ErrorKind::kMemory,
                "one row of " + std::to_string(width) + " pixels with " + std::to_string(row) +
                    " fragments does not fit the memory budget or the driver's buffers",
                "row " + std::to_string(y),
                "raise " + Parameter::kMemory + ", or render parts with " + Parameter::kCrop);
        }
        const auto rows = bands.empty() ? 0 : static_cast<std::uint64_t>(bands.back().height());
        if (bands.empty() || fragments + row > limits.fragments ||
            (rows + 1) * width > limits.pixels) {
            bands.push_back({crop.x0, y, crop.x1, y});
            fragments = 0;
        }
        bands.back().y1 = y + 1;
        fragments += row;
    }
    return bands;
}

std::uint64_t largestBandBytes(std::span<const Window> bands, const BandCosts& costs,
                               const std::function<std::uint64_t(int y)>& row_fragments) {
    std::uint64_t most = 0;
    for (const Window& band : bands) {
        std::uint64_t fragments = 0;
        for (int y = band.y0; y < band.y1; ++y)
            fragments += row_fragments(y);
        most = std::max(most, costs.use.of(band.pixels(), fragments));
    }
    return most;
}

}  // namespace peeler
