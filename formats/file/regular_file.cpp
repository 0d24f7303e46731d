// SPDX-License-Identifier: Apache-2.0
// Regular file access. Opening, checking and reading use one descriptor, so that all three concern
// the same file.
#include "formats/file/regular_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <thread>
#include <utility>

namespace peeler {
namespace {

/// Throws the Error of fileExists() and isTaken().
[[noreturn]] void failToLook(const std::filesystem::path& path, int error, ErrorKind kind) {
    throw Error(kind, "cannot examine the path: " + std::string(std::strerror(error)),
                path.string(),
                error == EACCES  ? "check the permissions of the folders in the path"
                : error == ELOOP ? "the symbolic links in the path form a loop"
                                 : "check the disk");
}

/// Whether the error means that no such file exists. (A file cannot have a name that is too long.)
bool meansNothing(int error) {
    return error == ENOENT || error == ENOTDIR || error == ENAMETOOLONG;
}

using Look = int (*)(const char* path, struct stat* status);

/// Whether a path exists. Returns nothing if that is unknown; errno then has the cause.
std::optional<bool> look(const std::filesystem::path& path, Look how) {
    struct stat status {};
    int result = 0;
    do
        result = how(path.c_str(), &status);
    while (result != 0 && errno == EINTR);
    if (result == 0) return true;
    return meansNothing(errno) ? std::optional(false) : std::nullopt;
}

constexpr char kNoPipes[] = "pipes and devices are not read; copy the data to a file";

/// Opens for reading. O_NONBLOCK keeps open() from waiting for the writer of a pipe; the caller
/// closes anything but a regular file without reading it. For a regular file, the flag matters only
/// while another program holds a lease (fcntl(2), F_SETLEASE), which the kernel soon revokes.
int openToRead(const std::filesystem::path& path) {
    constexpr int kHow = O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY;
    // The waits take a minute: longer than the default of /proc/sys/fs/lease-break-time (45 s).
    constexpr int kMostWaits = 6000;
    for (int wait = 0;; ++wait) {
        const int descriptor = openFile(path.c_str(), kHow);
        struct stat status {};
        if (descriptor >= 0 || errno != EWOULDBLOCK || wait == kMostWaits ||
            ::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode))
            return descriptor;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
}

template <class Bytes>
Bytes readAll(const std::filesystem::path& path, std::uint64_t max_bytes) {
    const RegularFile file(path);
    file.check();
    if (file.size() > max_bytes)
        throw Error(ErrorKind::kInput,
                    "the file has " + std::to_string(file.size()) + " bytes, but the limit is " +
                        std::to_string(max_bytes),
                    path.string(), "split the file or make it smaller");
    Bytes bytes(file.size(), {});
    bytes.resize(file.readSome(0, {reinterpret_cast<char*>(bytes.data()), bytes.size()}));
    return bytes;
}

}  // namespace

int openFile(const char* path, int flags, mode_t mode) {
    int descriptor = -1;
    do
        descriptor = ::open(path, flags, mode);
    while (descriptor < 0 && errno == EINTR);
    return besideStandardStreams(descriptor);
}

bool fileExists(const std::filesystem::path& path, ErrorKind kind) {
    if (const auto found = look(path, ::stat)) return *found;
    failToLook(path, errno, kind);
}

bool isTaken(const std::filesystem::path& name) {
    if (const auto found = look(name, ::lstat)) return *found;
    failToLook(name, errno, ErrorKind::kOutput);
}

bool isSeen(const std::filesystem::path& path) {
    return look(path, ::stat).value_or(false);
}

std::vector<std::string> namesIn(const std::filesystem::path& folder) {
    std::vector<std::string> names;
    std::error_code failure;
    for (std::filesystem::directory_iterator entry(folder, failure), end; !failure && entry != end;
         entry.increment(failure))
        names.push_back(entry->path().filename().string());
    if (failure && !meansNothing(failure.value()))
        failToLook(folder, failure.value(), ErrorKind::kOutput);
    return names;
}

std::vector<std::uint8_t> readRegularFile(const std::filesystem::path& path,
                                          std::uint64_t max_bytes) {
    return readAll<std::vector<std::uint8_t>>(path, max_bytes);
}

std::string readRegularText(const std::filesystem::path& path, std::uint64_t max_bytes) {
    return readAll<std::string>(path, max_bytes);
}

void failToOpen(const std::filesystem::path& path, int error) {
    if (path.empty()) throw Error(ErrorKind::kInput, "the file's name is empty");
    if (error == ENOENT || error == ENOTDIR)
        throw Error(ErrorKind::kInput, "the file does not exist", path.string(),
                    "check the spelling and the folder");
    throw Error(error == ENOMEM ? ErrorKind::kMemory : ErrorKind::kInput,
                "the file cannot be read: " + std::string(std::strerror(error)), path.string(),
                error == EACCES ? "check its permissions" : "");
}

RegularFile::RegularFile(std::filesystem::path path)
    : path_(std::move(path)), descriptor_(openToRead(path_)) {
    if (descriptor_ < 0 || ::fstat(descriptor_, &status_) != 0) error_ = errno;
    if (error_ != 0 || S_ISREG(status_.st_mode)) return;
    ::close(descriptor_);
    descriptor_ = -1;
}

RegularFile::~RegularFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

void RegularFile::check() const {
    if (error_ == ENXIO)  // a socket, or a device file without its device
        throw Error(ErrorKind::kInput, "this is not a regular file", path_.string(), kNoPipes);
    if (error_ != 0) failToOpen(path_, error_);
    if (S_ISDIR(status_.st_mode))
        throw Error(ErrorKind::kInput, "this is a folder, not a file", path_.string(),
                    "name a file in it");
    if (!S_ISREG(status_.st_mode))
        throw Error(ErrorKind::kInput, "this is not a regular file", path_.string(), kNoPipes);
}

RegularFile::Identity RegularFile::identity() const {
    return {status_.st_dev, status_.st_ino, status_.st_size, status_.st_mtime};
}

std::size_t RegularFile::readSome(std::uint64_t at, std::span<char> bytes) const {
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t got = ::pread(descriptor_, bytes.data() + done, bytes.size() - done,
                                    static_cast<off_t>(at + done));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) failToOpen(path_, errno);
        if (got == 0) break;
        done += static_cast<std::size_t>(got);
    }
    return done;
}

bool RegularFile::read(std::uint64_t at, std::span<char> bytes) const {
    try {
        return readSome(at, bytes) == bytes.size();
    } catch (const Error&) {
        return false;
    }
}

}  // namespace peeler
