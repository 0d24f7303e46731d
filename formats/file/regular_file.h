// SPDX-License-Identifier: Apache-2.0
// Says whether a file is there, and reads the bytes of a regular one, at once up to a limit, or in
// parts. Whatever is read is opened here: nothing else is waited for or read without end
// (tests/doors_test.py).
#pragma once

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <ctime>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <peeler/error.h>

namespace peeler {

/// Opens /dev/null in the place of each standard stream that is closed: the next file would get its
/// number, and what a library prints would go into that file. The mode is the contrary one: reading
/// from standard input and writing to standard output stay errors (EBADF). Every program calls it
/// first.
inline void openStandardStreams() {
    for (int stream = STDIN_FILENO; stream <= STDERR_FILENO; ++stream) {
        if (fcntl(stream, F_GETFD) >= 0) continue;
        // open() returns the lowest number that is free, which is this one.
        if (::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) return;
    }
}

/// Returns a descriptor, moved to another number if it has a standard stream's: the host of the
/// library may have closed those. −1 if it was −1, or no other number is free (errno says why).
inline int besideStandardStreams(int descriptor) {
    if (descriptor < 0 || descriptor > STDERR_FILENO) return descriptor;
    const int moved = fcntl(descriptor, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    const int cause = errno;
    ::close(descriptor);
    errno = cause;
    return moved;
}

/// Opens as open(2) does, once more where a signal interrupts that: network file systems let it;
/// besideStandardStreams().
int openFile(const char* path, int flags, mode_t mode = 0);

/// Whether there is such a file or folder, through symbolic links. Throws Error of `kind` where
/// nobody can tell, for want of permission, in a circle of links, on a broken disk: what may be
/// there must not be replaced or left out as if it were not.
bool fileExists(const std::filesystem::path& path, ErrorKind kind = ErrorKind::kInput);
/// Likewise whether a name is taken, be it by a link that leads nowhere. Throws Error (kOutput).
bool isTaken(const std::filesystem::path& name);
/// Whether fileExists() can say yes: for what is looked for in several places, or only reported.
bool isSeen(const std::filesystem::path& path);
/// The names of all that is in a folder, in no order; none if there is no such folder. Throws Error
/// (kOutput) if it cannot be listed.
std::vector<std::string> namesIn(const std::filesystem::path& folder);

/// The bytes of a regular file (through symbolic links). Throws Error(kInput) with the path as
/// `where` if there is none, it is something else (a folder, a pipe, a device), it is larger than
/// `max_bytes`, or it cannot be read.
std::vector<std::uint8_t> readRegularFile(const std::filesystem::path& path,
                                          std::uint64_t max_bytes);
/// The same as a text.
std::string readRegularText(const std::filesystem::path& path,
                            std::uint64_t max_bytes = std::numeric_limits<std::uint64_t>::max());

/// Throws the Error (kInput) that readRegularFile() throws for a file or folder that cannot be
/// opened; `error` is a value of errno.
[[noreturn]] void failToOpen(const std::filesystem::path& path, int error);

/// A regular file that is open for reading, whatever becomes of its name.
class RegularFile {
  public:
    /// Of what is not there, is no regular file, or cannot be opened isOpen() is false.
    explicit RegularFile(std::filesystem::path path);
    ~RegularFile();
    RegularFile(const RegularFile&) = delete;
    RegularFile& operator=(const RegularFile&) = delete;

    bool isOpen() const { return descriptor_ >= 0; }
    /// Throws what readRegularFile() throws, unless it is open.
    void check() const;
    int descriptor() const { return descriptor_; }  ///< −1 unless it is open
    std::uint64_t size() const { return static_cast<std::uint64_t>(status_.st_size); }

    /// What a file of the same name does not share that has taken its place, or has changed.
    struct Identity {
        dev_t device = 0;
        ino_t inode = 0;
        off_t size = 0;
        std::time_t written = 0;
        bool operator==(const Identity&) const = default;
    };
    Identity identity() const;

    /// Fills `bytes` from a place in it. False if they are not all there.
    bool read(std::uint64_t at, std::span<char> bytes) const;
    /// Likewise as far as the file goes; returns how many. Throws Error (kInput) if it cannot be
    /// read.
    std::size_t readSome(std::uint64_t at, std::span<char> bytes) const;

  private:
    std::filesystem::path path_;
    int descriptor_;
    int error_ = 0;
    struct stat status_ {};
};

}  // namespace peeler
