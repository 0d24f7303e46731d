// SPDX-License-Identifier: Apache-2.0
// The state of a file, to detect changes.
#pragma once

#include <cstdint>
#include <filesystem>

namespace peeler::cmd {

struct FileState {
    std::filesystem::path path;
    bool exists = false;
    std::uint64_t device = 0, inode = 0, size = 0;
    std::int64_t modified = 0;  ///< mtime in nanoseconds
    std::int64_t changed = 0;   ///< ctime in nanoseconds; programs cannot set it

    bool operator==(const FileState&) const = default;
};

FileState fileState(const std::filesystem::path& path);

}  // namespace peeler::cmd
