// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include <peeler/error.h>
#include "formats/file/helper_process.h"
#include "formats/file/regular_file.h"

namespace peeler {

SharedFile::SharedFile() : descriptor_(besideStandardStreams(memfd_create("peeler", MFD_CLOEXEC))) {
    if (descriptor_ < 0)
        throw Error(ErrorKind::kInternal,
                    "cannot create a file in memory: " + std::string(std::strerror(errno)), "",
                    "check the system's limit on open files");
}

SharedFile::~SharedFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

SharedFile::SharedFile(SharedFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), place_(other.place_) {}

void SharedFile::write(const void* from, std::size_t size) {
    const auto* bytes = static_cast<const std::byte*>(from);
    while (size > 0) {
        const ssize_t done = pwrite(descriptor_, bytes, size, static_cast<off_t>(place_));
        if (done < 0 && errno == EINTR) continue;
        if (done <= 0)
            throw Error(ErrorKind::kMemory,
                        "no memory for a decoder's data: " + std::string(std::strerror(errno)));
        bytes += done;
        size -= static_cast<std::size_t>(done);
        place_ += static_cast<std::uint64_t>(done);
    }
}

void SharedFile::read(void* to, std::size_t size) {
    auto* bytes = static_cast<std::byte*>(to);
    while (size > 0) {
        const ssize_t got = pread(descriptor_, bytes, size, static_cast<off_t>(place_));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0)
            throw Error(ErrorKind::kInput,
                        "the decoder's data cannot be read: " + std::string(std::strerror(errno)));
        if (got == 0) throw Error(ErrorKind::kInput, "the decoder's data ends too early");
        bytes += got;
        size -= static_cast<std::size_t>(got);
        place_ += static_cast<std::uint64_t>(got);
    }
}

std::uint64_t SharedFile::takeSize(std::size_t of_value, std::uint64_t most) {
    const auto size = takeOne<std::uint64_t>();
    // A decoder's sandbox denies fstat().
    const off_t end = lseek(descriptor_, 0, SEEK_END);
    if (end < 0 || size % of_value != 0 || size > static_cast<std::uint64_t>(end) - place_)
        throw Error(ErrorKind::kInput, "the decoder's data ends too early");
    if (size / of_value > most)
        throw Error(ErrorKind::kInput, "the decoder returns more data than requested");
    return size / of_value;
}

}  // namespace peeler
