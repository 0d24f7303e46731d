// SPDX-License-Identifier: Apache-2.0
// Tests commands that start with closed standard streams, as by `2>&-`.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

using Words = std::vector<std::string>;

class ClosedStreams : public testing::TestWithParam<const char*> {
  protected:
    CommandResult run(const Words& arguments) const {
        const std::string script = std::string(R"(exec "$0" "$@" )") + GetParam();
        Words command{"sh", "-c", script, peelerBinary().string()};
        command.insert(command.end(), arguments.begin(), arguments.end());
        return runCommand(command, {}, scratch_.path());
    }

    const ScratchDir scratch_;
    const std::string scene_ = writeScene(scratch_.path(), stackScene(3)).string();
    const std::string alone_ = (scratch_ / "alone.png").string();
};

/// A regression test: the second of two frames used to contain messages of the first.
TEST_P(ClosedStreams, ArePartOfNoOutput) {
    ASSERT_EQ(runPeeler({"render", scene_, "-o", scratch_ / "as.##.png", "--frames", "1-3",
                         "--size", "32x18"})
                  .exit_code,
              0);
    const CommandResult frames = run({"render", scene_, "-o", "f.##.png", "--frames", "1-3",
                                      "--size", "32x18", "--verbose", "--progress", "plain"});
    EXPECT_EQ(frames.exit_code, 0) << frames.err;
    for (const std::string frame : {".01.png", ".02.png", ".03.png"})
        EXPECT_TRUE(bytesOf(scratch_ / ("f" + frame)) == bytesOf(scratch_ / ("as" + frame)))
            << frame;
}

/// A batch must start jobs with pipes as streams, even if its own streams are closed.
TEST_P(ClosedStreams, AreNotThoseOfJobs) {
    ASSERT_EQ(runPeeler({"render", scene_, "-o", alone_, "--size", "32x18"}).exit_code, 0);
    const Json job{
        {"verb", "render"}, {"args", {scene_, "-o", "job.png"}}, {"options", {{"size", "32x18"}}}};
    writeText(scratch_ / "jobs.jsonl", job.dump() + "\n");
    const CommandResult batch = run({"batch", "jobs.jsonl", "--report", "report.jsonl"});
    EXPECT_TRUE(bytesOf(scratch_ / "job.png") == bytesOf(alone_)) << batch.err;
    EXPECT_TRUE(contains(bytesOf(scratch_ / "report.jsonl"), R"("exitCode":0)"));
}

INSTANTIATE_TEST_SUITE_P(Each, ClosedStreams,
                         testing::Values("<&-", ">&-", "2>&-", "<&- 2>&-", "<&- >&- 2>&-"));

/// A command must report an error if its output was requested on a closed stream.
TEST(ClosedStandardOutput, IsAnErrorWhereItIsNeeded) {
    const ScratchDir scratch;
    const std::string scene = writeScene(scratch.path(), stackScene(3)).string();
    for (const char* words : {"info", "render -o - --size 32x18", "render -o a.png --json"}) {
        const CommandResult run =
            runCommand({"sh", "-c", std::string(R"(exec "$0" )") + words + " \"$1\" >&-",
                        peelerBinary(), scene},
                       {}, scratch.path());
        EXPECT_EQ(run.exit_code, 4) << words << ": " << run.err;
        EXPECT_TRUE(contains(run.err, "Bad file descriptor")) << run.err;
    }
}

}  // namespace
}  // namespace peeler::test
