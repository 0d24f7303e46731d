// SPDX-License-Identifier: Apache-2.0
// Implementation of AtomicFile: a temporary name, checked writes, sync, rename.
#include "formats/file/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include <peeler/error.h>
#include "formats/file/regular_file.h"
#include "formats/file/temporary_files.h"

namespace peeler {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBufferBytes = std::size_t{1} << 20U;
/// A transfer to disk starts only after this many new bytes, because starting many small, scattered
/// transfers would take longer than writing.
constexpr std::uint64_t kTransferBytes = std::uint64_t{8} << 20U;

std::string hintFor(int error) {
    switch (error) {
        case ENOSPC:
        case EDQUOT:
            return "free some space, or write to another disk";
        case ENOENT:
            return "the folder has disappeared; try again";
        case EACCES:
        case EPERM:
            return "check the permissions of the folder";
        case EROFS:
            return "the file system is read-only; write to another folder";
        case ENOTDIR:
            return "a part of the path is a file, not a folder";
        case ELOOP:
            return "the symbolic links in the path form a loop";
        case EFBIG:
            return "the file system or a limit (ulimit -f) allows no file that large";
        case ENAMETOOLONG:
            return "choose a shorter name";
        case EBADF:
            return "standard output is closed; name a file";
        default:
            return "check the disk";
    }
}

std::string text(int error) {
    return std::generic_category().message(error);
}

std::string folderOf(const std::string& path) {
    const std::string folder = fs::path(path).parent_path().string();
    return folder.empty() ? "." : folder;
}

std::atomic<std::uint64_t> bytes_on_standard_output{0};

/// Locks a new file until it is closed or the process ends. Returns false if another process has
/// already locked or removed the file.
bool lockIsMine(int descriptor) {
    if (!lockHidden(descriptor)) return false;
    struct stat status {};
    return fstat(descriptor, &status) != 0 || status.st_nlink > 0;
}

}  // namespace

std::filesystem::path withLinksFollowed(std::filesystem::path path) {
    constexpr int kMostLinks = 40;
    std::error_code failure;
    for (int i = 0; i < kMostLinks && fs::is_symlink(fs::symlink_status(path, failure)); ++i) {
        const fs::path target = fs::read_symlink(path, failure);
        if (failure) break;
        path = path.parent_path() / target;
    }
    return path;
}

AtomicFile::AtomicFile(std::string path) : path_(std::move(path)), destination_(path_) {
    if (path_.empty()) throw Error(ErrorKind::kUsage, "the file's name is empty", Parameter::kPath);
    if (isStandardOutput(path_)) {
        if (isatty(STDOUT_FILENO) == 1)
            throw Error(ErrorKind::kUsage, "standard output is a terminal",
                        Parameter::kPath + " " + path_,
                        "pipe it to another program, or name a file");
        std::error_code none;
        destination_ = (fs::temp_directory_path(none) / "stdout").string();
    } else {
        destination_ = withLinksFollowed(path_).string();
    }
    const fs::path name = fs::path(path_).filename();
    std::error_code error;
    const fs::file_status status = fs::status(path_, error);
    if (name.empty() || fs::is_directory(status)) {
        throw Error(ErrorKind::kOutput, "cannot write: it is a folder", path_,
                    "name a file inside the folder");
    }
    if (fs::exists(status) && !fs::is_regular_file(status)) {
        // Renaming would replace the device or pipe.
        throw Error(ErrorKind::kOutput, "cannot write: it is not a regular file", path_,
                    "name a regular file; the output is renamed into place");
    }
    // The target of a symbolic link cannot be examined, so the rename would replace the link.
    if (status.type() == fs::file_type::none)
        fail("cannot write: " + text(error.value()), error.value());

    const std::string folder = folderOf(destination_);
    std::error_code unmade;
    fs::create_directories(folder, unmade);
    if (unmade && !fs::is_directory(folder, error))
        fail("cannot make the folder: " + unmade.message(), unmade.value());
    // Check the length of the final name here, because it may be longer than the hidden name.
    // Otherwise, only the rename would fail.
    const long most = pathconf(folder.c_str(), _PC_NAME_MAX);
    if (most > 0 &&
        fs::path(destination_).filename().string().size() > static_cast<std::size_t>(most))
        fail("cannot write: " + text(ENAMETOOLONG), ENAMETOOLONG);
    removeLeftovers(folder);
    in_scratch_ = isScratchFile(destination_);
    const std::string base = fs::path(destination_).filename().string();
    buffer_.reserve(kBufferBytes);
    constexpr int kAttempts = 100;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
        temporary_path_ = (fs::path(destination_).parent_path() / hiddenName(base)).string();
        // Register the name before the file exists, so that a signal in between leaves no file.
        slot_ = noteTemporary(temporary_path_);
        descriptor_ =
            openFile(temporary_path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        // removeLeftovers() of another process may have removed the file before it was locked.
        if (descriptor_ >= 0 && lockIsMine(descriptor_)) return;
        const int cause = descriptor_ >= 0 ? EEXIST : errno;
        if (descriptor_ >= 0) {
            unlink(temporary_path_.c_str());
            close(std::exchange(descriptor_, -1));
        }
        forgetTemporary(slot_);
        slot_ = -1;
        if (cause != EEXIST) {
            if (cause == ENOENT) fail("cannot write: the folder does not exist", ENOENT);
            fail("cannot write: " + text(cause), cause);
        }
    }
    fail("cannot write: no free temporary name", EEXIST);
}

AtomicFile::~AtomicFile() {
    discard();
}

void AtomicFile::append(std::span<const std::byte> bytes) {
    if (buffer_.size() + bytes.size() > kBufferBytes) flush();
    if (bytes.size() > kBufferBytes) {
        writeOut(size_, bytes);
    } else {
        buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    }
    size_ += bytes.size();
}

void AtomicFile::writeAt(std::uint64_t offset, std::span<const std::byte> bytes) {
    flush();
    writeOut(offset, bytes);
    size_ = std::max(size_, offset + bytes.size());
}

std::size_t AtomicFile::readAt(std::uint64_t offset, std::span<std::byte> bytes) {
    flush();
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t n = pread(descriptor_, bytes.data() + done, bytes.size() - done,
                                static_cast<off_t>(offset + done));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) fail("cannot read back: " + text(errno), errno);
        if (n == 0) break;
        done += static_cast<std::size_t>(n);
    }
    return done;
}

void AtomicFile::flush() {
    if (buffer_.empty()) return;
    writeOut(size_ - buffer_.size(), buffer_);
    buffer_.clear();
}

void AtomicFile::sync() {
    flush();
    if (in_scratch_) return;
    if (fsync(descriptor_) != 0) fail("cannot write: " + text(errno), errno);
}

void AtomicFile::syncAll(std::span<AtomicFile* const> files) {
    // Up to this number of files, fsync() on each file is faster than syncfs().
    constexpr std::size_t kFew = 8;
    for (AtomicFile* const file : files) {
        file->flush();
        if (!file->in_scratch_) sync_file_range(file->descriptor_, 0, 0, SYNC_FILE_RANGE_WRITE);
    }
    // fsync() spends most of its time on syncing the file system, equally long for one changed file
    // and for many. So sync each file system once, then query each file for write errors. If either
    // step fails, fsync() decides whether the file is on disk.
    constexpr unsigned kWritten =
        SYNC_FILE_RANGE_WAIT_BEFORE | SYNC_FILE_RANGE_WRITE | SYNC_FILE_RANGE_WAIT_AFTER;
    std::map<dev_t, bool> file_systems;  // whether syncfs() succeeded on each file system
    for (AtomicFile* const file : files) {
        if (file->in_scratch_) continue;
        struct stat status {};
        bool synced = files.size() > kFew && fstat(file->descriptor_, &status) == 0;
        if (synced) {
            const auto [at, is_new] = file_systems.try_emplace(status.st_dev, false);
            if (is_new) at->second = syncfs(file->descriptor_) == 0;
            synced = at->second && sync_file_range(file->descriptor_, 0, 0, kWritten) == 0;
        }
        if (!synced) file->sync();
    }
}

void AtomicFile::commit() {
    if (!isStandardOutput(path_)) sync();
    publish();
    syncFolder();
}

void AtomicFile::publish() {
    if (isStandardOutput(path_)) return copyToStandardOutput();
    // Network file systems report an exceeded quota only when a descriptor is closed. Close a
    // duplicate descriptor to get this error. Closing the last descriptor would release the lock,
    // and another process would take the file for a leftover.
    if (const int other = dup(descriptor_); other >= 0 && close(other) != 0)
        fail("cannot write: " + text(errno), errno);
    if (std::rename(temporary_path_.c_str(), destination_.c_str()) != 0) {
        const int cause = errno;
        fail("cannot rename the finished file: " + text(cause), cause);
    }
    close(std::exchange(descriptor_, -1));
    forgetTemporary(std::exchange(slot_, -1));
    temporary_path_.clear();
}

void AtomicFile::syncFolder() const {
    if (in_scratch_ || isStandardOutput(path_)) return;
    const int folder = openFile(folderOf(destination_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder < 0) return;  // an unreadable folder cannot be synced
    const int result = fsync(folder);
    const int cause = errno;
    close(folder);
    // Not an error on file systems that cannot sync folders: the file itself is on disk.
    const bool unable = cause == EINVAL || cause == ENOTSUP || cause == ENOSYS;
    if (result != 0 && !unable) fail("cannot sync the folder: " + text(cause), cause);
}

void AtomicFile::writeOut(std::uint64_t offset, std::span<const std::byte> bytes) {
    if (descriptor_ < 0) {
        throw Error(ErrorKind::kInternal, "written to after it was committed", path_);
    }
    while (!bytes.empty()) {
        const ssize_t n =
            pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) fail("cannot write: " + text(errno), errno);
        // After a short write, the next write reports the cause, mostly lack of space.
        offset += static_cast<std::uint64_t>(n);
        transferable_ += static_cast<std::uint64_t>(n);
        bytes = bytes.subspan(static_cast<std::size_t>(n));
    }
    if (transferable_ < kTransferBytes || in_scratch_) return;
    // Start the transfer to disk now, to shorten sync(). Ignore a failure, because sync() then
    // transfers everything.
    sync_file_range(descriptor_, 0, 0, SYNC_FILE_RANGE_WRITE);
    transferable_ = 0;
}

void AtomicFile::copyToStandardOutput() {
    std::vector<std::byte> bytes(kBufferBytes);
    for (std::uint64_t offset = 0; offset < size_;) {
        const std::size_t read = readAt(offset, bytes);
        for (std::size_t done = 0; done < read;) {
            const ssize_t n = ::write(STDOUT_FILENO, bytes.data() + done, read - done);
            if (n < 0 && errno == EINTR) continue;
            if (n < 0) fail("cannot write: " + text(errno), errno);
            done += static_cast<std::size_t>(n);
        }
        offset += read;
    }
    bytes_on_standard_output += size_;
    discard();
    temporary_path_.clear();
}

void AtomicFile::discard() noexcept {
    if (descriptor_ >= 0) close(std::exchange(descriptor_, -1));
    if (!temporary_path_.empty()) unlink(temporary_path_.c_str());
    forgetTemporary(std::exchange(slot_, -1));
}

void AtomicFile::fail(const std::string& what, int error) const {
    throw Error(ErrorKind::kOutput, what, path_, hintFor(error));
}

bool isStandardOutput(const std::string& path) {
    return path == "-" || path.starts_with("-.");
}

std::uint64_t bytesOnStandardOutput() {
    return bytes_on_standard_output;
}

void commitAll(std::span<AtomicFile* const> files) {
    if (files.size() == 1) return files.front()->commit();
    AtomicFile::syncAll(files);
    // The first file refers to the others, so it is renamed last.
    std::size_t renamed = files.size();  // files [renamed, size) have been renamed
    try {
        for (; renamed > 0; --renamed)
            files[renamed - 1]->publish();
    } catch (...) {
        for (const AtomicFile* const file : files.subspan(renamed))
            unlink(file->destination().c_str());
        throw;
    }
    std::set<std::string> folders;
    for (const AtomicFile* const file : files)
        if (folders.insert(folderOf(file->destination())).second) file->syncFolder();
}

void commitAll(std::span<const std::unique_ptr<AtomicFile>> files) {
    std::vector<AtomicFile*> all;
    for (const auto& file : files)
        all.push_back(file.get());
    commitAll(all);
}

}  // namespace peeler
