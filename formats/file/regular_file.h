// SPDX-License-Identifier: Apache-2.0
// Reading of regular files: existence checks, and reads of whole files up to a limit, or of parts.
// All input is opened here, so nothing waits on or endlessly reads anything else
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

/// Opens /dev/null in place of each closed standard stream: otherwise the next file would get its
/// number, and a library's messages would go into that file. The mode is the opposite one, so that
/// reading from standard input and writing to standard output stay errors (EBADF). Every program
/// calls it first.
inline void openStandardStreams() {
    for (int stream = STDIN_FILENO; stream <= STDERR_FILENO; ++stream) {
        if (fcntl(stream, F_GETFD) >= 0) continue;
        // open() returns the lowest free number, which is this one.
        if (::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) return;
    }
}

/// Returns a descriptor, moved to another number if it has a standard stream's: the library's host
/// may have closed those. Returns −1 if it was −1, or no other number is free (see errno).
inline int besideStandardStreams(int descriptor) {
    if (descriptor < 0 || descriptor > STDERR_FILENO) return descriptor;
    const int moved = fcntl(descriptor, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    const int cause = errno;
    ::close(descriptor);
    errno = cause;
    return moved;
}

/// Opens like open(2), retrying if a signal interrupts it, as network file systems allow; then
/// applies besideStandardStreams().
int openFile(const char* path, int flags, mode_t mode = 0);

/// Whether a file or folder exists, through symbolic links. Throws Error of `kind` if that cannot
/// be determined (missing permission, circular links, a broken disk): an existing file must not be
/// replaced or skipped as if it were missing.
bool fileExists(const std::filesystem::path& path, ErrorKind kind = ErrorKind::kInput);
/// Whether a name is taken, even by a dangling link. Throws Error (kOutput) if that cannot be
/// determined.
bool isTaken(const std::filesystem::path& name);
/// Whether fileExists() would return true, without throwing; for files searched for in several
/// places, or only reported.
bool isSeen(const std::filesystem::path& path);
/// Returns the names of everything in a folder, unordered; empty if there is no such folder. Throws
/// Error (kOutput) if it cannot be listed.
std::vector<std::string> namesIn(const std::filesystem::path& folder);

/// Returns the bytes of a regular file (through symbolic links). Throws Error (kInput) with the
/// path as `where` if it does not exist, is not a regular file (a folder, a pipe, a device), is
/// larger than `max_bytes`, or cannot be read.
std::vector<std::uint8_t> readRegularFile(const std::filesystem::path& path,
                                          std::uint64_t max_bytes);
/// Like readRegularFile(), as text.
std::string readRegularText(const std::filesystem::path& path,
                            std::uint64_t max_bytes = std::numeric_limits<std::uint64_t>::max());

/// Throws the Error (kInput) of readRegularFile() for a file or folder that cannot be opened;
/// `error` is a value of errno.
[[noreturn]] void failToOpen(const std::filesystem::path& path, int error);

/// A regular file open for reading, independent of later changes to its name.
class RegularFile {
  public:
    /// Leaves isOpen() false if the path does not exist, is not a regular file, or cannot be
    /// opened.
    explicit RegularFile(std::filesystem::path path);
    ~RegularFile();
    RegularFile(const RegularFile&) = delete;
    RegularFile& operator=(const RegularFile&) = delete;

    bool isOpen() const { return descriptor_ >= 0; }
    /// Throws like readRegularFile(), unless it is open.
    void check() const;
    int descriptor() const { return descriptor_; }  ///< −1 unless it is open
    std::uint64_t size() const { return static_cast<std::uint64_t>(status_.st_size); }

    /// The properties that differ if the file has been replaced or has changed.
    struct Identity {
        dev_t device = 0;
        ino_t inode = 0;
        off_t size = 0;
        std::time_t written = 0;
        bool operator==(const Identity&) const = default;
    };
    Identity identity() const;

    /// Fills `bytes` from offset `at`. Returns false unless all of them can be read.
    bool read(std::uint64_t at, std::span<char> bytes) const;
    /// Reads up to the end of the file; returns the number of bytes read. Throws Error (kInput) if
    /// it cannot be read.
    std::size_t readSome(std::uint64_t at, std::span<char> bytes) const;

  private:
    std::filesystem::path path_;
    int descriptor_;
    int error_ = 0;
    struct stat status_ {};
};

}  // namespace peeler
