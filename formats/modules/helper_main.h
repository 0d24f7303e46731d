// SPDX-License-Identifier: Apache-2.0
// The main function of programs that runHelper() (formats/file/helper_process.h) starts.
#pragma once

#include <cstdint>

#include "formats/file/helper_process.h"

namespace peeler {

/// Limits the memory of this process to what it had at its start and so many bytes more, and its
/// result to as many. Until then the limit is kFirstMemory and 16 times the request.
void limitMemory(std::uint64_t bytes);

/// Limits this process to so many seconds of processor time, if there is no lower limit.
void limitSeconds(int seconds);

/// Allows this process no other calls of the system than a decoder needs, which uses memory and the
/// files that are open: any other ends it. False where the system has no such limit.
bool limitSystemCalls();

using HelperWork = void (*)(SharedFile& request, SharedFile& result);

inline constexpr std::uint64_t kFirstMemory = std::uint64_t{256} << 20;

/// Limits this process to the seconds of processor time that the only argument says, takes it the
/// right to open or start anything, and has the work done. Ends the process.
[[noreturn]] void helperMain(int count, char** arguments, HelperWork work);

}  // namespace peeler
