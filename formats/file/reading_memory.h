// SPDX-License-Identifier: Apache-2.0
// The budget of memory while input is read: what would go over it is refused before it is made.
#pragma once

#include <cstdint>
#include <string>

#include "core/base/memory_budget.h"

namespace peeler {

/// Throws Error (kMemory) if `needed` bytes, of all that the process holds, are over the budget.
/// `where` is what needs them.
void checkReadingMemory(const MemoryBudget& budget, std::uint64_t needed, const std::string& where);

}  // namespace peeler
