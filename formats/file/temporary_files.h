// SPDX-License-Identifier: Apache-2.0
// Hidden temporary files and folders: names, locks, removal when a signal terminates the process,
// and removal of leftovers of killed processes.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace peeler {

/// Returns ".BASE.peeler-<host>-<pid>-<n>.tmp", unique per call. A long `base` is truncated.
std::string hiddenName(std::string_view base);

/// Removes the hidden files and scratch folders that killed processes left in a folder. Only the
/// first call per folder has an effect. Keeps locked files, which are in use. Keeps files of other
/// machines until they are a day old, since locks may not reach across machines (NFS).
void removeLeftovers(const std::string& folder);

/// Locks an open file or folder until it is closed or the process ends. Returns false if another
/// process has locked it. If locks are not supported, returns true, and no process removes
/// leftovers.
bool lockHidden(int descriptor);

enum class HiddenKind : int { kFile, kFolder };

/// Registers a path for removeTemporaryFiles(). Returns the index of its slot; −1 if no slot is
/// free or the path is too long.
int noteTemporary(const std::string& path, HiddenKind kind = HiddenKind::kFile);
void forgetTemporary(int place) noexcept;

/// Unlinks the hidden file of every live AtomicFile, and every scratch folder with its files.
/// Async-signal-safe, for handlers that are about to end the process.
void removeTemporaryFiles() noexcept;

/// A new hidden folder for files that will be copied into another file (".samples.peeler-….tmp").
/// The destructor removes the folder with all its files; removeLeftovers() removes the folders of
/// killed processes. AtomicFiles in a scratch folder are not synced to disk, since they never
/// outlive the process. Throws Error (kOutput) if the folder cannot be created.
class ScratchFolder {
  public:
    explicit ScratchFolder(const std::filesystem::path& parent);
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
    int descriptor_ = -1;
    int place_ = -1;  ///< slot from noteTemporary()
};

/// Whether a file lies in a scratch folder.
bool isScratchFile(const std::filesystem::path& file);

}  // namespace peeler
