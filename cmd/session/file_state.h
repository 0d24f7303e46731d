// SPDX-License-Identifier: Apache-2.0
// The state of a file, by which a later look tells whether it has changed.
#pragma once

#include <cstdint>
#include <filesystem>

namespace peeler::cmd {

/// What the system says of a file without reading it.
struct FileState {
    std::filesystem::path path;
    bool exists = false;
    std::uint64_t device = 0, inode = 0, size = 0;
    std::int64_t modified = 0;  ///< nanoseconds of mtime
    std::int64_t changed = 0;   ///< nanoseconds of ctime, which nobody can set

    bool operator==(const FileState&) const = default;
};

/// The state of a file or folder now.
FileState fileState(const std::filesystem::path& path);

}  // namespace peeler::cmd
