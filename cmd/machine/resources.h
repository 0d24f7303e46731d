// SPDX-License-Identifier: Apache-2.0
// Resource limits and usage: threads and memory.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <peeler/memory_budget.h>
#include "cmd/machine/limits.h"

namespace peeler::cmd {

/// The smallest accepted --memory, in bytes. A smaller budget would have no room even for the
/// driver and the shader compiler.
inline constexpr std::uint64_t kLeastMemory = std::uint64_t{64} << 20;

/// Returns the smallest of CPU affinity and processorLimits(), at least 1.
Limit allowedThreads();

/// Returns the smallest of memoryLimits(), in bytes, or nothing if there is no limit.
std::optional<Limit> allowedMemory();

/// Returns the default budget of a render under a memory limit: seven eighths of the limit. The
/// rest is for memory that counts towards the limit but is not resident in the process: dirty file
/// pages, page tables, the driver's own memory, the parent shell.
MemoryBudget budgetUnder(const Limit& limit);

/// Returns budgetUnder() for allowedMemory(); no budget if there is no limit.
MemoryBudget inheritedBudget();

/// Sets the number of threads for peeler's loops, Mesa's software rasteriser and the image
/// libraries; 0 = allowedThreads(). Uses fewer threads if the system refuses to start that many.
/// Must be called before the first GL call, because llvmpipe reads LP_NUM_THREADS only once. An
/// LP_NUM_THREADS set by the user is kept if `threads` is 0.
void setThreads(int threads);

/// Moves CUDA_VISIBLE_DEVICES, if set, from the environment to gl::setCudaVisibleDevices().
/// Commands that use GL call this before any driver is loaded. Commands that start child processes
/// do not, so that their children inherit the variable.
void takeVisibleGpus();

/// Returns the process's peak resident bytes so far (VmHWM), or 0 if the peak is unknown.
std::uint64_t peakMemory();

}  // namespace peeler::cmd
