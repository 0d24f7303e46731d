// SPDX-License-Identifier: Apache-2.0
// Memory that an extraction needs, by band size.
#pragma once

#include <cstdint>
#include <functional>

#include <peeler/layered_image.h>
#include <peeler/memory_budget.h>
#include "core/base/memory_budget.h"
#include "core/image/layers.h"
#include "formats/exr/layered_input.h"

namespace peeler::cmd {

/// The bytes needed for bands and for the arrays made from them.
struct BandUse {
    std::uint64_t list_bytes = 0;   ///< bytes per fragment in the fragment lists
    std::uint64_t array_bytes = 0;  ///< bytes per fragment in the array with the largest records
    MemoryUse made{};
    std::uint64_t layers = 0;  ///< number of layers that the outputs use
};

/// Returns `list_bytes` and `array_bytes` for the arrays of `band`; the other members are 0.
BandUse noUseOf(const LayeredImage& band);

/// A function that returns the memory used when bands have `rows` rows.
using BandUseOf = std::function<BandUse(int rows)>;

/// Returns the maximum bytes for reading `input` in bands of `rows` rows, in addition to the bytes
/// already resident. `counted` has the picture's fragment counts; null = not counted yet.
std::uint64_t bandMemory(const LayeredInput& input, int rows, const BandUseOf& use,
                         const DepthComplexity* counted = nullptr);

/// Returns a band size in bytes, for LayeredInput::rowsFor(). Halves `most` until bandMemory() and
/// the resident bytes fit into the budget. Throws Error (kMemory), with the bytes needed, if even
/// the fewest rows do not fit.
std::uint64_t bandBytesWithin(const MemoryBudget& budget, const LayeredInput& input,
                              std::uint64_t most, const BandUseOf& use);

}  // namespace peeler::cmd
