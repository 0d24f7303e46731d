// SPDX-License-Identifier: Apache-2.0
// The resident memory of this process.
#pragma once

#include <cstdint>

#include <peeler/memory_budget.h>

namespace peeler {

/// Returns the current resident memory of this process in bytes.
std::uint64_t residentBytes();

/// Returns the part of the budget in use: the current resident memory minus the budget's base.
std::uint64_t usedBytes(const MemoryBudget& budget);
/// Returns usedBytes() plus `more`. If the sum exceeds the budget, calls returnFreeMemory() and
/// adds again, so that freed memory does not count.
std::uint64_t usedBytesWith(const MemoryBudget& budget, std::uint64_t more);

/// Returns to the system the freed memory that malloc keeps, so that it is no longer resident.
void returnFreeMemory();

}  // namespace peeler
