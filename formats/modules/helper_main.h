// SPDX-License-Identifier: Apache-2.0
// The main function of programs that runHelper() (formats/file/helper_process.h) starts.
#pragma once

#include <cstdint>

#include "formats/file/helper_process.h"

namespace peeler {

/// Limits the memory of this process to what it has now and so many bytes more, and its result to
/// as many. Until then there is no limit.
void limitMemory(std::uint64_t bytes);

using HelperWork = void (*)(SharedFile& request, SharedFile& result);

/// Limits this process to the seconds of processor time that the only argument says, takes it the
/// right to open anything, and has the work done. Ends the process.
[[noreturn]] void helperMain(int count, char** arguments, HelperWork work);

}  // namespace peeler
