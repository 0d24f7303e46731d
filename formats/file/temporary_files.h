// SPDX-License-Identifier: Apache-2.0
// Hidden files and folders that are there while something is being written: their names, their
// locks, and how they go when a process ends by a signal or is killed.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace peeler {

/// ".BASE.peeler-<host>-<pid>-<n>.tmp", another one at each call. `base` is shortened.
std::string hiddenName(std::string_view base);

/// Removes the hidden files and scratch folders that killed processes have left in a folder; for
/// each folder once in this process. What is locked is in use and stays; so does what another
/// machine made, until it is a day old, since locks may not reach that far (NFS).
void removeLeftovers(const std::string& folder);

/// Locks what is open for as long as it is, however the process ends. False if somebody else has
/// it locked. True where there are no locks: there nobody removes leftovers, either.
bool lockHidden(int descriptor);

enum class HiddenKind : int { kFile, kFolder };

/// Notes a path for removeTemporaryFiles(). Returns its place, −1 if there is none left or the path
/// is too long.
int noteTemporary(const std::string& path, HiddenKind kind = HiddenKind::kFile);
/// Takes it off again.
void forgetTemporary(int place) noexcept;

/// Unlinks the hidden file of every AtomicFile that is alive, and every scratch folder with the
/// files in it. It is async-signal-safe, for handlers that are about to end the process.
void removeTemporaryFiles() noexcept;

/// A new hidden folder for files that are copied into another one (".samples.peeler-….tmp").
/// Removed with the object, with all files in it; a folder that a killed process has left is
/// removed by removeLeftovers(). An AtomicFile in it is not synced to the disk: none outlives the
/// process. Throws Error (kOutput) if it cannot be made.
class ScratchFolder {
  public:
    /// `parent` is made if it is missing.
    explicit ScratchFolder(const std::filesystem::path& parent);
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
    int descriptor_ = -1;
    int place_ = -1;  ///< of noteTemporary()
};

/// Whether a file lies in a scratch folder.
bool isScratchFile(const std::filesystem::path& file);

}  // namespace peeler
