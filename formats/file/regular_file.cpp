// SPDX-License-Identifier: Apache-2.0
// Opens, checks and reads a file by one descriptor, so that all three are of the same file.
#include "formats/file/regular_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "core/base/error.h"

namespace peeler {
namespace {

/// A POSIX file descriptor that is closed with the object.
class Descriptor {
  public:
    explicit Descriptor(int fd) : fd_(fd) {}
    ~Descriptor() {
        if (fd_ >= 0) ::close(fd_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int get() const { return fd_; }

  private:
    int fd_;
};

}  // namespace

std::vector<std::uint8_t> readRegularFile(const std::filesystem::path& path,
                                          std::uint64_t max_bytes) {
    // O_NONBLOCK: opening a pipe that nobody writes to must not wait. The kind is asked of the open
    // file, not of the name, which could be changed in between.
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
    if (file.get() < 0) failToOpen(path, errno);
    struct stat status = {};
    if (::fstat(file.get(), &status) != 0) failToOpen(path, errno);
    if (S_ISDIR(status.st_mode))
        throw Error(ErrorKind::kInput, "this is a folder, not a file", path.string(),
                    "name a file in it");
    if (!S_ISREG(status.st_mode))
        throw Error(ErrorKind::kInput, "this is not a regular file", path.string(),
                    "pipes and devices are not read; copy the data to a file");
    const auto size = static_cast<std::uint64_t>(status.st_size);
    if (size > max_bytes)
        throw Error(ErrorKind::kInput,
                    "the file has " + std::to_string(size) + " bytes, the limit is " +
                        std::to_string(max_bytes),
                    path.string(), "split the file or raise the limit");
    std::vector<std::uint8_t> bytes(size);
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t got = ::read(file.get(), bytes.data() + done, bytes.size() - done);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) failToOpen(path, errno);
        if (got == 0) break;  // it shrank meanwhile
        done += static_cast<std::size_t>(got);
    }
    bytes.resize(done);
    return bytes;
}

void failToOpen(const std::filesystem::path& path, int error) {
    if (error == ENOENT || error == ENOTDIR)
        throw Error(ErrorKind::kInput, "the file does not exist", path.string(),
                    "check the spelling and the folder");
    throw Error(error == ENOMEM ? ErrorKind::kMemory : ErrorKind::kInput,
                "the file cannot be read: " + std::string(std::strerror(error)), path.string(),
                error == EACCES ? "check its permissions" : "");
}

RegularFile::RegularFile(const std::filesystem::path& path)
    : descriptor_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY)) {
    is_open_ = descriptor_ >= 0 && ::fstat(descriptor_, &status_) == 0 && S_ISREG(status_.st_mode);
}

RegularFile::~RegularFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

RegularFile::Identity RegularFile::identity() const {
    return {status_.st_dev, status_.st_ino, status_.st_size, status_.st_mtime};
}

bool RegularFile::read(std::uint64_t at, std::span<char> bytes) const {
    while (!bytes.empty()) {
        const ssize_t got =
            ::pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(at));
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        at += static_cast<std::uint64_t>(got);
        bytes = bytes.subspan(static_cast<std::size_t>(got));
    }
    return true;
}

}  // namespace peeler
