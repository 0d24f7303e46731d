// SPDX-License-Identifier: Apache-2.0
// Memory use of an extract, by band size.
#pragma once

#include <cstdint>
#include <functional>

#include <peeler/layered_image.h>
#include <peeler/memory_budget.h>
#include "core/base/memory_budget.h"
#include "core/image/layers.h"
#include "formats/exr/layered_input.h"

namespace peeler::cmd {

/// Bytes used by bands and the arrays made from them.
struct BandUse {
    std::uint64_t list_bytes = 0;   ///< per fragment in the lists
    std::uint64_t array_bytes = 0;  ///< per fragment in the widest array
    MemoryUse made{};
    std::uint64_t layers = 0;  ///< layers used
};

/// Returns the use of bands like this one if nothing is made from them.
BandUse noUseOf(const LayeredImage& band);

/// The memory use for bands of `rows` rows.
using BandUseOf = std::function<BandUse(int rows)>;

/// Returns the maximum bytes for reading `input` in bands of `rows` rows, besides those already
/// resident. `counted`: the picture's fragments, null if they have not been counted.
std::uint64_t bandMemory(const LayeredInput& input, int rows, const BandUseOf& use,
                         const DepthComplexity* counted = nullptr);

/// Returns the largest argument for LayeredInput::rowsFor(), up to `most`, that keeps bandMemory()
/// and resident bytes within the budget. Throws Error (kMemory), with the bytes needed, if even the
/// fewest rows exceed it.
std::uint64_t bandBytesWithin(const MemoryBudget& budget, const LayeredInput& input,
                              std::uint64_t most, const BandUseOf& use);

}  // namespace peeler::cmd
