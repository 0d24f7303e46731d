// SPDX-License-Identifier: Apache-2.0
// Atomic output files, which appear under their final name only when complete.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// An output file that is first written to a new hidden file in the destination folder
/// (".out.exr.peeler-<host>-<pid>-<n>.tmp"). commit() syncs the hidden file and renames it. If the
/// object is destroyed before commit(), no file remains. If the process is killed (SIGKILL), the
/// hidden file remains, but never a partial file under the final name; the first AtomicFile of
/// another process in that folder removes the hidden file. Hidden files in use are locked (flock),
/// so that a process with the same id on another machine does not take them for leftovers.
///
/// The new file's mode is 0666 less the umask. A symbolic link at `path` is followed, not replaced,
/// even if its target does not exist yet. Missing folders are created. If isStandardOutput(path),
/// the hidden file is in the folder for temporary files, and commit() copies it to standard output.
/// Every member that touches the disk throws Error (kOutput) with path and hint. Not thread-safe.
class AtomicFile {
  public:
    /// Creates the hidden file. Throws Error (kOutput) if the folder cannot be created or written
    /// to, or if `path` is not a regular file. Throws Error (kUsage) if `path` is empty, or if
    /// `path` means standard output and standard output is a terminal.
    explicit AtomicFile(std::string path);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    /// Appends to the file, through a buffer.
    void append(std::span<const std::byte> bytes);
    /// Writes bytes at an offset, overwriting the file or extending it. Flushes appended bytes
    /// first.
    void writeAt(std::uint64_t offset, std::span<const std::byte> bytes);
    /// Reads bytes that have been written. Returns the number read, which is less than requested
    /// only at the end of the file.
    std::size_t readAt(std::uint64_t offset, std::span<std::byte> bytes);
    /// Writes the buffer to the hidden file, so that other code can read temporaryPath().
    void flush();
    /// Flushes and fsyncs. Lack of space is reported here at the latest.
    void sync();
    /// Syncs, closes and renames the file, and fsyncs its folder. Nothing may be written
    /// afterwards.
    void commit();

    /// Returns the number of bytes appended, including buffered bytes.
    std::uint64_t size() const { return size_; }
    const std::string& path() const { return path_; }
    /// Returns path() with symbolic links followed: the final location.
    const std::string& destination() const { return destination_; }
    const std::string& temporaryPath() const { return temporary_path_; }

  private:
    friend void commitAll(std::span<AtomicFile* const> files);
    // The steps of commit(); syncAll() syncs several files.
    static void syncAll(std::span<AtomicFile* const> files);
    void publish();
    void syncFolder() const;

    void writeOut(std::uint64_t offset, std::span<const std::byte> bytes);
    void copyToStandardOutput();
    void discard() noexcept;
    [[noreturn]] void fail(const std::string& what, int error) const;

    std::string path_;         ///< as passed to the constructor, for messages
    std::string destination_;  ///< path_ with symbolic links followed
    std::string temporary_path_;
    int descriptor_ = -1;
    int slot_ = -1;            ///< slot from noteTemporary(); −1 if no slot was free
    bool in_scratch_ = false;  ///< whether the file is a scratch file, which is not synced
    std::vector<std::byte> buffer_;
    std::uint64_t size_ = 0;
    std::uint64_t transferable_ = 0;  ///< bytes written since the last transfer to disk was started
};

/// Returns the final target of `path` if it is a symbolic link, otherwise `path`. The target need
/// not exist.
std::filesystem::path withLinksFollowed(std::filesystem::path path);

/// Whether a name means standard output: "-", or "-.EXT", where the extension chooses the format.
/// "./-.EXT" names a file instead.
bool isStandardOutput(const std::string& path);

/// Returns the total bytes that all AtomicFiles have written to standard output.
std::uint64_t bytesOnStandardOutput();

/// Commits files that belong together. Syncs all files before it renames any. For many files, syncs
/// each file system once, which takes hardly longer than syncing one file. If a rename fails,
/// removes the files already renamed, so that no partial set is left. Throws Error (kOutput).
void commitAll(std::span<AtomicFile* const> files);
void commitAll(std::span<const std::unique_ptr<AtomicFile>> files);

}  // namespace peeler
