// SPDX-License-Identifier: Apache-2.0
// Tests that interrupted renders leave no files.
#include <gtest/gtest.h>
#include <sys/types.h>

#include <chrono>
#include <csignal>
#include <future>
#include <string>
#include <thread>

#include "cmd/tiny_gltf.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// Waits until a temporary file contains bytes. Returns the ID of the process that writes it, which
/// is part of the file's name; 0 if the run ends without such a file.
pid_t waitForWriter(const fs::path& folder, const std::future<CommandResult>& run) {
    const std::string mark = ".peeler-";
    while (run.wait_for(10ms) != std::future_status::ready) {
        for (const auto& entry : fs::directory_iterator(folder)) {
            const std::string name = entry.path().filename();
            const std::size_t at = name.find(mark);
            std::error_code gone;
            if (at == std::string::npos || entry.file_size(gone) == 0 || gone) continue;
            // The name is .a.exr.peeler-<host>-<pid>-<n>.tmp.
            const std::size_t end = name.rfind('-');
            return static_cast<pid_t>(std::stol(name.substr(name.rfind('-', end - 1) + 1)));
        }
    }
    return 0;
}

class Signals : public testing::TestWithParam<int> {};

TEST_P(Signals, LeaveNothingBehind) {
    const int number = GetParam();
    // A shell's background jobs ignore SIGINT, and the test's children would inherit that.
    std::signal(number, SIG_DFL);
    const ScratchDir scratch;
    const fs::path out = scratch / "out";
    fs::create_directory(out);
    const fs::path scene = writeScene(scratch.path(), stackScene(60));
    // The first band is written long before the last, so the signal arrives between them.
    auto run = std::async(std::launch::async, [&] {
        return runPeelerProcess({"render", scene.string(), "-o", (out / "a.exr").string(), "--size",
                                 "2048x2048", "--memory", kShadowMemory ? "4G" : "600M"});
    });
    const pid_t writer = waitForWriter(out, run);
    if (writer > 0) kill(writer, number);
    const CommandResult result = run.get();
    ASSERT_GT(writer, 0) << result.err;
    EXPECT_EQ(result.exit_code, 128 + number) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_TRUE(fs::is_empty(out)) << "a temporary file was left behind";
}

INSTANTIATE_TEST_SUITE_P(Each, Signals, testing::Values(SIGTERM, SIGINT, SIGHUP),
                         [](const auto& each) { return "Signal" + std::to_string(each.param); });

}  // namespace
}  // namespace peeler::test
