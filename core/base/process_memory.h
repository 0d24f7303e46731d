// SPDX-License-Identifier: Apache-2.0
// The resident memory of this process.
#pragma once

#include <cstdint>

#include <peeler/memory_budget.h>

namespace peeler {

/// Bytes of resident memory of this process now.
std::uint64_t residentBytes();

/// What of the budget is in use: the resident memory now, less the budget's base.
std::uint64_t usedBytes(const MemoryBudget& budget);
/// Returns usedBytes() plus `more`. If that exceeds the budget, calls returnFreeMemory() first, so
/// that freed memory does not count.
std::uint64_t usedBytesWith(const MemoryBudget& budget, std::uint64_t more);

/// Hands memory that was freed back to the system, where malloc would keep it: it is not resident
/// any longer.
void returnFreeMemory();

}  // namespace peeler
