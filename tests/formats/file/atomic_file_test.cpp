// SPDX-License-Identifier: Apache-2.0
// Tests atomic files: the final name exists only for a complete file; failures leave no files, and
// report the reason.
#include "formats/file/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <fstream>
#include <functional>
#include <iterator>

#include <peeler/error.h>
#include "formats/exr/synthetic_image.h"
#include "formats/file/temporary_files.h"
#include "formats/writers.h"
#include "support/test_support.h"

namespace {

bool folders_cannot_be_synced = false;

}  // namespace

/// Replaces fsync() of the C library, so that syncing a folder can fail.
extern "C" int fsync(int file) {
    struct stat status {};
    if (!folders_cannot_be_synced || fstat(file, &status) != 0 || !S_ISDIR(status.st_mode))
        return static_cast<int>(syscall(SYS_fsync, file));
    errno = EIO;
    return -1;
}

namespace peeler {
namespace {

namespace fs = std::filesystem;

std::span<const std::byte> textBytes(const std::string& text) {
    return std::as_bytes(std::span(text.data(), text.size()));
}

std::size_t filesIn(const fs::path& folder) {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

/// Returns the text of the Error that an action throws. Expects the kind kOutput, a location and a
/// hint.
std::string outputError(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::kOutput) << e.what();
        EXPECT_FALSE(e.where().empty());
        EXPECT_FALSE(e.hint().empty());
        return e.what();
    }
    ADD_FAILURE() << "nothing was thrown";
    return {};
}

class Atomic : public testing::Test {
  protected:
    test::ScratchDir scratch;
    fs::path path = scratch / "out.bin";
};

TEST_F(Atomic, AppendsAndPatchesThenStandsUnderItsName) {
    std::string wanted;
    AtomicFile file(path);
    // Some pieces are smaller than the buffer, others larger; their total exceeds the buffer.
    for (int i = 0; i < 300; ++i) {
        const std::string piece(i % 100 == 0 ? 3'000'000 : 7919, static_cast<char>('a' + i % 26));
        file.append(textBytes(piece));
        wanted += piece;
    }
    EXPECT_EQ(file.size(), wanted.size());
    file.writeAt(5, textBytes("patched"));
    wanted.replace(5, 7, "patched");
    file.append(textBytes("end"));
    wanted += "end";
    std::string back(10, ' ');
    EXPECT_EQ(file.readAt(wanted.size() - 4, std::as_writable_bytes(std::span(back))), 4U);
    EXPECT_FALSE(fs::exists(path));
    file.commit();
    EXPECT_TRUE(test::bytesOf(path) == wanted);
    EXPECT_EQ(filesIn(scratch.path()), 1U);
    EXPECT_THROW(file.writeAt(0, textBytes("late")), Error);
}

TEST_F(Atomic, DestroyedBeforeCommitLeavesNothing) {
    {
        AtomicFile file(path);
        file.append(textBytes("half"));
        file.flush();
        EXPECT_EQ(filesIn(scratch.path()), 1U);
        EXPECT_TRUE(
            fs::path(file.temporaryPath()).filename().string().starts_with(".out.bin.peeler-"));
    }
    EXPECT_EQ(filesIn(scratch.path()), 0U);
}

TEST_F(Atomic, AnExistingFileIsReplacedOnlyAtCommit) {
    std::ofstream(path) << "old";
    {
        AtomicFile file(path);
        file.append(textBytes("new"));
        file.flush();
        EXPECT_EQ(test::bytesOf(path), "old");
    }
    EXPECT_EQ(test::bytesOf(path), "old");
    AtomicFile file(path);
    file.append(textBytes("new"));
    file.commit();
    EXPECT_EQ(test::bytesOf(path), "new");
}

TEST_F(Atomic, SymbolicLinksAreFollowed) {
    fs::create_directory(scratch / "elsewhere");
    std::ofstream(scratch / "elsewhere/real.bin") << "old";
    fs::create_symlink("elsewhere/real.bin", path);
    AtomicFile file(path);
    file.append(textBytes("new"));
    file.commit();
    EXPECT_TRUE(fs::is_symlink(path));
    EXPECT_EQ(test::bytesOf(scratch / "elsewhere/real.bin"), "new");
}

TEST_F(Atomic, SymbolicLinksAreFollowedToWhatIsNotThereYet) {
    fs::create_directory(scratch / "v003");
    fs::create_symlink("v003/out.bin", scratch / "latest");
    fs::create_symlink("latest", path);  // the path leads to the file through two links
    AtomicFile file(path);
    file.append(textBytes("new"));
    file.commit();
    EXPECT_TRUE(fs::is_symlink(path));
    EXPECT_TRUE(fs::is_symlink(scratch / "latest"));
    EXPECT_EQ(test::bytesOf(scratch / "v003/out.bin"), "new");
    EXPECT_EQ(filesIn(scratch / "v003"), 1U);
    // The link is absolute and leads into a missing folder.
    fs::create_symlink(scratch / "v004/out.bin", scratch / "next");
    AtomicFile(scratch / "next").commit();
    EXPECT_TRUE(fs::is_symlink(scratch / "next"));
    EXPECT_TRUE(fs::is_regular_file(scratch / "v004/out.bin"));
}

TEST_F(Atomic, ModeHonoursTheUmask) {
    const mode_t before = umask(027);
    AtomicFile file(path);
    umask(before);
    file.commit();
    struct stat status {};
    ASSERT_EQ(stat(path.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777U, 0640U);
}

TEST_F(Atomic, TwoWritersOfOneNameDoNotDisturbEachOther) {
    AtomicFile a(path), b(path);
    a.append(textBytes("aaaa"));
    b.append(textBytes("b"));
    a.commit();
    EXPECT_EQ(test::bytesOf(path), "aaaa");
    b.commit();
    EXPECT_EQ(test::bytesOf(path), "b");
}

TEST_F(Atomic, TogetherAllAppearOrNone) {
    // For a few files, each file is synced; for many files, their file system is synced.
    for (const std::size_t count : {3U, 20U}) {
        for (const bool blocked : {false, true}) {
            const fs::path folder = scratch / (std::to_string(count) + (blocked ? "b" : "a"));
            std::vector<std::unique_ptr<AtomicFile>> files;
            for (std::size_t i = 0; i < count; ++i) {
                const fs::path name = folder / (i % 2 == 0 ? "even" : "odd") / std::to_string(i);
                files.push_back(std::make_unique<AtomicFile>(name));
                files.back()->append(textBytes("file " + std::to_string(i)));
                EXPECT_FALSE(fs::exists(name));
            }
            if (blocked) {
                fs::create_directory(folder / "even/0");  // blocks the file that is renamed last
                const std::string what = outputError([&] { commitAll(files); });
                EXPECT_NE(what.find("cannot rename"), std::string::npos) << what;
                files.clear();
                EXPECT_EQ(filesIn(folder / "even") + filesIn(folder / "odd"), 1U);
                continue;
            }
            commitAll(files);
            for (std::size_t i = 0; i < count; ++i)
                EXPECT_EQ(test::bytesOf(files[i]->path()), "file " + std::to_string(i));
            EXPECT_EQ(filesIn(folder / "even") + filesIn(folder / "odd"), count);
        }
    }
}

TEST_F(Atomic, FilesStayWhereOnlyTheirFolderCannotBeSynced) {
    std::vector<std::unique_ptr<AtomicFile>> files;
    for (const char* name : {"a", "b"}) {
        files.push_back(std::make_unique<AtomicFile>(scratch / name));
        files.back()->append(textBytes(name));
    }
    folders_cannot_be_synced = true;
    const std::string what = outputError([&] { commitAll(files); });
    folders_cannot_be_synced = false;
    EXPECT_NE(what.find("cannot sync the folder"), std::string::npos) << what;
    files.clear();
    EXPECT_EQ(test::bytesOf(scratch / "a"), "a");
    EXPECT_EQ(test::bytesOf(scratch / "b"), "b");
}

TEST_F(Atomic, MissingFoldersAreMade) {
    const std::string made = scratch / "new/folder/out";
    AtomicFile(made).commit();
    EXPECT_TRUE(std::filesystem::is_regular_file(made));
}

TEST_F(Atomic, ImpossiblePlacesAreSaidAtOnce) {
    std::ofstream(scratch / "file") << "x";
    EXPECT_NE(
        outputError([&] { AtomicFile(scratch / "file/a/out"); }).find("cannot make the folder"),
        std::string::npos);
    outputError([&] { AtomicFile(scratch / "file/out"); });
    EXPECT_NE(outputError([&] { AtomicFile{scratch.path()}; }).find("folder"), std::string::npos);
    EXPECT_NE(outputError([&] { AtomicFile{(scratch / "sub/")}; }).find("folder"),
              std::string::npos);
    ASSERT_EQ(mkfifo((scratch / "pipe").c_str(), 0600), 0);
    EXPECT_NE(outputError([&] { AtomicFile(scratch / "pipe"); }).find("regular"),
              std::string::npos);
    outputError([&] { AtomicFile("/dev/full"); });
    if (geteuid() != 0) {
        fs::permissions(scratch.path(), fs::perms::owner_read | fs::perms::owner_exec);
        outputError([&] { AtomicFile{path}; });
    }
}

TEST_F(Atomic, LinksThatCannotBeFollowedStay) {
    fs::create_symlink(path.filename(), path);
    EXPECT_NE(outputError([&] { AtomicFile{path}; }).find("cannot write"), std::string::npos);
    EXPECT_TRUE(fs::is_symlink(path));
    EXPECT_EQ(filesIn(scratch.path()), 1U);
}

TEST_F(Atomic, LongNamesWork) {
    const fs::path longest = scratch / std::string(255, 'n');
    AtomicFile file(longest);
    file.commit();
    EXPECT_TRUE(fs::exists(longest));
}

/// Runs an action in a child process, so that the action's limits and signals end with the child.
/// Returns the child's wait status.
int inChild(const std::function<void()>& action) {
    const pid_t pid = fork();
    if (pid == 0) {
        action();
        _exit(0);
    }
    int status = 0;
    waitpid(pid, &status, 0);
    return status;
}

/// A host program may have closed descriptors 0 to 2. If a file took one of them, a driver's
/// messages would be written into that file.
TEST_F(Atomic, HasNoNumberOfAStandardStream) {
    const int status = inChild([&] {
        for (const int stream : {0, 1, 2})
            close(stream);
        AtomicFile file(path);
        file.append(textBytes("all"));
        for (const int stream : {0, 1, 2})
            if (write(stream, "noise", 5) >= 0) _exit(1);
        file.commit();
    });
    EXPECT_EQ(status, 0);
    EXPECT_EQ(test::bytesOf(path), "all");
}

TEST_F(Atomic, WhatAKilledProcessLeftIsRemovedByTheNextOne) {
    const int status = inChild([&] {
        AtomicFile file(path);
        file.append(textBytes("half"));
        file.flush();
        raise(SIGKILL);
    });
    ASSERT_TRUE(WIFSIGNALED(status));
    ASSERT_EQ(filesIn(scratch.path()), 1U);
    std::ofstream(scratch / ".other.peeler-notes") << "mine";  // a hidden file of another program
    AtomicFile next(scratch / "next.bin");
    EXPECT_EQ(filesIn(scratch.path()), 2U);
    EXPECT_TRUE(fs::exists(scratch / ".other.peeler-notes"));
    next.commit();
}

TEST_F(Atomic, WhatIsStillBeingWrittenStays) {
    AtomicFile first(path);
    first.append(textBytes("whole"));
    first.flush();
    // A process looks for leftovers only once per path of a folder, so the path is spelled
    // differently.
    const int status = inChild([&] { AtomicFile(scratch / "./other.bin").commit(); });
    EXPECT_EQ(status, 0);
    first.commit();
    EXPECT_EQ(test::bytesOf(path), "whole");
    EXPECT_EQ(filesIn(scratch.path()), 2U);
}

TEST_F(Atomic, WhatOtherMachinesWriteStaysForADay) {
    const fs::path young = scratch / ".a.exr.peeler-elsewhere-7-0.tmp";
    const fs::path old = scratch / ".b.exr.peeler-elsewhere-7-1.tmp";
    for (const fs::path& file : {young, old})
        std::ofstream(file) << "half";
    fs::last_write_time(old, fs::file_time_type::clock::now() - std::chrono::hours(25));
    AtomicFile(path).commit();
    EXPECT_TRUE(fs::exists(young));
    EXPECT_FALSE(fs::exists(old));
}

TEST_F(Atomic, ASignalHandlerCanRemoveWhatIsUnfinished) {
    const int status = inChild([&] {
        signal(SIGTERM, [](int) {
            removeTemporaryFiles();
            _exit(42);
        });
        AtomicFile a(path), b(scratch / "other");
        a.append(textBytes("x"));
        if (filesIn(scratch.path()) != 2) _exit(1);
        raise(SIGTERM);
    });
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 42);
    EXPECT_EQ(filesIn(scratch.path()), 0U);
}

TEST_F(Atomic, KilledOutrightLeavesNothingUnderTheFinalName) {
    std::ofstream(path) << "old";
    const int status = inChild([&] {
        AtomicFile file(path);
        file.append(textBytes("new"));
        file.flush();
        raise(SIGKILL);
    });
    EXPECT_TRUE(WIFSIGNALED(status));
    EXPECT_EQ(test::bytesOf(path), "old");
}

TEST_F(Atomic, AFileSizeLimitIsAnErrorLikeAFullDisk) {
    const int status = inChild([&] {
        signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{100'000, 100'000};
        setrlimit(RLIMIT_FSIZE, &limit);
        try {
            AtomicFile file(path);
            file.append(textBytes(std::string(200'000, 'x')));
            file.commit();
        } catch (const Error& e) {
            _exit(e.kind() == ErrorKind::kOutput ? 4 : 1);
        }
    });
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 4);
    EXPECT_EQ(filesIn(scratch.path()), 0U);
}

/// A file system of 256 KiB.
class SmallDisk {
  public:
    explicit SmallDisk(fs::path where) : where_(std::move(where)) {
        fs::create_directory(where_);
        mounted_ = mount("none", where_.c_str(), "tmpfs", 0, "size=256k") == 0;
    }
    ~SmallDisk() {
        if (mounted_) umount(where_.c_str());
    }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;
    bool mounted() const { return mounted_; }

  private:
    fs::path where_;
    bool mounted_ = false;
};

TEST_F(Atomic, AFullDiskIsSaidByEveryFormatAndLeavesNothing) {
    const fs::path folder = scratch / "disk";
    const SmallDisk disk(folder);
    if (!disk.mounted()) GTEST_SKIP() << "may not mount a small tmpfs (needs root)";
    const auto picture =
        test::makePicture({.seed = 5, .width = 640, .height = 480, .most_layers = 5});
    for (const char* name : {"out.exr", "out.png", "out.jpg", "out.tif"}) {
        SCOPED_TRACE(name);
        const std::string what = outputError([&] {
            const auto sink = makeSink(folder / name, {});
            test::writePicture(*sink, picture, {50});
        });
        EXPECT_NE(what.find("No space left"), std::string::npos) << what;
        EXPECT_EQ(filesIn(folder), 0U);
    }
}

}  // namespace
}  // namespace peeler
