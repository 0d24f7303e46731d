// SPDX-License-Identifier: Apache-2.0
// Memory use as a function of band size, and checks against the budget.
#pragma once

#include <cstdint>
#include <string>

#include <peeler/memory_budget.h>

namespace peeler {

/// Returns a number of bytes in mebibytes, rounded up: "512M".
std::string mebibytesText(std::uint64_t bytes);

/// Bytes of memory, as a function of the band's size.
struct MemoryUse {
    std::uint64_t fixed = 0;  ///< independent of the band's size
    std::uint64_t pixel = 0;
    std::uint64_t fragment = 0;

    MemoryUse& operator+=(const MemoryUse& other);
    /// Returns the bytes of a band with this many pixels and fragments, without `fixed`.
    std::uint64_t of(std::uint64_t pixels, std::uint64_t fragments) const {
        return pixels * pixel + fragments * fragment;
    }
};

/// Throws Error (kMemory) if `needed` bytes exceed the budget. `needed` must include usedBytes().
/// The error's message ends with `purpose`, after "are needed"; the hint ends with `or_else`.
void checkMemory(const MemoryBudget& budget, std::uint64_t needed, const std::string& purpose,
                 const Text& or_else = {});

}  // namespace peeler
