// SPDX-License-Identifier: Apache-2.0
// Tests peeler batch: order, overlap, and the state after a batch or a job was killed.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "support/test_support.h"

extern char** environ;

namespace peeler::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Strings = std::vector<std::string>;

/// Waits until `done` returns true. Returns false on a timeout.
bool waitUntil(const std::function<bool()>& done) {
    for (const auto end = Clock::now() + 5min; Clock::now() < end;) {
        if (done()) return true;
        std::this_thread::sleep_for(5ms);
    }
    return false;
}

/// A scene file, empty at first, with a lease on it (fcntl(2)): a reader's open() waits until the
/// lease is released, or for the 45 seconds of /proc/sys/fs/lease-break-time.
class Gate {
  public:
    explicit Gate(fs::path path)
        : path_(std::move(path)), file_(open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)) {
        std::signal(SIGIO, SIG_IGN);  // ignores SIGIO, which the kernel sends when a reader waits
        EXPECT_EQ(fcntl(file_, F_SETLEASE, F_WRLCK), 0) << std::strerror(errno);
    }
    /// Whether a reader waits to open the file.
    bool reader() const { return fcntl(file_, F_GETLEASE) != F_WRLCK; }
    /// Replaces the file by this scene and releases the lease. Only later readers get the scene.
    void replaceBy(const fs::path& scene) {
        const fs::path other = path_.string() + ".new";
        fs::copy_file(scene, other);
        fs::rename(other, path_);
        release();
    }
    void release() { fcntl(file_, F_SETLEASE, F_UNLCK); }
    ~Gate() { close(file_); }
    Gate(const Gate&) = delete;
    Gate& operator=(const Gate&) = delete;

  private:
    fs::path path_;
    int file_;
};

/// Returns the ID of a process's only child; "" if the kernel does not list children
/// (CONFIG_PROC_CHILDREN).
std::string childOf(pid_t process) {
    const std::string number = std::to_string(process);
    const std::string all = bytesOf("/proc/" + number + "/task/" + number + "/children");
    return all.substr(0, all.find(' '));
}

std::vector<Json> linesOf(const std::string& text) {
    std::vector<Json> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);)
        lines.push_back(Json::parse(line));
    return lines;
}

std::vector<int> codesOf(const std::vector<Json>& lines) {
    std::vector<int> codes;
    for (const Json& line : lines)
        codes.push_back(line.at("exitCode"));
    return codes;
}

class Batch : public testing::Test {
  protected:
    Batch() {
        // A shell's background jobs ignore SIGINT, and the test's children would inherit that.
        std::signal(SIGINT, SIG_DFL);
    }
    Json job(const std::string& output, const std::string& scene = "") const {
        return {{"verb", "render"},
                {"args", {scene.empty() ? scene_.string() : path(scene), "-o", path(output)}},
                {"options", {{"size", "32x32"}}}};
    }
    std::string path(const std::string& name) const { return (scratch_ / name).string(); }
    void write(const std::vector<Json>& jobs) const {
        std::ofstream file(jobs_);
        for (const Json& each : jobs)
            file << each.dump() << '\n';
    }
    CommandResult run(const Strings& more = {}, const Strings& environment = {}) const {
        Strings arguments = {"batch", jobs_.string(), "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return runPeelerProcess(arguments, environment);
    }
    /// Starts the batch without waiting for it.
    pid_t start(const Strings& more) const {
        Strings arguments = {"peeler", "batch", jobs_.string(), "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        std::vector<char*> pointers;
        for (const std::string& argument : arguments)
            pointers.push_back(const_cast<char*>(argument.c_str()));
        pointers.push_back(nullptr);
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        const std::string out = path("out");
        posix_spawn_file_actions_addopen(&actions, 1, out.c_str(), O_WRONLY | O_CREAT, 0600);
        posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", O_WRONLY, 0);
        pid_t process = 0;
        const int failed = posix_spawn(&process, peelerBinary().c_str(), &actions, nullptr,
                                       pointers.data(), environ);
        posix_spawn_file_actions_destroy(&actions);
        return failed ? -1 : process;
    }
    static int waitFor(pid_t process) {
        int status = 0;
        waitpid(process, &status, 0);
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    std::vector<Json> report() const { return linesOf(bytesOf(report_)); }

    ScratchDir scratch_;
    fs::path scene_ = writeScene(scratch_.path(), stackScene(3));
    fs::path jobs_ = scratch_ / "jobs.jsonl";
    fs::path report_ = scratch_ / "results.jsonl";
};

TEST_F(Batch, ResultsAreTheVerbsOwnInTheOrderOfTheLines) {
    Json first = job("a.exr");
    first["id"] = "first";
    const Json third = {{"verb", "extract"},
                        {"args", {path("there.exr"), "--points", path("points.ply")}}};
    const Json fourth = {{"verb", "rays"},
                         {"args", {scene_.string()}},
                         {"options",
                          {{"output", path("hits.npz")},
                           {"direction", {"0,0,1", "1,0,0"}},
                           {"resolution", 8},
                           {"double", false}}}};
    write({job("there.exr")});
    ASSERT_EQ(run().exit_code, 0);
    write({first, job("b.exr", "missing.gltf"), third, fourth});
    const CommandResult result = run();
    EXPECT_EQ(result.exit_code, 3) << "the greatest: " << result.err;
    const auto lines = linesOf(result.out);
    ASSERT_EQ(codesOf(lines), (std::vector{0, 3, 0, 0})) << result.err;
    EXPECT_EQ(lines[0].at("id"), "first");
    EXPECT_EQ(lines[0].at("job"), 1);
    EXPECT_EQ(lines[0].at("result").at("layers"), 3);
    EXPECT_NE(lines[1].at("error").at("what").get<std::string>().find("missing.gltf"),
              std::string::npos);
    EXPECT_FALSE(lines[1].at("error").at("hint").empty());
    EXPECT_EQ(lines[3].at("result").at("bundles"), 2);
    EXPECT_NE(result.err.find("peeler: error: job 2: "), std::string::npos) << result.err;
    EXPECT_TRUE(fs::exists(path("points.ply")));
}

TEST_F(Batch, JobsOverlap) {
    Gate one(path("one.gltf")), two(path("two.gltf"));
    write({job("1.exr", "one.gltf"), job("2.exr", "two.gltf")});
    const pid_t batch = start({"--jobs", "2"});
    EXPECT_TRUE(waitUntil([&] { return one.reader(); }));
    EXPECT_TRUE(waitUntil([&] { return two.reader(); })) << "only one runs at a time";
    one.replaceBy(scene_);
    two.replaceBy(scene_);
    waitFor(batch);
    EXPECT_EQ(linesOf(bytesOf(path("out"))).size(), 2U);
}

TEST_F(Batch, AJobThatEndsFirstIsOnDiskFirstAndPrintedInItsPlace) {
    Gate slow(path("slow.gltf"));
    write({job("1.exr", "slow.gltf"), job("2.exr")});
    const pid_t batch = start({"--jobs", "2", "--report", report_.string()});
    EXPECT_TRUE(waitUntil([&] { return slow.reader(); }));
    EXPECT_TRUE(waitUntil([&] { return bytesOf(report_).ends_with("\n"); }));
    EXPECT_EQ(report().at(0).at("job"), 2);
    EXPECT_EQ(bytesOf(path("out")), "") << "it is not its turn";
    slow.replaceBy(scene_);
    waitFor(batch);
    for (const auto& lines : {linesOf(bytesOf(path("out"))), report()}) {
        ASSERT_EQ(lines.size(), 2U);
        EXPECT_EQ(lines[0].at("job"), 1);
        EXPECT_EQ(lines[1].at("job"), 2);
    }
}

TEST_F(Batch, ThatIsKilledLeavesNoOrphanAndResumes) {
    Gate gate(path("gate.gltf"));
    write({job("1.exr"), job("2.exr", "gate.gltf"), job("3.exr")});
    const pid_t batch = start({"--report", report_.string()});
    EXPECT_TRUE(waitUntil([&] { return gate.reader(); }));
    const auto waits = Clock::now();
    const std::string child = childOf(batch);
    kill(batch, SIGKILL);
    EXPECT_EQ(waitFor(batch), 137);
    // The gate stays closed, so without the kill the job would wait until the lease expires. An
    // ended process has no command line, even if no process reaps it (as in some containers).
    EXPECT_TRUE(
        waitUntil([&] { return child.empty() || bytesOf("/proc/" + child + "/cmdline").empty(); }));
    EXPECT_LT(Clock::now() - waits, 40s) << "the job runs without its batch";
    gate.release();
    ASSERT_EQ(report().size(), 1U);
    std::ofstream(report_, std::ios::app) << R"({"job":2,"verb":"render","ha)";
    std::ofstream(path("1.exr"), std::ios::app) << "mark";
    fs::remove(path("gate.gltf"));
    fs::copy_file(scene_, path("gate.gltf"));
    const CommandResult again = run({"--report", report_.string()});
    EXPECT_EQ(again.exit_code, 0) << again.err;
    EXPECT_EQ(codesOf(linesOf(again.out)), (std::vector{0, 0, 0})) << "the whole list";
    EXPECT_EQ(linesOf(again.out), report());
    EXPECT_TRUE(bytesOf(path("1.exr")).ends_with("mark")) << "done before, and done again";
    EXPECT_TRUE(fs::exists(path("3.exr")));
}

TEST_F(Batch, ThatIsTerminatedEndsItsJobs) {
    for (const int number : {SIGTERM, SIGINT}) {
        const fs::path out = scratch_ / ("pictures" + std::to_string(number));
        fs::create_directory(out);
        const fs::path scene = scratch_ / "tall";
        fs::create_directories(scene);
        Json large = job((out / "large.exr").filename(), "");
        large["args"] = {writeScene(scene, stackScene(60)).string(), "-o",
                         (out / "large.exr").string()};
        large["options"] = {{"size", "1024x1024"}, {"memory", "600M"}};
        write({job("done.exr"), large});
        fs::remove(report_);
        const pid_t batch = start({"--report", report_.string()});
        EXPECT_TRUE(waitUntil([&] {
            for (const auto& entry : fs::directory_iterator(out))
                if (std::error_code gone; entry.file_size(gone) > 0 && !gone) return true;
            return false;
        }));
        kill(batch, number);
        EXPECT_EQ(waitFor(batch), 128 + number);
        EXPECT_TRUE(fs::is_empty(out)) << "a temporary file was left behind";
        EXPECT_EQ(codesOf(report()), std::vector{0}) << "what was done is on disk";
    }
}

TEST_F(Batch, AJobThatIsKilledTakesNoOtherWithIt) {
    Gate gate(path("gate.gltf"));
    write({job("1.exr", "gate.gltf"), job("2.exr")});
    const pid_t batch = start({});
    EXPECT_TRUE(waitUntil([&] { return gate.reader(); }));
    const std::string child = childOf(batch);
    if (child.empty()) {
        gate.replaceBy(scene_);
        waitFor(batch);
        GTEST_SKIP() << "the kernel does not list children (CONFIG_PROC_CHILDREN)";
    }
    kill(std::stoi(child), SIGKILL);
    EXPECT_EQ(waitFor(batch), 137);
    const auto lines = linesOf(bytesOf(path("out")));
    ASSERT_EQ(codesOf(lines), (std::vector{137, 0}));
    EXPECT_EQ(lines[0].at("error").at("what"), "ended by signal 9 (Killed)");
}

TEST_F(Batch, FailFastStartsNothingAfterAFailure) {
    write({job("1.exr", "missing.gltf"), job("2.exr")});
    const CommandResult fast = run({"--fail-fast"});
    EXPECT_EQ(fast.exit_code, 3);
    EXPECT_EQ(codesOf(linesOf(fast.out)), std::vector{3});
    EXPECT_FALSE(fs::exists(path("2.exr")));
}

TEST_F(Batch, MemoryIsSharedAndItsEndPassedOn) {
    write({job("1.exr"), job("2.exr")});
    EXPECT_EQ(run({"--memory", "200M", "--jobs", "2"}).exit_code, 33);
    const CommandResult none = run({"--memory", "100M", "--jobs", "2"});
    EXPECT_EQ(none.exit_code, 33);
    EXPECT_EQ(none.out, "") << "50M are too little for anything: " << none.err;
    const CommandResult plan =
        run({"--dry-run", "--memory", "3G", "--threads", "6", "--jobs", "2"});
    ASSERT_EQ(plan.exit_code, 0) << plan.err;
    const Json command = linesOf(plan.out).at(1).at("command");
    const Strings words = command;
    const Strings end(words.end() - 4, words.end());
    EXPECT_EQ(end, (Strings{"--threads", "3", "--memory", "1610612736"}));
    EXPECT_FALSE(fs::exists(path("1.exr")));
}

TEST_F(Batch, AReportOfOthersIsKept) {
    write({job("1.exr")});
    ASSERT_EQ(run({"--report", report_.string()}).exit_code, 0);
    const Json others = report().at(0);
    write({job("2.exr")});
    ASSERT_EQ(run({"--report", report_.string()}).exit_code, 0);
    ASSERT_EQ(report().size(), 2U);
    EXPECT_EQ(report().at(0), others);
    for (const std::string text : {"mine\n", "{\"a\": 1}\n", "mine"}) {
        std::ofstream(report_) << text;
        const CommandResult refused = run({"--report", report_.string()});
        EXPECT_EQ(refused.exit_code, 2) << refused.err;
        EXPECT_EQ(bytesOf(report_), text);
    }
    const CommandResult scene = run({"--report", path("2.exr")});
    EXPECT_EQ(scene.exit_code, 2) << "it is an output: " << scene.err;
}

TEST_F(Batch, AnOutputThatIsGoneIsMadeAgain) {
    write({job("1.exr"), job("2.exr")});
    ASSERT_EQ(run({"--report", report_.string()}).exit_code, 0);
    fs::remove(path("2.exr"));
    const CommandResult plan = run({"--report", report_.string(), "--dry-run"});
    EXPECT_EQ(linesOf(plan.out).at(0).at("done"), true);
    EXPECT_EQ(linesOf(plan.out).at(1).at("done"), false);
    const CommandResult again =
        runPeelerProcess({"batch", jobs_.string(), "--report", report_.string()});
    ASSERT_EQ(again.exit_code, 0);
    EXPECT_TRUE(fs::exists(path("2.exr")));
    EXPECT_NE(again.err.find("peeler: job 2 runs again: its output is missing\n"),
              std::string::npos)
        << again.err;
    EXPECT_EQ(again.err.find("job 1 "), std::string::npos) << again.err;
}

TEST_F(Batch, AJobWhoseLineHasChangedIsDoneAgain) {
    Json first = job("1.exr");
    first["id"] = "first";
    write({first});
    ASSERT_EQ(run({"--report", report_.string()}).exit_code, 0);
    first["options"]["layers"] = 1;
    write({first});
    const CommandResult again =
        runPeelerProcess({"batch", jobs_.string(), "--report", report_.string()});
    ASSERT_EQ(again.exit_code, 0) << again.err;
    EXPECT_NE(again.err.find("job 1 (first) runs again: its line has changed\n"), std::string::npos)
        << again.err;
}

TEST_F(Batch, NothingRunsUnlessEveryLineIsRight) {
    write({job("1.exr"), {{"verb", "render"}, {"scene", "a.glb"}}});
    const CommandResult result = run();
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.out, "");
    EXPECT_NE(result.err.find("jobs.jsonl, line 2"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("unknown key 'scene'"), std::string::npos) << result.err;
    EXPECT_FALSE(fs::exists(path("1.exr")));
    EXPECT_EQ(runPeelerProcess({"batch", path("none.jsonl")}).exit_code, 3);
}

}  // namespace
}  // namespace peeler::test
