// SPDX-License-Identifier: Apache-2.0
// The processors, threads and memory that a command may use, and the memory that it used.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <peeler/memory_budget.h>
#include "cmd/machine/limits.h"

namespace peeler::cmd {

/// The least --memory, in bytes: below it the driver and the shader compiler alone are over the
/// budget.
inline constexpr std::uint64_t kLeastMemory = std::uint64_t{64} << 20;

/// The least of CPU affinity and processorLimits(); at least 1.
Limit allowedThreads();

/// The least of memoryLimits(), bytes; nothing if nobody limits it.
std::optional<Limit> allowedMemory();

/// What a render holds to under a limit of memory unless --memory says otherwise: seven eighths of
/// it. The rest is for what is charged to the process, or its job, and is not resident in it: pages
/// of its files that are still to be written, page tables, the driver's own memory, the shell
/// around it.
MemoryBudget budgetUnder(const Limit& limit);

/// budgetUnder() of allowedMemory(); no budget without a limit.
MemoryBudget inheritedBudget();

/// Sets the threads of our own loops, of Mesa's software rasteriser and of the image libraries; 0 =
/// allowedThreads(); fewer where the machine lets fewer be started. Call before the first GL call:
/// llvmpipe reads its variable, LP_NUM_THREADS, once. One that the user has set is left alone
/// unless `threads` says otherwise.
void setThreads(int threads);

/// Takes CUDA_VISIBLE_DEVICES out of the environment, if it is there, and hands it to
/// gl::setCudaVisibleDevices(). For commands that use GL, before any driver is loaded; one that
/// starts others leaves it to them.
void takeVisibleGpus();

/// The most bytes that have been resident at once so far (VmHWM); 0 if the system does not say.
std::uint64_t peakMemory();

}  // namespace peeler::cmd
