// SPDX-License-Identifier: Apache-2.0
// Hidden temporary files and folders: names, locks, and removal when a process ends by a signal or
// is killed.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace peeler {

/// Returns ".BASE.peeler-<host>-<pid>-<n>.tmp", unique per call. `base` is shortened.
std::string hiddenName(std::string_view base);

/// Removes the hidden files and scratch folders left in a folder by killed processes, once per
/// folder and process. Locked ones are in use and stay, and so do those of other machines until
/// they are a day old, since locks may not reach across machines (NFS).
void removeLeftovers(const std::string& folder);

/// Locks an open file or folder until it is closed, however the process ends. Returns false if
/// another process has it locked. Returns true where locks are not supported: nothing removes
/// leftovers there, either.
bool lockHidden(int descriptor);

enum class HiddenKind : int { kFile, kFolder };

/// Registers a path for removeTemporaryFiles(). Returns its slot, −1 if none is free or the path is
/// too long.
int noteTemporary(const std::string& path, HiddenKind kind = HiddenKind::kFile);
/// Unregisters it.
void forgetTemporary(int place) noexcept;

/// Unlinks the hidden file of every live AtomicFile, and every scratch folder with its files.
/// Async-signal-safe, for handlers that are about to end the process.
void removeTemporaryFiles() noexcept;

/// A new hidden folder for files that will be copied into another file (".samples.peeler-….tmp").
/// Removed with the object, together with all its files; removeLeftovers() removes folders of
/// killed processes. AtomicFiles in it are not synced to disk, since they never outlive the
/// process. Throws Error (kOutput) if it cannot be created.
class ScratchFolder {
  public:
    /// Creates `parent` if it is missing.
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
