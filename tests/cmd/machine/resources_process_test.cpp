// SPDX-License-Identifier: Apache-2.0
// Tests threads, memory and devices under a scheduler. support/fake_egl simulates the GPUs.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cmd/machine/limits.h"
#include "cmd/machine/resources.h"
#include "cmd/tiny_gltf.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;
using Strings = std::vector<std::string>;

/// Returns an environment without the settings of a scheduler that may run the tests.
Strings with(const Strings& more) {
    // `more` comes first, because the first occurrence of a name counts.
    Strings environment = more;
    for (const char* name : {"SLURM_CPUS_PER_TASK=", "SLURM_MEM_PER_NODE=", "SLURM_MEM_PER_CPU=",
                             "CUE_THREADS=", "CUE_MEMORY="})
        environment.emplace_back(name);
    return environment;
}

class Resources : public testing::Test {
  protected:
    CommandResult render(const Strings& more, const Strings& environment) const {
        Strings arguments = {"render", scene_.string(), "-o",     image_.string(),
                             "--size", "64x64",         "--json", "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return runPeelerProcess(arguments, with(environment));
    }

    ScratchDir scratch_;
    fs::path scene_ = writeScene(scratch_.path(), stackScene(3));
    fs::path image_ = scratch_ / "out.exr";
};

Json machine(const Strings& environment) {
    return Json::parse(runPeelerProcess({"devices", "--json"}, with(environment)).out);
}

TEST_F(Resources, MemoryThatASchedulerGivesIsKeptAndNamed) {
    const CommandResult tight = render({}, {"CUE_MEMORY=102400"});
    EXPECT_EQ(tight.exit_code, 33) << tight.err;
    EXPECT_NE(tight.err.find("CUE_MEMORY allows 100M"), std::string::npos) << tight.err;
    EXPECT_NE(tight.err.find("the memory budget is 88M"), std::string::npos) << tight.err;
    EXPECT_EQ(tight.err.find(": --memory"), std::string::npos) << "nobody gave it: " << tight.err;
    EXPECT_FALSE(fs::exists(image_));
    EXPECT_EQ(render({"--memory", "2G"}, {"CUE_MEMORY=102400"}).exit_code, 0) << "it wins";
    EXPECT_EQ(render({}, {"SLURM_MEM_PER_NODE=2048"}).exit_code, 0);
}

TEST_F(Resources, ALimitChangesNoByte) {
    ASSERT_EQ(render({}, {}).exit_code, 0);
    const std::string expected = bytesOf(image_);
    ASSERT_EQ(render({}, {"SLURM_MEM_PER_NODE=800", "SLURM_CPUS_PER_TASK=1"}).exit_code, 0);
    EXPECT_TRUE(bytesOf(image_) == expected);
}

TEST(Devices, TellWhatTheMachineAllows) {
    const Json json = machine({"CUE_MEMORY=1048576", "CUE_THREADS=1"});
    EXPECT_EQ(json.at("threads").at("count"), 1);
    EXPECT_LE(json.at("memory").at("bytes"), 1U << 30);
    EXPECT_LE(json.at("memory").at("budget"), 896U << 20);
    EXPECT_FALSE(json.at("memory").at("source").get<std::string>().empty());
}

/// A child of our own cgroup, if the machine permits one. The destructor removes it.
class RealCgroup {
  public:
    explicit RealCgroup(const fs::path& parent)
        : folder_(parent / ("peeler-test-" + std::to_string(getpid()))) {
        std::error_code failure;
        made_ = fs::create_directory(folder_, failure);
    }
    ~RealCgroup() {
        if (made_) rmdir(folder_.c_str());
    }
    RealCgroup(const RealCgroup&) = delete;
    RealCgroup& operator=(const RealCgroup&) = delete;

    bool write(const std::string& file, const std::string& text) const {
        if (!made_ || !fs::exists(folder_ / file)) return false;
        std::ofstream stream(folder_ / file);
        stream << text << std::flush;
        return stream.good();
    }
    std::string file(const std::string& name) const { return folder_ / name; }
    CommandResult run(const std::string& command) const {
        return runCommand(
            {"sh", "-c", "echo $$ > '" + file("cgroup.procs") + "' && exec " + command}, with({}));
    }

  private:
    fs::path folder_;
    bool made_ = false;
};

TEST(RealCgroups, LimitProcessors) {
    for (const char* controller : {"", "cpu"}) {
        const auto groups = cmd::Cgroups("/").of(controller);
        if (groups.empty()) continue;
        const RealCgroup group(groups.front().folder);
        const bool limited = *controller == '\0' ? group.write("cpu.max", "50000 100000")
                                                 : group.write("cpu.cfs_quota_us", "50000");
        if (!limited) continue;
        const CommandResult run = group.run("'" + peelerBinary().string() + "' devices --json");
        ASSERT_EQ(run.exit_code, 0) << run.err;
        const Json threads = Json::parse(run.out).at("threads");
        EXPECT_EQ(threads.at("count"), 1);
        std::printf("%s\n", threads.at("source").get<std::string>().c_str());
        return;
    }
    GTEST_SKIP() << "no cgroup of a CPU controller may be made here (root and a writable one)";
}

/// Runs commands with a limit for processes and threads, including the command itself.
class FewThreads : public testing::TestWithParam<const char*> {
  protected:
    void SetUp() override {
        if (geteuid() != 0) GTEST_SKIP() << "only root has others to be, and may make cgroups";
        fs::permissions(scratch_.path(), fs::perms::all);
        if (run(20, {"--version"}).exit_code != 0)
            GTEST_SKIP() << "nobody else may run the program, or there is no cgroup of this kind";
    }
    CommandResult run(int most, const Strings& arguments, const Strings& environment = {}) const {
        const std::string limit = std::to_string(most);
        Strings command{"prlimit", "--nproc=" + limit, "setpriv", "--reuid=" + user_,
                        "--clear-groups"};
        std::optional<RealCgroup> group;
        if (GetParam() == std::string("pids.max")) {
            const auto groups = cmd::Cgroups("/").of("pids");
            if (groups.empty()) return {};
            group.emplace(groups.front().folder);
            if (!group->write("pids.max", limit)) return {};
            command = {"sh", "-c", R"(echo $$ > "$0" && exec "$@")", group->file("cgroup.procs")};
        }
        command.push_back(peelerBinary());
        command.insert(command.end(), arguments.begin(), arguments.end());
        return runCommand(command, with(environment), scratch_.path());
    }
    CommandResult render(int most, const Strings& more, const Strings& environment = {}) const {
        Strings arguments{"render", scene_, "-o", "out.exr", "--size", "64x36"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(most, arguments, environment);
    }

    ScratchDir scratch_;
    const std::string scene_ = writeScene(scratch_.path(), stackScene(3)).string();
    const fs::path out_ = scratch_ / "out.exr";
    // A user without other processes.
    const std::string user_ = std::to_string(50000 + getpid() % 10000);
};

/// This is a regression test: the driver used to hang.
TEST_P(FewThreads, AreAnErrorWhereThereAreNone) {
    for (const char* backend : {"egl", "osmesa"}) {
        const CommandResult none = render(1, {"--backend", backend, "--threads", "2"});
        EXPECT_EQ(none.exit_code, 33) << none.err;
        EXPECT_TRUE(contains(none.err, "cannot start a thread")) << none.err;
        EXPECT_FALSE(fs::exists(out_));
    }
    const CommandResult rays =
        run(1, {"rays", scene_, "-o", "a.npz", "--engine", "cpu", "--axes", "--resolution", "16"});
    EXPECT_EQ(rays.exit_code, 0) << "it needs none: " << rays.err;
    const CommandResult devices = run(1, {"devices"});
    EXPECT_TRUE(contains(devices.out, "cannot start a thread")) << devices.out << devices.err;
}

TEST_P(FewThreads, AreEnoughForTheSameFile) {
    ASSERT_EQ(render(100, {"--threads", "4"}, {"LP_NUM_THREADS="}).exit_code, 0);
    const std::string expected = bytesOf(out_);
    for (const int most : {2, 3, 4, 5, 7, 9, 12, 15}) {
        fs::remove(out_);
        const CommandResult few = render(most, {"--threads", "4"});
        EXPECT_EQ(few.exit_code, 0) << most << ": " << few.err;
        EXPECT_TRUE(bytesOf(out_) == expected) << most;
    }
}

TEST_P(FewThreads, AreNotFewerThanTheUserSays) {
    const CommandResult few = render(3, {}, {"LP_NUM_THREADS=4"});
    EXPECT_EQ(few.exit_code, 33) << few.err;
    EXPECT_TRUE(contains(few.err, "of the 4 threads of the software rasteriser")) << few.err;
    EXPECT_TRUE(contains(few.err, "LP_NUM_THREADS to a smaller number")) << few.err;
}

INSTANTIATE_TEST_SUITE_P(Limited, FewThreads, testing::Values("ulimit -u", "pids.max"));

class FakeGpus : public Resources {
  protected:
    static Strings gpus(const Strings& more) {
        Strings environment = {"LD_LIBRARY_PATH=" + fakeEglDir().string(),
                               "PEELER_FAKE_EGL_DEVICES=3"};
        environment.insert(environment.end(), more.begin(), more.end());
        return environment;
    }
    /// Returns the renderer recorded in the picture, or the exit code.
    std::string rendererOf(const Strings& options, const Strings& variables) const {
        const CommandResult run = render(options, gpus(variables));
        if (run.exit_code != 0) return std::to_string(run.exit_code);
        return Json::parse(run.out).at("renderer");
    }
};

TEST_F(FakeGpus, AreChosenByNumberCudaNumberOrUuid) {
    EXPECT_EQ(rendererOf({}, {}), "Fake GPU 0");
    EXPECT_EQ(rendererOf({"--device", "1"}, {}), "Fake GPU 1");
    EXPECT_EQ(rendererOf({"--device", "cuda:0"}, {}), "Fake GPU 2");
    EXPECT_EQ(rendererOf({"--device", "uuid:GPU-abcd01"}, {}), "Fake GPU 1");
    for (const char* missing : {"cuda:3", "uuid:ffff", "99", "uuid:abcd"}) {
        const CommandResult run = render({"--device", missing}, gpus({}));
        EXPECT_EQ(run.exit_code, 5) << missing;
        EXPECT_NE(run.err.find("cuda:2, uuid:abcd0000-0000-"), std::string::npos) << run.err;
    }
}

TEST_F(FakeGpus, ThatCudaHidesAreNotUsed) {
    for (const char* remaps : {"", "1"}) {
        const std::string driver = std::string("PEELER_FAKE_EGL_REMAPS=") + remaps;
        EXPECT_EQ(rendererOf({}, {driver, "CUDA_VISIBLE_DEVICES=0"}), "Fake GPU 2");
        EXPECT_EQ(rendererOf({"--device", "cuda:0"}, {driver, "CUDA_VISIBLE_DEVICES=1,2"}),
                  "Fake GPU 1");
        EXPECT_EQ(rendererOf({"--device", "cuda:1"}, {driver, "CUDA_VISIBLE_DEVICES=1,2"}),
                  "Fake GPU 0");
        EXPECT_EQ(rendererOf({"--device", "0"}, {driver, "CUDA_VISIBLE_DEVICES=0"}), "5");
        EXPECT_EQ(rendererOf({"--require-gpu"}, {driver, "CUDA_VISIBLE_DEVICES=-1"}), "5");
        EXPECT_EQ(rendererOf({"--require-gpu"}, {driver, "CUDA_VISIBLE_DEVICES="}), "5");
    }
    EXPECT_EQ(rendererOf({}, {"CUDA_VISIBLE_DEVICES=GPU-abcd01"}), "Fake GPU 1");
    EXPECT_EQ(rendererOf({}, {"CUDA_VISIBLE_DEVICES="}).find("Fake"), std::string::npos)
        << "software, as without a GPU";
}

/// A batch passes CUDA_VISIBLE_DEVICES on to the commands that it starts.
TEST_F(FakeGpus, ThatCudaHidesAreNotUsedByJobs) {
    const fs::path jobs = scratch_ / "jobs.jsonl";
    const Json job{{"verb", "render"},
                   {"args", Json::array({scene_.string(), "-o", image_.string()})}};
    std::ofstream(jobs) << job << '\n';
    const CommandResult run = runPeelerProcess({"batch", jobs.string(), "--quiet"},
                                               with(gpus({"CUDA_VISIBLE_DEVICES=0"})));
    ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
    EXPECT_NE(run.out.find("Fake GPU 2"), std::string::npos) << run.out;
}

/// A GPU finds the hits of rays if there is one, otherwise the CPU.
TEST_F(FakeGpus, FindHits) {
    const auto found = [&](const Strings& options, const Strings& variables) {
        Strings arguments = {"rays",   scene_.string(), "-o", (scratch_ / "a.npz").string(),
                             "--axes", "--resolution",  "16", "--json",
                             "--quiet"};
        arguments.insert(arguments.end(), options.begin(), options.end());
        const CommandResult run = runPeelerProcess(arguments, with(gpus(variables)));
        EXPECT_EQ(run.exit_code, 0) << run.err;
        const Json json = Json::parse(run.out);
        return json.at("engine").get<std::string>() + ' ' + json.at("renderer").get<std::string>();
    };
    EXPECT_EQ(found({}, {}), "gl Fake GPU 0");
    EXPECT_EQ(found({}, {"PEELER_FAKE_EGL_FORBIDDEN=0"}), "gl Fake GPU 1");
    EXPECT_EQ(found({"--require-gpu"}, {"CUDA_VISIBLE_DEVICES=0"}), "gl Fake GPU 2");
    EXPECT_EQ(found({"--engine", "cpu"}, {}), "cpu ");
    const std::string hidden = found({}, {"CUDA_VISIBLE_DEVICES="});
    EXPECT_EQ(hidden.find("Fake"), std::string::npos);
    if (hidden.starts_with("gl")) GTEST_SKIP() << "this machine has a GPU: " << hidden;
    EXPECT_EQ(hidden, "cpu ");
}

/// The fake EGL ends the process if the attributes of the forbidden GPU are read.
TEST_F(FakeGpus, OfOthersAreLeftAlone) {
    EXPECT_EQ(rendererOf({}, {"PEELER_FAKE_EGL_FORBIDDEN=0"}), "Fake GPU 1");
    const CommandResult run =
        runPeelerProcess({"devices", "--json"}, gpus({"CUDA_VISIBLE_DEVICES=1,0"}));
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const Json devices = Json::parse(run.out).at("devices");
    EXPECT_FALSE(devices.at(0).at("usable"));
    EXPECT_NE(devices.at(0).at("problem").get<std::string>().find("CUDA_VISIBLE_DEVICES (1,0)"),
              std::string::npos);
    EXPECT_EQ(devices.at(0).at("renderer"), "") << "it was not opened";
    EXPECT_EQ(devices.at(1).at("cuda"), 0);
    EXPECT_EQ(devices.at(2).at("cuda"), 1);
    EXPECT_EQ(devices.at(2).at("uuid"), "abcd0200-0000-0000-0000-000000000000");
}

TEST_F(FakeGpus, ThatAreLostForGoodAreExitCode5) {
    const CommandResult run = render({}, gpus({"PEELER_FAKE_EGL_LOST=1+"}));
    EXPECT_EQ(run.exit_code, 5);
    EXPECT_NE(run.err.find("context was lost"), std::string::npos) << run.err;
    EXPECT_FALSE(fs::exists(image_));
}

}  // namespace
}  // namespace peeler::test
