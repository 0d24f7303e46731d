// SPDX-License-Identifier: Apache-2.0
// What a command may use of the machine, and what it used.
#pragma once

#include <cstdint>

namespace peeler::cmd {

/// The least --memory: below it the driver and the shader compiler alone are over the budget.
inline constexpr std::uint64_t kLeastMemory = std::uint64_t{64} << 20;

/// Sets the threads of our own loops and of Mesa's software rasteriser; 0 = as many as the process
/// may run on. Call before the first GL call: llvmpipe reads its variable once. One that the user
/// has set is left alone unless `threads` says otherwise.
void setThreads(int threads);

/// Most bytes that were resident at once, so far (VmHWM); 0 if the system does not say.
std::uint64_t peakMemory();

}  // namespace peeler::cmd
