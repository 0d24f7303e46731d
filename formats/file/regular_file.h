// SPDX-License-Identifier: Apache-2.0
// Reads the bytes of a regular file, at once up to a limit, or in parts. Whatever is read is opened
// here: nothing else is waited for or read without end (tests/doors_test.py).
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <ctime>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// Opens as open(2) does, once more where a signal interrupts that: network file systems let it.
int openFile(const char* path, int flags, mode_t mode = 0);

/// Whether there is such a file. One that cannot be asked for (its folder, its disk) is none.
bool isThere(const std::filesystem::path& path);

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
