// SPDX-License-Identifier: Apache-2.0
// What an extract takes of memory, by how its picture is cut into bands.
#pragma once

#include <cstdint>
#include <functional>

#include <peeler/layered_image.h>
#include <peeler/memory_budget.h>
#include "core/base/memory_budget.h"
#include "core/image/layers.h"
#include "formats/exr/layered_input.h"

namespace peeler::cmd {

/// What the bands of a picture and what is made of them take, in bytes.
struct BandUse {
    std::uint64_t list_bytes = 0;   ///< of a fragment in the lists
    std::uint64_t array_bytes = 0;  ///< of a fragment in the widest of these
    MemoryUse made{};
    std::uint64_t layers = 0;  ///< that something is made of
};

/// A use of bands like this one that makes nothing.
BandUse noUseOf(const LayeredImage& band);

/// What is made of bands of so many rows.
using BandUseOf = std::function<BandUse(int rows)>;

/// How many bytes reading `input` in bands of so many rows takes at most, besides what is resident
/// before. `counted`: the fragments of the picture, null if nobody has counted them.
std::uint64_t bandMemory(const LayeredInput& input, int rows, const BandUseOf& use,
                         const DepthComplexity* counted = nullptr);

/// As many bytes for LayeredInput::rowsFor(), up to `most`, as leave bandMemory() and what is
/// resident within the budget. Throws Error (kMemory), with what is needed, if even the fewest rows
/// do not.
std::uint64_t bandBytesWithin(const MemoryBudget& budget, const LayeredInput& input,
                              std::uint64_t most, const BandUseOf& use);

}  // namespace peeler::cmd
