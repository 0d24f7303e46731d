// SPDX-License-Identifier: Apache-2.0
// Tests the notes about file sizes that are printed before writing, for disks with known free
// space.
#include "cmd/options/forecast.h"
#include "cmd/cli/console.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include <peeler/error.h>
#include "support/test_support.h"

namespace peeler::cmd {
namespace {

constexpr std::uint64_t kGb = 1'000'000'000;

/// Returns the notes and warnings about a forecast for a disk with this much free space.
std::string told(const Forecast& forecast, std::uint64_t free, bool always = false) {
    std::ostringstream out, err;
    Console console(out, err, false);
    reportForecast(forecast, console, always, [&](const auto&) { return DiskSpace{7, free}; });
    EXPECT_EQ(out.str(), "");
    return err.str();
}

Forecast oneFile(std::uint64_t bytes, Certainty certainty = Certainty::kExact) {
    Forecast forecast;
    forecast.files = {{"hits.npz", {bytes, certainty}, "9 hits"}};
    return forecast;
}

TEST(Forecast, IsToldOnlyWhenItIsNotable) {
    EXPECT_EQ(told(oneFile(kGb - 1), 200 * kGb), "");
    EXPECT_EQ(told(oneFile(kGb), 200 * kGb),
              "peeler: hits.npz will take 1.0 GB (9 hits) of the 200.0 GB free there\n");
    EXPECT_EQ(told(oneFile(kGb, Certainty::kAtMost), 200 * kGb),
              "peeler: hits.npz will take at most 1.0 GB (9 hits) of the 200.0 GB free there\n");
    EXPECT_EQ(told(oneFile(1'000), 100'000), "");
    EXPECT_EQ(told(oneFile(1'001), 100'000),
              "peeler: hits.npz will take 1.0 kB (9 hits) of the 100.0 kB free there\n");
    EXPECT_EQ(told(oneFile(10), 200 * kGb, true),
              "peeler: hits.npz will take 10 B (9 hits) of the 200.0 GB free there\n");
}

TEST(Forecast, MoreThanATenthIsAWarning) {
    EXPECT_EQ(told(oneFile(10'000), 100'000).find("warning"), std::string::npos);
    EXPECT_EQ(told(oneFile(10'001), 100'000),
              "peeler: warning: hits.npz will take 10.0 kB (9 hits), 10 % of the 100.0 kB "
              "free there.\n");
    EXPECT_NE(told(oneFile(100'000), 100'000).find("warning"), std::string::npos);
}

TEST(Forecast, MoreThanAllIsAnErrorIfItIsCertain) {
    try {
        told(oneFile(100'001), 100'000);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kOutput);
        EXPECT_STREQ(error.what(),
                     "not enough disk space: 100.0 kB (9 hits) needed, 100.0 kB free");
        EXPECT_EQ(error.where(), "hits.npz");
    }
    for (const Certainty certainty : {Certainty::kAtMost, Certainty::kAbout})
        EXPECT_NE(told(oneFile(100'001, certainty), 100'000).find("warning"), std::string::npos);
    EXPECT_NE(told(oneFile(1, Certainty::kAtMost), 0).find("at most 1 B"), std::string::npos);
}

TEST(Forecast, FilesOfOneDiskAddUp) {
    Forecast forecast;
    forecast.files = {{"/a/1", {600}}, {"/b/2", {600}}, {"/a/3", {500, Certainty::kAtMost}}};
    const auto disk = [](const std::filesystem::path& file) {
        return DiskSpace{file.string()[1] == 'a' ? 1U : 2U, 1000};
    };
    std::ostringstream out, err;
    Console console(out, err, false);
    reportForecast(forecast, console, false, disk);
    EXPECT_EQ(err.str(),
              "peeler: warning: /a/1 and 1 more file will take at most 1.1 kB, 110 % of the 1.0 kB "
              "free there.\n"
              "peeler: warning: /b/2 will take 600 B, 60 % of the 1.0 kB free there.\n");
    EXPECT_TRUE(mayExceedDisk(forecast, disk));
    EXPECT_EQ(forecast.size().bytes, 1700U);
    forecast.files[2].size = {500};
    EXPECT_THROW(reportForecast(forecast, console, false, disk), Error);
    // If the free space is unknown, nothing is printed.
    err.str("");
    reportForecast(forecast, console, true, [](const auto&) { return std::optional<DiskSpace>(); });
    EXPECT_EQ(err.str(), "");
}

TEST(Forecast, PicturesToComeAreNoError) {
    Forecast frames = oneFile(600);
    frames.times = 10;
    EXPECT_EQ(told(frames, 1000),
              "peeler: warning: 10 pictures like hits.npz will take about 6.0 kB, 600 % of "
              "the 1.0 kB free there.\n");
    frames.times = UINT64_MAX;
    EXPECT_NE(told(frames, 1000).find("warning"), std::string::npos);
}

TEST(Forecast, TheDiskIsThatOfTheNearestFolder) {
    const test::ScratchDir scratch;
    const auto here = diskSpaceOf(scratch.path() / "a.npz");
    const auto below = diskSpaceOf(scratch.path() / "not" / "there" / "a.npz");
    ASSERT_TRUE(here && below);
    EXPECT_EQ(here->device, below->device);
    EXPECT_GT(here->free, 0U);
    const auto processes = diskSpaceOf("/proc/a.npz");
    ASSERT_TRUE(processes);
    EXPECT_NE(processes->device, here->device);
}

}  // namespace
}  // namespace peeler::cmd
