// SPDX-License-Identifier: Apache-2.0
// What a command may use of the machine, and what it used.
#pragma once

#include <cstdint>
#include <optional>

#include "cmd/machine/limits.h"
#include "core/base/memory_budget.h"

namespace peeler::cmd {

/// The least --memory: below it the driver and the shader compiler alone are over the budget.
inline constexpr std::uint64_t kLeastMemory = std::uint64_t{64} << 20;

/// The least of CPU affinity and processorLimits() (cmd/machine/limits.h); at least 1.
Limit allowedThreads();

/// The least of memoryLimits(), bytes; nothing if nobody limits it.
std::optional<Limit> allowedMemory();

/// What a render holds to under such a limit unless --memory says otherwise: seven eighths of it.
/// The rest is for what is charged to the process, or its job, and is not resident in it: pages of
/// its files that are still to be written, page tables, the driver's own memory, the shell around
/// it.
MemoryBudget budgetUnder(const Limit& limit);

/// budgetUnder() of allowedMemory(); no budget without a limit.
MemoryBudget inheritedBudget();

/// Sets the threads of our own loops, of Mesa's software rasteriser and of the image libraries; 0 =
/// allowedThreads(). Call before the first GL call: llvmpipe reads its variable, LP_NUM_THREADS,
/// once. One that the user has set is left alone unless `threads` says otherwise.
void setThreads(int threads);

/// Most bytes that were resident at once, so far (VmHWM); 0 if the system does not say.
std::uint64_t peakMemory();

}  // namespace peeler::cmd
