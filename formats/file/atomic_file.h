// SPDX-License-Identifier: Apache-2.0
// Atomic output file: it appears under its final name only when complete.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// An output file that is written as a new hidden file in the destination folder
/// (".out.exr.peeler-<host>-<pid>-<n>.tmp"), which commit() syncs and renames. Destroyed before
/// that, it leaves nothing behind. A process killed outright (SIGKILL) leaves the hidden file,
/// never a partial one under the final name; the first AtomicFile of another process in that folder
/// removes it. A hidden file in use is locked (flock), also against processes with the same id on
/// other machines. The new file's mode is 0666 less the umask. A symbolic link at `path` is
/// followed, not replaced, even if its target does not exist yet. Missing folders are created. If
/// isStandardOutput(path), the hidden file is in the folder for temporary files, and commit()
/// copies it to standard output. Every member that touches the disk throws Error (kOutput) with
/// path and hint. Not for several threads at once.
class AtomicFile {
  public:
    /// Creates the hidden file. Throws Error (kOutput) if the folder cannot be created or written
    /// to, or `path` is not a regular file; Error (kUsage) if `path` is empty, or is standard
    /// output and that is a terminal.
    explicit AtomicFile(std::string path);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    /// Appends to the file, through a buffer.
    void append(std::span<const std::byte> bytes);
    /// Overwrites [offset, offset + bytes) or extends the file. Flushes appended bytes first.
    void writeAt(std::uint64_t offset, std::span<const std::byte> bytes);
    /// Reads written bytes. Returns how many there were before the end.
    std::size_t readAt(std::uint64_t offset, std::span<std::byte> bytes);
    /// Writes the buffer to the operating system, so that temporaryPath() can be opened and read.
    void flush();
    /// Flushes and fsyncs; lack of space shows here at the latest.
    void sync();
    /// Syncs, closes and renames the file, and fsyncs its folder. Nothing may be written
    /// afterwards.
    void commit();

    std::uint64_t size() const { return size_; }  ///< bytes, including the buffer
    const std::string& path() const { return path_; }
    /// Returns path() with symbolic links followed: the final location.
    const std::string& destination() const { return destination_; }
    const std::string& temporaryPath() const { return temporary_path_; }

  private:
    friend void commitAll(std::span<AtomicFile* const> files);
    // The steps of commit(); the first handles several files together.
    static void syncAll(std::span<AtomicFile* const> files);
    void publish();
    void syncFolder() const;

    void writeOut(std::uint64_t offset, std::span<const std::byte> bytes);
    void copyToStandardOutput();
    void discard() noexcept;
    [[noreturn]] void fail(const std::string& what, int error) const;

    std::string path_;         ///< as the caller wrote it, for messages
    std::string destination_;  ///< with symbolic links followed
    std::string temporary_path_;
    int descriptor_ = -1;
    int slot_ = -1;            ///< of noteTemporary(), −1 = no slot left
    bool in_scratch_ = false;  ///< isScratchFile(): nothing is synced
    std::vector<std::byte> buffer_;
    std::uint64_t size_ = 0;
    std::uint64_t transferable_ = 0;  ///< bytes not yet being transferred to disk
};

/// Returns a path with the symbolic links at its end followed.
std::filesystem::path withLinksFollowed(std::filesystem::path path);

/// Whether a name means standard output: "-", or "-.EXT" for a format by its extension. A file of
/// that name is "./-.EXT".
bool isStandardOutput(const std::string& path);

/// Returns the total bytes written to standard output by such files.
std::uint64_t bytesOnStandardOutput();

/// Commits files that belong together. Syncs all before renaming any (for many files by syncing
/// their file system, which takes hardly longer than one file). If a rename fails nevertheless,
/// removes the files already renamed, so that no partial set is left. Throws Error (kOutput).
void commitAll(std::span<AtomicFile* const> files);
void commitAll(std::span<const std::unique_ptr<AtomicFile>> files);

}  // namespace peeler
