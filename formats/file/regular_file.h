// SPDX-License-Identifier: Apache-2.0
// Reading of regular files: existence checks, and reads of whole files up to a limit, or of parts.
// All input is opened by these functions, so that peeler never waits for a pipe or reads endlessly
// from a device (tests/doors_test.py checks this).
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

/// Opens /dev/null for each closed standard stream. Otherwise the next opened file would get the
/// stream's number, and libraries would write their messages into that file. Standard input is
/// opened for writing and the others for reading, so that their use still fails (EBADF). Every
/// program calls this function first.
inline void openStandardStreams() {
    for (int stream = STDIN_FILENO; stream <= STDERR_FILENO; ++stream) {
        if (fcntl(stream, F_GETFD) >= 0) continue;
        // open() returns the lowest free number, which is `stream`.
        if (::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0) return;
    }
}

/// Moves a descriptor away from the numbers 0 to 2, which it may have if the host program has
/// closed its standard streams. Returns other descriptors, and −1, unchanged. Returns −1 if no
/// other number is free (see errno).
inline int besideStandardStreams(int descriptor) {
    if (descriptor < 0 || descriptor > STDERR_FILENO) return descriptor;
    const int moved = fcntl(descriptor, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    const int cause = errno;
    ::close(descriptor);
    errno = cause;
    return moved;
}

/// Opens like open(2), then applies besideStandardStreams(). Retries if a signal interrupts
/// open(2), as may happen on network file systems.
int openFile(const char* path, int flags, mode_t mode = 0);

/// Whether a file or folder exists, through symbolic links. Throws Error of `kind` if that cannot
/// be determined (missing permission, circular links, a broken disk), because callers replace or
/// skip a file that does not exist.
bool fileExists(const std::filesystem::path& path, ErrorKind kind = ErrorKind::kInput);
/// Whether a name is taken, even by a dangling link. Throws Error (kOutput) if that cannot be
/// determined.
bool isTaken(const std::filesystem::path& name);
/// Whether a file or folder certainly exists; false where fileExists() throws. Meant for files that
/// are searched for in several folders, or only reported.
bool isSeen(const std::filesystem::path& path);
/// Returns the names of all entries in a folder, unordered; empty if there is no such folder.
/// Throws Error (kOutput) if it cannot be listed.
std::vector<std::string> namesIn(const std::filesystem::path& folder);

/// Returns the bytes of a regular file (through symbolic links). Throws Error (kInput) with the
/// path as `where` if it does not exist, is not a regular file (a folder, a pipe, a device), is
/// larger than `max_bytes`, or cannot be read.
std::vector<std::uint8_t> readRegularFile(const std::filesystem::path& path,
                                          std::uint64_t max_bytes);
/// Returns the same bytes as readRegularFile(), as text.
std::string readRegularText(const std::filesystem::path& path,
                            std::uint64_t max_bytes = std::numeric_limits<std::uint64_t>::max());

/// Throws the Error (kInput) of readRegularFile() for a file or folder that cannot be opened.
/// `error` is a value of errno.
[[noreturn]] void failToOpen(const std::filesystem::path& path, int error);

/// A regular file that is open for reading; later changes to its name do not affect it.
class RegularFile {
  public:
    /// Opens the file. If it does not exist, is not a regular file, or cannot be opened, isOpen()
    /// returns false.
    explicit RegularFile(std::filesystem::path path);
    ~RegularFile();
    RegularFile(const RegularFile&) = delete;
    RegularFile& operator=(const RegularFile&) = delete;

    bool isOpen() const { return descriptor_ >= 0; }
    /// Throws the Error of readRegularFile() if the file is not open.
    void check() const;
    /// Returns the file descriptor, or −1 if the file is not open.
    int descriptor() const { return descriptor_; }
    std::uint64_t size() const { return static_cast<std::uint64_t>(status_.st_size); }

    /// Properties that differ if the file has been replaced or changed.
    struct Identity {
        dev_t device = 0;
        ino_t inode = 0;
        off_t size = 0;
        std::time_t written = 0;
        bool operator==(const Identity&) const = default;
    };
    Identity identity() const;

    /// Fills `bytes` from the offset `at`. Returns false if the file ends too early or cannot be
    /// read.
    bool read(std::uint64_t at, std::span<char> bytes) const;
    /// Reads from the offset `at` until `bytes` is full or the file ends. Returns the number of
    /// bytes read. Throws Error (kInput) if the file cannot be read.
    std::size_t readSome(std::uint64_t at, std::span<char> bytes) const;

  private:
    std::filesystem::path path_;
    int descriptor_;
    int error_ = 0;
    struct stat status_ {};
};

}  // namespace peeler
