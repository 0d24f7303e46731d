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
/// The same and so many bytes more. If that is over the budget, what has been freed and not handed
/// back to the system is, so that it does not count.
std::uint64_t usedBytesWith(const MemoryBudget& budget, std::uint64_t more);

/// Hands memory that was freed back to the system, where malloc would keep it: it is not resident
/// any longer.
void returnFreeMemory();

}  // namespace peeler
