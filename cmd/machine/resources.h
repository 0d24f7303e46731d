// SPDX-License-Identifier: Apache-2.0
// Resource limits and usage: threads and memory.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <peeler/memory_budget.h>
#include "cmd/machine/limits.h"

namespace peeler::cmd {

/// The minimum of --memory, in bytes: the driver and the shader compiler alone need more than any
/// smaller budget.
inline constexpr std::uint64_t kLeastMemory = std::uint64_t{64} << 20;

/// Returns the minimum of CPU affinity and processorLimits(), at least 1.
Limit allowedThreads();

/// Returns the minimum of memoryLimits(), in bytes; nothing if there is no limit.
std::optional<Limit> allowedMemory();

/// Returns the default budget of a render under a memory limit: seven eighths of it. The rest is
/// for memory charged to the process or its job but not resident in it: dirty file pages, page
/// tables, the driver's own memory, the parent shell.
MemoryBudget budgetUnder(const Limit& limit);

/// Returns budgetUnder() of allowedMemory(); no budget without a limit.
MemoryBudget inheritedBudget();

/// Sets the number of threads for peeler's loops, Mesa's software rasteriser and the image
/// libraries; 0 = allowedThreads(). Uses fewer if the system refuses to start that many. Call
/// before the first GL call, because llvmpipe reads LP_NUM_THREADS once. Keeps a user-set
/// LP_NUM_THREADS unless `threads` is given.
void setThreads(int threads);

/// Moves CUDA_VISIBLE_DEVICES, if set, from the environment to gl::setCudaVisibleDevices(). For
/// commands that use GL, before any driver is loaded. A command that starts child processes leaves
/// it to them.
void takeVisibleGpus();

/// Returns the peak resident bytes so far (VmHWM); 0 if unknown.
std::uint64_t peakMemory();

}  // namespace peeler::cmd
