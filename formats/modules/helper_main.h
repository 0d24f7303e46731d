// SPDX-License-Identifier: Apache-2.0
// The main function of programs started by runHelper() (formats/file/helper_process.h).
#pragma once

#include <cstdint>

#include "formats/file/helper_process.h"

namespace peeler {

/// Limits this process's memory to its usage at the start plus `bytes`, and its result to `bytes`.
/// Before this call the limit is kFirstMemory plus 16 times the request's size.
void limitMemory(std::uint64_t bytes);

/// Limits this process to `seconds` of CPU time, unless a lower limit exists.
void limitSeconds(int seconds);

/// Restricts this process to the system calls that a decoder needs, for memory and open files; any
/// other call kills it. Returns false if the system has no such filter.
bool limitSystemCalls();

using HelperWork = void (*)(SharedFile& request, SharedFile& result);

inline constexpr std::uint64_t kFirstMemory = std::uint64_t{256} << 20;

/// Limits this process to the seconds of CPU time in its only argument, drops its right to open or
/// start anything, and does the work. Ends the process.
[[noreturn]] void helperMain(int count, char** arguments, HelperWork work);

}  // namespace peeler
