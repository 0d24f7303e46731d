// SPDX-License-Identifier: Apache-2.0
// Reads the bytes of a regular file at once, up to a limit: for input that is not trusted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace peeler {

/// The bytes of a regular file (through symbolic links). Throws Error(kInput) with the path as
/// `where` if there is none, it is something else (a folder, a pipe, a device), it is larger than
/// `max_bytes`, or it cannot be read.
std::vector<std::uint8_t> readRegularFile(const std::filesystem::path& path,
                                          std::uint64_t max_bytes);

/// Throws the Error (kInput) that readRegularFile() throws for a file or folder that cannot be
/// opened; `error` is a value of errno.
[[noreturn]] void failToOpen(const std::filesystem::path& path, int error);

}  // namespace peeler
