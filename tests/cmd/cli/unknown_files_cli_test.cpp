// SPDX-License-Identifier: Apache-2.0
// Tests that a path that cannot be examined is reported before any work, and is neither replaced
// nor skipped. Such paths are below a symbolic link to itself, which not even root can follow.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cmd/batch/batch_jobs.h"
#include "cmd/tiny_gltf.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

class UnknownFiles : public testing::Test {
  protected:
    UnknownFiles() { fs::create_symlink("loop", scratch_ / "loop"); }

    std::string below(const char* name) const { return (scratch_ / "loop" / name).string(); }
    void expectRefused(const std::vector<std::string>& line, int exit_code) const {
        const Outcome result = runPeeler(line);
        EXPECT_EQ(result.exit_code, exit_code) << result.err;
        EXPECT_TRUE(contains(result.err, "cannot examine the path")) << result.err;
        EXPECT_TRUE(contains(result.err, (scratch_ / "loop").string())) << result.err;
        EXPECT_TRUE(contains(result.err, "hint: the symbolic links in the path")) << result.err;
    }

    ScratchDir scratch_;
    std::string scene_ = writeScene(scratch_.path()).string();
};

TEST_F(UnknownFiles, AreNotReplaced) {
    expectRefused({"render", scene_, "-o", below("a.exr"), "--no-clobber"}, 4);
    expectRefused({"sheet", scene_, "-o", below("a.png"), "--no-clobber"}, 4);
    expectRefused({"render", scene_, "-o", below("s-%06d.tar"), "--skip-existing"}, 4);
    expectRefused({"render", scene_, "-o", below("a.exr"), "--dry-run"}, 4);
}

TEST_F(UnknownFiles, FoldersAreNotCalledMissing) {
    expectRefused({"render", scene_, "-o", below("a.exr")}, 4);
    expectRefused({"render", scene_, "-o", below("a.exr"), "--no-mkdir"}, 4);
    expectRefused({"masks", scene_, "-o", below("masks"), "--no-mkdir"}, 4);
}

TEST_F(UnknownFiles, ScenesAreNotTakenForPatterns) {
    const std::string out = (scratch_ / "{stem}.exr").string();
    expectRefused({"render", below("a[1].gltf"), "-o", out}, 3);
}

TEST_F(UnknownFiles, JobsAreNotDoneAgain) {
    const auto run = [&](const std::string& output) {
        const std::string line =
            nlohmann::json{{"verb", "render"}, {"args", {scene_, "-o", output}}}.dump();
        const std::string hash = cmd::readJobs("jobs", line).at(0).hash;
        writeText(scratch_ / "jobs.jsonl", line);
        writeText(scratch_ / "report.jsonl", R"({"job":1,"verb":"render","hash":")" + hash +
                                                 R"(","exitCode":0,"milliseconds":1})" + '\n');
        return std::vector<std::string>{"batch", (scratch_ / "jobs.jsonl").string(), "--report",
                                        (scratch_ / "report.jsonl").string(), "--dry-run"};
    };
    const Outcome gone = runPeeler(run((scratch_ / "a.exr").string()));
    EXPECT_EQ(gone.exit_code, 0) << gone.err;
    EXPECT_TRUE(contains(gone.err, "its output is missing")) << gone.err;
    expectRefused(run(below("a.exr")), 4);
    expectRefused({"batch", (scratch_ / "jobs.jsonl").string(), "--report", below("report.jsonl"),
                   "--dry-run"},
                  4);
}

}  // namespace
}  // namespace peeler::test
