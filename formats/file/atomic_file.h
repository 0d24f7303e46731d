// SPDX-License-Identifier: Apache-2.0
// A file that stands under its final name only when it is whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// Writes to a new hidden file in the destination folder (".out.exr.peeler-<host>-<pid>-<n>.tmp"),
/// which commit() syncs and renames. Destroyed before that, it leaves nothing behind; a process
/// that is killed outright (SIGKILL) leaves the hidden file, never a partial one under the final
/// name, and the first AtomicFile of another process in that folder removes it: a hidden file that
/// is in use is locked (flock), also against processes of the same number on other machines. The
/// mode of the new file is 0666 less the umask. A symbolic link at `path` is followed, not
/// replaced, also where it leads to a file that is not there yet. Folders that are missing are
/// made. If isStandardOutput(path), the hidden file is in the folder for temporary files, and
/// commit() copies it to standard output. Every member that touches the disk throws Error (kOutput)
/// with path and hint. Not for several threads at once.
class AtomicFile {
  public:
    /// Creates the hidden file. Throws at once if the folder cannot be made or written to, or if
    /// `path` is something other than a regular file; Error (kUsage) if it is empty, or standard
    /// output and that is a terminal.
    explicit AtomicFile(std::string path);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    /// Adds to the end of the file, through a buffer.
    void append(std::span<const std::byte> bytes);
    /// Overwrites [offset, offset + bytes) or extends the file. What was appended before is written
    /// out first.
    void writeAt(std::uint64_t offset, std::span<const std::byte> bytes);
    /// Reads what was written. Returns how many bytes there were before the end.
    std::size_t readAt(std::uint64_t offset, std::span<std::byte> bytes);
    /// Hands the buffer to the operating system, so that temporaryPath() can be opened and read.
    void flush();
    /// Flushes and fsyncs; what can fail for want of space fails here.
    void sync();
    /// Syncs, closes and renames the file, and fsyncs its folder. Nothing may be written after it.
    void commit();

    std::uint64_t size() const { return size_; }  ///< bytes, those in the buffer included
    const std::string& path() const { return path_; }
    /// path() with symbolic links followed: where the file will stand.
    const std::string& destination() const { return destination_; }
    const std::string& temporaryPath() const { return temporary_path_; }

  private:
    friend void commitAll(std::span<AtomicFile* const> files);
    // The steps of commit(), of which the first is that of many files together.
    static void syncAll(std::span<AtomicFile* const> files);
    void publish();
    void syncFolder() const;

    void writeOut(std::uint64_t offset, std::span<const std::byte> bytes);
    void copyToStandardOutput();
    void discard() noexcept;
    [[noreturn]] void fail(const std::string& what, int error) const;

    std::string path_;         ///< as the caller wrote it: what messages name
    std::string destination_;  ///< with symbolic links followed
    std::string temporary_path_;
    int descriptor_ = -1;
    int slot_ = -1;            ///< of noteTemporary(), −1 = none was left
    bool in_scratch_ = false;  ///< isScratchFile(): nothing is synced
    std::vector<std::byte> buffer_;
    std::uint64_t size_ = 0;
    std::uint64_t transferable_ = 0;  ///< bytes whose transfer to the disk has not begun
};

/// Where a file of this name will stand: the name with the symbolic links at its end followed.
std::filesystem::path withLinksFollowed(std::filesystem::path path);

/// Whether a name stands for standard output: "-", or "-.EXT" for a format by its extension. A file
/// of that name is "./-.EXT".
bool isStandardOutput(const std::string& path);

/// Bytes that files of such names have written to standard output, all together.
std::uint64_t bytesOnStandardOutput();

/// Commits files that are worth something only together. All are synced before one is renamed (many
/// of them by a sync of their file system, which takes hardly longer than that of one file); if one
/// cannot be renamed nevertheless, those that have been are removed, so that no half set is left.
/// Throws Error (kOutput).
void commitAll(std::span<AtomicFile* const> files);
void commitAll(std::span<const std::unique_ptr<AtomicFile>> files);

}  // namespace peeler
