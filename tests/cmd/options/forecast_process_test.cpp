// SPDX-License-Identifier: Apache-2.0
// Tests that nothing is written if the size of the output is certain and the disk is too small for
// it.
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <unistd.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// A file system of 256 KiB that exists during the test.
class SmallDisk : public testing::Test {
  protected:
    void SetUp() override {
        if (geteuid() != 0) GTEST_SKIP() << "only root may mount a small disk";
        fs::create_directory(disk_);
        mounted_ = mount("tmpfs", disk_.c_str(), "tmpfs", 0, "size=256k") == 0;
        if (!mounted_) GTEST_SKIP() << "this machine lets nobody mount: " << std::strerror(errno);
    }
    void TearDown() override {
        if (mounted_) umount(disk_.c_str());
    }
    std::string path(const std::string& name) const { return (disk_ / name).string(); }
    CommandResult rays(std::vector<std::string> more) const {
        more.insert(more.begin(), {"rays", glasses_, "--directions", "4"});
        return runPeelerProcess(more);
    }

    ScratchDir scratch_;
    fs::path disk_ = scratch_ / "disk";
    bool mounted_ = false;
    std::string glasses_ = sourceDir() / "examples" / "scenes" / "glasses.glb";
};

TEST_F(SmallDisk, WhatDoesNotFitIsRefusedBeforeTheFirstByte) {
    for (const char* name : {"hits.npz", "hits.ply"}) {
        for (const bool dry : {false, true}) {
            std::vector<std::string> more{"-o", path(name), "--resolution", "96"};
            if (dry) more.emplace_back("--dry-run");
            const CommandResult result = rays(more);
            EXPECT_EQ(result.exit_code, 4) << result.err;
            EXPECT_NE(result.err.find("not enough disk space: "), std::string::npos) << result.err;
            EXPECT_NE(result.err.find(" free: " + path(name)), std::string::npos) << result.err;
            EXPECT_EQ(result.out.empty(), !dry);
            EXPECT_TRUE(fs::is_empty(disk_));
        }
    }
    const std::string layers = scratch_ / "layers.exr";
    ASSERT_EQ(runPeelerProcess({"render", glasses_, "-o", layers, "--size", "160x90"}).exit_code,
              0);
    for (const char* option : {"--points", "--npz"}) {
        const std::string name = std::string(option) == "--npz" ? "a.npz" : "a.ply";
        const CommandResult result = runPeelerProcess({"extract", layers, option, path(name)});
        EXPECT_EQ(result.exit_code, 4) << result.err;
        EXPECT_NE(result.err.find("not enough disk space: "), std::string::npos) << result.err;
        EXPECT_TRUE(fs::is_empty(disk_));
    }
}

TEST_F(SmallDisk, MoreThanATenthIsAWarning) {
    const CommandResult result = rays({"-o", path("hits.npz"), "--resolution", "16", "--json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find("warning: " + path("hits.npz") + " will take "), std::string::npos)
        << result.err;
    EXPECT_NE(result.err.find(" % of the 262.1 kB free there."), std::string::npos) << result.err;
    EXPECT_EQ(Json::parse(result.out).at("forecastBytes"), fs::file_size(path("hits.npz")));
}

TEST_F(SmallDisk, WhatTakesLessAtMostIsWritten) {
    // The layers fit the disk only because they are compressed.
    const CommandResult result = runPeelerProcess(
        {"render", glasses_, "-o", path("a.exr"), "--size", "128x72", "--json", "--layers", "6"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find("will take at most "), std::string::npos) << result.err;
    const Json json = Json::parse(result.out);
    EXPECT_GT(json.at("forecastBytes").get<std::uint64_t>(), 262'144U);
    EXPECT_LT(json.at("bytes").get<std::uint64_t>(), 262'144U);
}

}  // namespace
}  // namespace peeler::test
