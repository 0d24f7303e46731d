// SPDX-License-Identifier: Apache-2.0
// Tests peeler under a render farm: killed at any moment, run for a thousand frames, and started in
// any environment. The short run makes at most a tenth of the kills and frames.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

std::vector<std::string> animation(const std::string& frames, const fs::path& out,
                                   const std::vector<std::string>& more = {}) {
    const fs::path scene = sourceDir() / "examples" / "scenes" / "jellyfish.glb";
    std::vector<std::string> all{"render", scene.string(), "-o",   (out / "f.####.exr").string(),
                                 "-q",     "--frames",     frames, "--size",
                                 "64x36"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
}

using Files = std::map<std::string, std::string>;

/// Returns the content of every file in a folder by name. Hidden files are only counted.
Files filesIn(const fs::path& folder, std::size_t* hidden = nullptr) {
    Files files;
    if (hidden) *hidden = 0;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename();
        if (!name.starts_with('.'))
            files[name] = bytesOf(entry.path());
        else if (hidden)
            ++*hidden;
    }
    return files;
}

/// Whether `peeler verify` accepts every file; frames may be missing.
testing::AssertionResult areGood(const fs::path& folder) {
    std::vector<std::string> all{"verify", "--json", "-q"};
    for (const auto& [name, bytes] : filesIn(folder))
        all.push_back((folder / name).string());
    if (all.size() == 3) return testing::AssertionSuccess();
    const CommandResult result = runPeelerProcess(all);
    const auto told = nlohmann::json::parse(result.out);
    for (const auto& file : told.at("files"))
        if (file.at("verdict") != "good") return testing::AssertionFailure() << file.dump();
    if (result.exit_code == 0 || result.exit_code == 6) return testing::AssertionSuccess();
    return testing::AssertionFailure() << result.err;
}

unsigned seed() {
    const char* given = std::getenv("PEELER_TEST_SEED");
    return given ? static_cast<unsigned>(std::strtoul(given, nullptr, 10)) : std::random_device{}();
}

/// Returns a file's inode, which changes when the file is replaced; 0 if there is no file.
ino_t inodeOf(const fs::path& path) {
    struct stat found = {};
    return stat(path.c_str(), &found) == 0 ? found.st_ino : 0;
}

/// Runs of 20 frames that are killed at random moments, and the files of an uninterrupted run.
class Ended : public testing::Test {
  protected:
    static constexpr int kFrames = 20;

    void SetUp() override {
        fs::create_directories(scratch_ / "whole");
        fs::create_directories(out_);
        const auto start = Clock::now();
        ASSERT_EQ(runPeelerProcess(animation("1-20", scratch_ / "whole")).exit_code, 0);
        whole_time_ = Clock::now() - start;
        ASSERT_TRUE(areGood(scratch_ / "whole"));
        whole_ = filesIn(scratch_ / "whole");
        ASSERT_EQ(whole_.size(), std::size_t{kFrames});
    }

    /// Sends the signal at a random moment of a run: after a random number of frames and a random
    /// delay. A delay alone might end after the run on a fast machine.
    CommandResult endOne(int number) {
        // A random half of the files already exists.
        for (const auto& [name, bytes] : whole_)
            if (random_() % 2 == 0) fs::remove(out_ / name);
        const int done = static_cast<int>(random_() % (kFrames - 5));
        const fs::path last = done > 0 ? out_ / std::next(whole_.begin(), done - 1)->first : out_;
        const ino_t before = inodeOf(last);
        std::uniform_real_distribution<double> part(0, 1);
        const auto start = Clock::now();
        StartedCommand run(peelerCommand(animation("1-20", out_)));
        while (done > 0 && run.running() && (inodeOf(last) == before || inodeOf(last) == 0))
            std::this_thread::sleep_for(100us);
        // The maximum delay: 1/kFrames of the time so far or, if no frame is awaited, half the time
        // of a whole run.
        const std::chrono::duration<double> most =
            done > 0 ? (Clock::now() - start) / kFrames : whole_time_ / 2;
        std::this_thread::sleep_for(part(random_) * most);
        kill(run.pid(), number);
        return run.wait();
    }

    /// Expects every file with a final name to equal that of an uninterrupted run.
    void expectWhole() const {
        for (const auto& [name, bytes] : filesIn(out_)) {
            ASSERT_TRUE(whole_.contains(name)) << name;
            ASSERT_EQ(bytes, whole_.at(name)) << name;
        }
    }

    void expectRest() const {
        const CommandResult rest = runPeelerProcess(animation("1-20", out_, {"--skip-existing"}));
        EXPECT_EQ(rest.exit_code, 0) << rest.err;
        std::size_t hidden = 0;
        EXPECT_EQ(filesIn(out_, &hidden), whole_);
        EXPECT_EQ(hidden, 0U) << "what killed runs left is still there";
        EXPECT_TRUE(areGood(out_));
    }

    ScratchDir scratch_;
    fs::path out_ = scratch_ / "out";
    Clock::duration whole_time_{};
    Files whole_;
    unsigned seed_ = seed();
    std::mt19937 random_{seed_};
};

TEST_F(Ended, KillsLeaveOnlyWholeFiles) {
    const int runs = exhaustive() ? 200 : 10;
    int killed = 0;
    std::size_t leftovers = 0;
    for (int i = 0; i < runs; ++i) {
        const CommandResult result = endOne(SIGKILL);
        ASSERT_TRUE(result.exit_code == 137 || result.exit_code == 0) << result.err;
        killed += result.exit_code == 137;
        std::size_t hidden = 0;
        filesIn(out_, &hidden);
        leftovers += hidden;
        ASSERT_NO_FATAL_FAILURE(expectWhole()) << "seed " << seed_;
        if (i % 20 == 19 || i + 1 == runs) {
            ASSERT_TRUE(areGood(out_)) << "seed " << seed_;
        }
    }
    expectRest();
    std::printf(
        "seed %u: %d runs, %d of them killed (the others had ended), %zu hidden files "
        "left behind and removed\n",
        seed_, runs, killed, leftovers);
    EXPECT_GT(killed, runs / 2);
}

TEST_F(Ended, TerminationsLeaveNothing) {
    const int runs = exhaustive() ? 50 : 5;
    int ended = 0;
    for (int i = 0; i < runs; ++i) {
        const CommandResult result = endOne(SIGTERM);
        ASSERT_TRUE(result.exit_code == 143 || result.exit_code == 0) << result.err;
        ended += result.exit_code == 143;
        std::size_t hidden = 0;
        filesIn(out_, &hidden);
        ASSERT_EQ(hidden, 0U) << "seed " << seed_;
        ASSERT_NO_FATAL_FAILURE(expectWhole()) << "seed " << seed_;
    }
    expectRest();
    std::printf("seed %u: %d runs, %d of them terminated (the others had ended)\n", seed_, runs,
                ended);
    EXPECT_GT(ended, runs / 2);
}

/// System resources that a process holds.
struct Held {
    std::uint64_t resident = 0;
    std::size_t files = 0;
};

/// Returns the resources that a process holds; all 0 if it has ended. Pauses the process meanwhile.
Held heldBy(pid_t pid) {
    const fs::path process = fs::path("/proc") / std::to_string(pid);
    kill(pid, SIGSTOP);
    Held held;
    std::ifstream status(process / "status");
    for (std::string word; status >> word;)
        if (word == "VmRSS:") status >> held.resident;
    held.resident *= 1024;
    std::error_code gone;
    for (fs::directory_iterator file(process / "fd", gone), end; !gone && file != end;
         file.increment(gone)) {
        // Skips the output files and the folder that contains them. Both are open only briefly,
        // while a file is being written.
        std::error_code closed;
        const fs::path target = fs::read_symlink(file->path(), closed);
        if (!closed && target.string().find("peeler-test-") == std::string::npos) ++held.files;
    }
    kill(pid, SIGCONT);
    return held;
}

TEST(LongSequence, MemoryAndFilesStayAsTheyAreAfterTheTenth) {
    const int frames = exhaustive() ? 1000 : 100;
    // `last` is early enough that many frames remain.
    const int half = frames / 2, last = frames * 7 / 10;
    const ScratchDir scratch;
    StartedCommand run(peelerCommand(animation("1-" + std::to_string(frames), scratch.path())));
    const auto heldAtFrame = [&](int frame) {
        char name[16];
        std::snprintf(name, sizeof name, "f.%04d.exr", frame);
        while (!fs::exists(scratch / name) && run.running())
            std::this_thread::sleep_for(1ms);
        // Takes several samples, because a frame or a driver may hold resources briefly.
        Held least = heldBy(run.pid());
        for (int i = 0; i < 4; ++i) {
            std::this_thread::sleep_for(5ms);
            const Held now = heldBy(run.pid());
            least.resident = std::min(least.resident, now.resident);
            least.files = std::min(least.files, now.files);
        }
        return least;
    };
    const Held early = heldAtFrame(10), middle = heldAtFrame(half), late = heldAtFrame(last);
    const CommandResult result = run.wait();
    ASSERT_EQ(result.exit_code, 0) << result.err;
    ASSERT_GT(early.resident, 0U);
    ASSERT_GT(late.resident, 0U);
    std::printf(
        "resident after 10, %d and %d frames: %.1f, %.1f, %.1f MB; open files: %zu, %zu, %zu\n",
        half, last, static_cast<double>(early.resident) * 1e-6,
        static_cast<double>(middle.resident) * 1e-6, static_cast<double>(late.resident) * 1e-6,
        early.files, middle.files, late.files);
    EXPECT_EQ(late.files, early.files);
    if (!kShadowMemory) {
        EXPECT_LT(late.resident, early.resident + (8U << 20));
    }
}

/// Frames 1 to 4 must have the same bytes under other conditions.
TEST(Anywhere, TheSameBytes) {
    const ScratchDir scratch;
    const auto folder = [&](const std::string& name) {
        const fs::path path = scratch / name;
        fs::create_directory(path);
        return path;
    };
    const fs::path reference = folder("reference");
    ASSERT_EQ(runPeelerProcess(animation("1-4", reference, {"--threads", "2"})).exit_code, 0);
    const Files expected = filesIn(reference);
    ASSERT_EQ(expected.size(), 4U);

    const fs::path one_thread = folder("one thread");
    ASSERT_EQ(runPeelerProcess(animation("1-4", one_thread, {"--threads", "1"})).exit_code, 0);
    EXPECT_EQ(filesIn(one_thread), expected);

    const fs::path processes = folder("a process a frame, last first");
    for (const char* frame : {"4", "3", "2", "1"})
        ASSERT_EQ(runPeelerProcess(animation(frame, processes)).exit_code, 0);
    EXPECT_EQ(filesIn(processes), expected);

    // Builds the German locale, because Debian installs none by default.
    const fs::path locales = folder("locales");
    const CommandResult made =
        runCommand({"localedef", "-i", "de_DE", "-f", "UTF-8", (locales / "de_DE.UTF-8").string()});
    if (!fs::exists(locales / "de_DE.UTF-8")) {
        std::printf("not with a German locale: localedef says %s\n", made.err.c_str());
    } else {
        const fs::path german = folder("german");
        const std::vector<std::string> environment{"LOCPATH=" + locales.string(),
                                                   "LANG=de_DE.UTF-8", "LC_ALL=de_DE.UTF-8"};
        // Checks that the locale is in effect.
        EXPECT_EQ(runCommand({"printf", "%.1f", "1,5"}, environment).out, "1,5");
        ASSERT_EQ(runPeelerProcess(animation("1-4", german), environment).exit_code, 0);
        EXPECT_EQ(filesIn(german), expected);
    }

    const fs::path elsewhere = folder("elsewhere");
    ASSERT_EQ(runPeelerProcess(animation("1-4", "."), {"TZ=Asia/Kathmandu", "HOME=/nonexistent"},
                               elsewhere)
                  .exit_code,
              0);
    EXPECT_EQ(filesIn(elsewhere), expected);

    // The scene is in another folder, with a relative path.
    const fs::path moved = folder("moved");
    fs::copy_file(sourceDir() / "examples" / "scenes" / "jellyfish.glb", moved / "jellyfish.glb");
    std::vector<std::string> here = animation("1-4", ".");
    here[1] = "jellyfish.glb";
    ASSERT_EQ(runPeelerProcess(here, {}, moved).exit_code, 0);
    fs::remove(moved / "jellyfish.glb");
    EXPECT_EQ(filesIn(moved), expected);
}

}  // namespace
}  // namespace peeler::test
