// SPDX-License-Identifier: Apache-2.0
// The main function of the programs that runHelper() starts (formats/file/helper_process.h).
#pragma once

#include <cstdint>

#include "formats/file/helper_process.h"

namespace peeler {

/// Limits this process's memory to its memory at the start plus `bytes`, and its result to `bytes`.
/// Before this call, the limit is kFirstMemory plus 16 times the size of the request.
void limitMemory(std::uint64_t bytes);

/// Limits this process to `seconds` of CPU time, unless its limit is already lower.
void limitSeconds(int seconds);

/// Restricts this process to the system calls that a decoder needs, for memory and for files
/// already open; any other call kills it. Returns false if the system does not support that.
bool limitSystemCalls();

using HelperWork = void (*)(SharedFile& request, SharedFile& result);

inline constexpr std::uint64_t kFirstMemory = std::uint64_t{256} << 20;

/// The main function of a helper: limits this process to the seconds of CPU time in its only
/// argument, gives up the right to open files and start programs, does the work, and ends the
/// process.
[[noreturn]] void helperMain(int count, char** arguments, HelperWork work);

}  // namespace peeler
