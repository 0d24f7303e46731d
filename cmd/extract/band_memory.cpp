// SPDX-License-Identifier: Apache-2.0
#include "cmd/extract/band_memory.h"

#include <algorithm>
#include <string>

#include "core/base/memory_budget.h"
#include "core/base/process_memory.h"

namespace peeler::cmd {

namespace {

// Bytes for code and tables first touched while bands are read and written.
constexpr std::uint64_t kExtractingBytes = std::uint64_t{4} << 20;

}  // namespace

BandUse noUseOf(const LayeredImage& band) {
    BandUse use{.list_bytes = sizeof(float), .array_bytes = sizeof(float)};
    const auto add = [&](const FragmentArray& array) {
        use.list_bytes += array.stride();
        use.array_bytes = std::max<std::uint64_t>(use.array_bytes, array.stride());
    };
    add(band.color);
    for (const FragmentArray& array : band.extra)
        add(array);
    return use;
}

std::uint64_t bandMemory(const LayeredInput& input, int rows, const BandUseOf& use,
                         const DepthComplexity* counted) {
    const Window& crop = input.info().plan.view.crop;
    const BandUse of_band = use(rows);
    const BandRead read = input.mostOf(rows);
    const std::uint64_t fragments =
        counted ? std::min(read.fragments, counted->mostFragments(rows)) : read.fragments;
    const auto pixels = static_cast<std::uint64_t>(crop.width()) *
                        static_cast<std::uint64_t>(std::min(rows, crop.height()));
    // Growing arrays leave holes in the heap. The other arrays fill these holes, so only the
    // largest array counts twice.
    const std::uint64_t lists =
        fragments * (of_band.list_bytes + of_band.array_bytes) + pixels * sizeof(std::uint32_t);
    const std::uint64_t chosen = std::min(fragments, pixels * of_band.layers);
    const std::uint64_t made = of_band.made.of(pixels, chosen);
    // While the next band is read, the arrays made from the previous one are still in memory.
    const bool alone = rows >= crop.height();
    return kExtractingBytes + of_band.made.fixed + lists +
           (alone ? std::max(read.bytes, made) : read.bytes + made);
}

std::uint64_t bandBytesWithin(const MemoryBudget& budget, const LayeredInput& input,
                              std::uint64_t most, const BandUseOf& use) {
    if (budget == 0) return most;
    const int fewest = input.rowsFor(0);
    for (std::uint64_t bytes = most;; bytes /= 2) {
        const int rows = input.rowsFor(bytes);
        const std::uint64_t needed = usedBytes(budget) + bandMemory(input, rows, use);
        if (needed <= budget) return bytes;
        if (rows > fewest) continue;
        checkMemory(budget, needed, "for " + std::to_string(rows) + " rows of the picture");
    }
}

}  // namespace peeler::cmd
