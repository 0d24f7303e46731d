// SPDX-License-Identifier: Apache-2.0
#include "formats/file/temporary_files.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <climits>
#include <cstring>
#include <ctime>
#include <mutex>
#include <set>
#include <system_error>
#include <utility>

#include <peeler/error.h>
#include "formats/file/regular_file.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;

/// A path that removeTemporaryFiles() removes. The storage is fixed, because a signal handler may
/// not allocate.
struct Slot {
    enum State : int { kFree, kChanging, kLiveFile, kLiveFolder };
    std::atomic<int> state{kFree};
    char path[PATH_MAX]{};
};
static_assert(std::atomic<int>::is_always_lock_free);
constexpr std::size_t kSlots = 1024;       // enough for a file per layer
constinit std::array<Slot, kSlots> slots;  // 4 MiB of address space, committed page by page on use

constexpr std::string_view kMark = ".peeler-", kTemporary = ".tmp", kScratchBase = "samples";

/// Returns this machine's name, with underscores in place of characters other than letters and
/// digits.
const std::string& hostName() {
    static const std::string name = [] {
        char text[65] = {};
        gethostname(text, sizeof text - 1);
        std::string host = text;
        for (char& c : host)
            if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
        return host.empty() ? std::string("unknown") : host;
    }();
    return name;
}

/// Whether a hidden file or folder is a leftover of an ended process, which holds no lock. Locks of
/// other machines may be invisible here, so their files must also be at least a day old.
bool isLeftover(int descriptor, std::string_view name) {
    if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) return false;
    if (name.find(std::string(kMark) + hostName() + '-') != std::string_view::npos) return true;
    constexpr std::time_t kDay = std::time_t{24} * 60 * 60;
    struct stat status {};
    return fstat(descriptor, &status) == 0 && status.st_mtime < std::time(nullptr) - kDay;
}

/// Removes the files in an open folder. Async-signal-safe, unlike opendir().
void emptyFolder(int folder) noexcept {
    // A buffer for getdents64(2). Its linux_dirent64 has the layout of glibc's dirent64.
    alignas(dirent64) char entries[4096];
    for (long size = 0; (size = syscall(SYS_getdents64, folder, entries, sizeof entries)) > 0;) {
        for (long at = 0; at < size;) {
            const auto* entry = reinterpret_cast<const dirent64*>(entries + at);
            unlinkat(folder, entry->d_name, 0);  // fails for "." and "..", which are folders
            at += entry->d_reclen;
        }
    }
}

/// Removes a folder and the files in it; async-signal-safe.
void removeFolder(const char* path) noexcept {
    const int folder = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
    if (folder < 0) return;
    emptyFolder(folder);
    close(folder);
    rmdir(path);
}

[[noreturn]] void failScratch(const fs::path& path, int error) {
    throw Error(ErrorKind::kOutput,
                "cannot make a scratch folder: " + std::generic_category().message(error),
                path.string(),
                "check the permissions of the folder, and the free space on its disk");
}

}  // namespace

std::string hiddenName(std::string_view base) {
    static std::atomic<unsigned> counter{0};
    // At most 150 characters of `base`, to keep the name below the usual limit of 255 bytes.
    std::string name = ".";
    name.append(base.substr(0, 150)).append(kMark).append(hostName());
    name += '-' + std::to_string(getpid()) + '-' + std::to_string(counter++);
    return name.append(kTemporary);
}

void removeLeftovers(const std::string& folder) {
    static std::mutex mutex;
    static std::set<std::string> seen;
    {
        const std::lock_guard lock(mutex);
        if (!seen.insert(folder).second) return;
    }
    std::error_code failure;
    for (fs::directory_iterator entry(folder, failure), end; !failure && entry != end;
         entry.increment(failure)) {
        const std::string name = entry->path().filename().string();
        if (!name.starts_with('.') || name.find(kMark) == std::string::npos ||
            !name.ends_with(kTemporary))
            continue;
        constexpr int kHow = O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
        const char* const path = entry->path().c_str();
        int descriptor = open(path, O_RDWR | kHow);
        const bool is_folder = descriptor < 0 && errno == EISDIR;
        if (is_folder) descriptor = open(path, O_RDONLY | O_DIRECTORY | kHow);
        if (descriptor < 0) continue;
        if (isLeftover(descriptor, name)) {
            if (is_folder)
                removeFolder(path);
            else
                unlink(path);
        }
        close(descriptor);
    }
}

bool lockHidden(int descriptor) {
    return flock(descriptor, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

int noteTemporary(const std::string& path, HiddenKind kind) {
    if (path.size() >= PATH_MAX) return -1;
    for (std::size_t i = 0; i < kSlots; ++i) {
        int expected = Slot::kFree;
        if (!slots[i].state.compare_exchange_strong(expected, Slot::kChanging)) continue;
        std::memcpy(slots[i].path, path.c_str(), path.size() + 1);
        slots[i].state = kind == HiddenKind::kFolder ? Slot::kLiveFolder : Slot::kLiveFile;
        return static_cast<int>(i);
    }
    return -1;
}

void forgetTemporary(int place) noexcept {
    if (place >= 0) slots[static_cast<std::size_t>(place)].state = Slot::kFree;
}

void removeTemporaryFiles() noexcept {
    const int saved = errno;
    for (const Slot& slot : slots) {
        const int state = slot.state;
        if (state == Slot::kLiveFile) unlink(slot.path);
        if (state == Slot::kLiveFolder) removeFolder(slot.path);
    }
    errno = saved;
}

ScratchFolder::ScratchFolder(const fs::path& parent) {
    std::error_code failure;
    const fs::path folder = parent.empty() ? fs::path(".") : parent;
    fs::create_directories(folder, failure);
    removeLeftovers(folder.string());
    constexpr int kAttempts = 100;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
        path_ = folder / hiddenName(kScratchBase);
        place_ = noteTemporary(path_.string(), HiddenKind::kFolder);
        const bool made = mkdir(path_.c_str(), 0777) == 0;
        if (made) descriptor_ = openFile(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        const int cause = errno;
        const bool is_open = descriptor_ >= 0;
        // removeLeftovers() of another process may have removed the folder before it was locked.
        struct stat opened {
        }, there{};
        if (is_open && lockHidden(descriptor_) && fstat(descriptor_, &opened) == 0 &&
            stat(path_.c_str(), &there) == 0 && opened.st_ino == there.st_ino)
            return;
        if (is_open) close(std::exchange(descriptor_, -1));
        if (made) rmdir(path_.c_str());
        forgetTemporary(std::exchange(place_, -1));
        if (!is_open && cause != (made ? ENOENT : EEXIST)) failScratch(folder, cause);
    }
    failScratch(folder, EEXIST);
}

ScratchFolder::~ScratchFolder() {
    emptyFolder(descriptor_);  // removeFolder() would open it again, which may fail
    rmdir(path_.c_str());
    close(descriptor_);
    forgetTemporary(place_);
}

bool isScratchFile(const fs::path& file) {
    const std::string folder = file.parent_path().filename().string();
    return folder.starts_with('.' + std::string(kScratchBase) + std::string(kMark)) &&
           folder.ends_with(kTemporary);
}

}  // namespace peeler
