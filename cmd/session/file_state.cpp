// SPDX-License-Identifier: Apache-2.0
#include "cmd/session/file_state.h"

#include <sys/stat.h>

namespace peeler::cmd {

FileState fileState(const std::filesystem::path& path) {
    FileState state{.path = path};
    struct stat found {};
    if (stat(path.c_str(), &found) != 0) return state;
    constexpr std::int64_t kNanoseconds = 1'000'000'000;
    state.exists = true;
    state.device = found.st_dev;
    state.inode = found.st_ino;
    state.size = static_cast<std::uint64_t>(found.st_size);
    state.modified = found.st_mtim.tv_sec * kNanoseconds + found.st_mtim.tv_nsec;
    state.changed = found.st_ctim.tv_sec * kNanoseconds + found.st_ctim.tv_nsec;
    return state;
}

}  // namespace peeler::cmd
