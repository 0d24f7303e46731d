// SPDX-License-Identifier: Apache-2.0
// The resident memory of this process.
#pragma once

#include <cstdint>

#include <peeler/memory_budget.h>

namespace peeler {

/// Returns the current resident memory of this process in bytes.
std::uint64_t residentBytes();

/// Returns the used part of the budget: the current resident memory minus the budget's base.
std::uint64_t usedBytes(const MemoryBudget& budget);
/// Returns usedBytes() plus `more`. If the sum exceeds the budget, calls returnFreeMemory() and
/// measures again, so that freed memory does not count.
std::uint64_t usedBytesWith(const MemoryBudget& budget, std::uint64_t more);

/// Returns freed memory from malloc to the system, so that it is no longer resident.
void returnFreeMemory();

}  // namespace peeler
