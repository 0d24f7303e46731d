// SPDX-License-Identifier: Apache-2.0
// Tests sequences of frames: split among processes, skipped if their files exist, continued after a
// failure.
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <thread>

#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

fs::path jellyfish() {
    return sourceDir() / "examples" / "scenes" / "jellyfish.glb";
}

class Sequence : public testing::Test {
  protected:
    std::string path(const std::string& name) const { return (scratch_ / name).string(); }
    std::string frame(int number) const { return path("f." + std::to_string(number) + ".exr"); }

    std::vector<std::string> arguments(const std::vector<std::string>& more) const {
        std::vector<std::string> all{"render", jellyfish().string(), "--size", "96x54", "--json"};
        if (std::ranges::count(more, "-o") == 0) all.insert(all.end(), {"-o", path("f.%d.exr")});
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }
    CommandResult render(const std::vector<std::string>& more,
                         const std::vector<std::string>& environment = {}) const {
        return runPeelerProcess(arguments(more), environment);
    }
    static std::set<int> skipped(const CommandResult& result) {
        std::set<int> frames;
        const Json told = Json::parse(result.out);
        for (const auto& entry : told.at("frames"))
            if (entry.value("skipped", false)) frames.insert(entry.at("frame").get<int>());
        return frames;
    }
    std::vector<std::string> hidden() const {
        std::vector<std::string> names;
        for (const auto& entry : fs::directory_iterator(scratch_.path()))
            if (const std::string name = entry.path().filename(); name.starts_with('.'))
                names.push_back(name);
        return names;
    }

    ScratchDir scratch_;
};

TEST_F(Sequence, ChunksTogetherAreTheSequence) {
    ASSERT_EQ(render({"--frames", "3-9"}).exit_code, 0);
    std::map<int, std::string> whole;
    for (int i = 3; i <= 9; ++i) {
        whole[i] = bytesOf(frame(i));
        fs::remove(frame(i));
    }
    std::vector<int> order;
    for (int i = 1; i <= 3; ++i) {
        const CommandResult result =
            render({"--frames", "3-9", "--chunk", std::to_string(i) + "/3"});
        ASSERT_EQ(result.exit_code, 0) << result.err;
        const Json frames = Json::parse(result.out).at("frames");
        for (const auto& entry : frames)
            order.push_back(entry.at("frame"));
        EXPECT_GE(frames.size(), 2U);
    }
    EXPECT_EQ(order, (std::vector<int>{3, 4, 5, 6, 7, 8, 9}));
    for (const auto& [number, bytes] : whole)
        EXPECT_EQ(bytesOf(frame(number)), bytes) << number;
}

TEST_F(Sequence, AChunkMayBeEmpty) {
    const CommandResult result = render({"--frames", "1-2", "--chunk", "1/3"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(Json::parse(result.out).at("frames").size(), 0U);
    EXPECT_TRUE(fs::is_empty(scratch_.path()));
}

TEST_F(Sequence, RefusesWhatMakesNoSense) {
    for (const std::vector<std::string>& wrong : std::vector<std::vector<std::string>>{
             {"--chunk", "1/2"},
             {"--frames", "1-3", "--chunk", "0/2"},
             {"--frames", "1-3", "--chunk", "3/2"},
             {"--frames", "1-1000000000"},
             // The sequence has several frames, even if this process renders only one.
             {"--frames", "1-3", "--chunk", "1/3", "-o", path("one.exr")},
             {"--tile", "2/1"},
             {"--tile", "1/2", "--as", "composite", "--fxaa"},
             {"--tile", "1/2", "--as", "midpoint-depth"},
             {"--tile", "1/55"}}) {
        EXPECT_EQ(render(wrong).exit_code, 2) << wrong.back();
    }
    EXPECT_TRUE(fs::is_empty(scratch_.path()));
}

TEST_F(Sequence, SkipExistingLeavesAloneWhatWouldBeTheSame) {
    ASSERT_EQ(render({"--frames", "1-4"}).exit_code, 0);
    const auto node = [&](int number) {
        struct stat status {};
        EXPECT_EQ(stat(frame(number).c_str(), &status), 0);
        return status.st_ino;
    };
    const auto first = node(1);
    EXPECT_EQ(skipped(render({"--frames", "1-4", "--skip-existing"})), (std::set{1, 2, 3, 4}));
    EXPECT_EQ(node(1), first);
    // These settings do not affect the picture, so all frames are kept.
    EXPECT_EQ(skipped(render({"--frames", "4-1", "--skip-existing", "--threads", "1", "--method",
                              "dual", "--memory", "1G", "--keep-going"})),
              (std::set{1, 2, 3, 4}));
    // All settings that affect the picture, each with its text in the message.
    const struct {
        std::vector<std::string> options;
        std::string difference;
    } others[] = {
        {{"--layers", "2"}, "--layers: 2, not all"},
        {{"--size", "96x55"}, "the size of the picture: 96 x 55, not 96 x 54; "},
        {{"--fps", "25"}, "--time: 0.08"},
        {{"--shading", "unlit"}, "--shading: unlit, not pbr"},
        {{"--precision", "float"}, "--precision: float, not half"},
        {{"--eye", "1,2,3"}, "the camera: unnamed, not main; "},
        {{"--crop", "0,0,50,50"}, "--crop: 0,0,50,50, not 0,0,96,54"},
        {{"--as", "deep"}, "--as: deep, not ldi"},
        {{"--as", "composite"}, "--as: composite, not ldi"},
        {{"--compression", "zips"}, "--compression: zips, not zip"},
        {{"--layout", "nuke"}, "--layout: nuke, not plain"},
        {{"--cryptomatte"}, "--channels: id, not none; --cryptomatte: on, not off"},
        {{"--no-composite"}, "--no-composite: on, not off"},
    };
    for (const auto& other : others) {
        std::vector<std::string> more{"--frames", "2", "--skip-existing"};
        more.insert(more.end(), other.options.begin(), other.options.end());
        const CommandResult result = render(more);
        ASSERT_EQ(result.exit_code, 0) << result.err;
        EXPECT_EQ(skipped(result), std::set<int>{}) << other.difference;
        EXPECT_NE(result.err.find(frame(2) + " is written again: " + other.difference),
                  std::string::npos)
            << other.difference << '\n'
            << result.err;
        const CommandResult same = render(more);
        EXPECT_EQ(skipped(same), std::set{2}) << other.difference;
        EXPECT_EQ(same.err.find("written again"), std::string::npos) << same.err;
        ASSERT_EQ(render({"--frames", "2"}).exit_code, 0);
    }
}

TEST_F(Sequence, SkipExistingMakesAnewWhatIsDamagedOrOfOthers) {
    ASSERT_EQ(render({"--frames", "1-5"}).exit_code, 0);
    const std::string good = bytesOf(frame(2)), fifth = bytesOf(frame(5));
    fs::resize_file(frame(2), fs::file_size(frame(2)) - 1);
    std::ofstream(frame(3)) << "not a picture";
    fs::copy_file(frame(1), frame(4), fs::copy_options::overwrite_existing);
    std::string flipped = fifth;
    flipped[flipped.size() / 2] ^= 1;
    std::ofstream(frame(5), std::ios::binary) << flipped;
    const CommandResult result = render({"--frames", "1-5", "--skip-existing"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(skipped(result), std::set{1});
    EXPECT_EQ(bytesOf(frame(2)), good);
    EXPECT_EQ(bytesOf(frame(5)), fifth);
    EXPECT_NE(
        result.err.find(frame(5) + " is written again: the file has changed since it was written"),
        std::string::npos)
        << result.err;
    for (const int number : {2, 3})
        EXPECT_NE(result.err.find(frame(number) + " is written again: the file is incomplete"),
                  std::string::npos)
            << result.err;
    EXPECT_NE(result.err.find(frame(4) + " is written again: the frame: 4, not 1; "),
              std::string::npos)
        << result.err;
    const CommandResult verified =
        runPeelerProcess({"verify", frame(1), frame(2), frame(3), frame(4), frame(5)});
    EXPECT_EQ(verified.exit_code, 0) << verified.err;
}

TEST_F(Sequence, SkipExistingDoesNotHideWhatStrictRefuses) {
    const std::vector<std::string> few{"--frames", "1", "--layers", "1", "--skip-existing"};
    ASSERT_EQ(render(few).exit_code, 0);
    EXPECT_EQ(skipped(render(few)), std::set{1});
    std::vector<std::string> strict = few;
    strict.emplace_back("--strict");
    EXPECT_EQ(render(strict).exit_code, 6);
    EXPECT_EQ(render({"--frames", "1", "--strict"}).exit_code, 0);
    EXPECT_EQ(skipped(render({"--frames", "1", "--strict", "--skip-existing"})), std::set{1});
}

TEST_F(Sequence, FramesOfMotionAreOfOneSequence) {
    // 1 / (next - this) differs between these frames because of rounding.
    ASSERT_EQ(render({"--frames", "1-7", "--channels", "motion"}).exit_code, 0);
    std::vector<std::string> verify{"verify"};
    for (int i = 1; i <= 7; ++i)
        verify.push_back(frame(i));
    const CommandResult result = runPeelerProcess(verify);
    EXPECT_EQ(result.exit_code, 0) << result.err << result.out;
}

TEST_F(Sequence, NoClobberKeepsWhatIsOfOtherSettings) {
    ASSERT_EQ(render({"--frames", "1"}).exit_code, 0);
    ASSERT_EQ(render({"--frames", "2", "--layers", "1"}).exit_code, 0);
    const std::string other = bytesOf(frame(2));
    const CommandResult result =
        render({"--frames", "1-3", "--skip-existing", "--no-clobber", "--keep-going"});
    EXPECT_EQ(result.exit_code, 4) << result.err;
    EXPECT_EQ(skipped(result), std::set{1});
    EXPECT_EQ(bytesOf(frame(2)), other);
    EXPECT_TRUE(fs::exists(frame(3)));
}

TEST_F(Sequence, KeepGoingDoesTheOthersAndListsWhatFailed) {
    fs::create_directory(frame(2));
    fs::create_directory(frame(4));
    EXPECT_EQ(render({"--frames", "1-5"}).exit_code, 4);
    EXPECT_FALSE(fs::exists(frame(3)));
    const CommandResult result = render({"--frames", "1-5", "--keep-going"});
    EXPECT_EQ(result.exit_code, 4) << result.err;
    const Json told = Json::parse(result.out);
    EXPECT_EQ(told.at("frames").size(), 3U);
    ASSERT_EQ(told.at("failed").size(), 2U);
    EXPECT_EQ(told.at("failed")[0].at("frame"), 2);
    EXPECT_EQ(told.at("failed")[0].at("exitCode"), 4);
    EXPECT_EQ(told.at("failed")[1].at("output"), frame(4));
    EXPECT_NE(result.err.find("peeler: error: frame 2: "), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("peeler: error: frame 4: "), std::string::npos);
    EXPECT_NE(result.err.find("2 of 5 frames failed"), std::string::npos);
    for (const int number : {1, 3, 5})
        EXPECT_EQ(runPeelerProcess({"verify", frame(number)}).exit_code, 0);
    EXPECT_EQ(hidden(), std::vector<std::string>{});
}

TEST_F(Sequence, TheWorstExitCodeWins) {
    // Frame 1 fails with code 4; the other frames are incomplete, code 6.
    fs::create_directory(frame(1));
    EXPECT_EQ(render({"--frames", "1-3", "--keep-going", "--strict", "--layers", "1"}).exit_code,
              6);
    EXPECT_EQ(render({"--frames", "1-3", "--keep-going", "--camera", "none"}).exit_code, 2);
}

TEST_F(Sequence, DryRunTellsAndWritesNothing) {
    ASSERT_EQ(render({"--frames", "2"}).exit_code, 0);
    const CommandResult result = render(
        {"--frames", "1-4", "--chunk", "1/2", "--tile", "2/2", "--skip-existing", "--dry-run"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Json pictures = Json::parse(result.out).at("pictures");
    ASSERT_EQ(pictures.size(), 2U);
    EXPECT_EQ(pictures[0].at("output"), frame(1));
    EXPECT_EQ(pictures[0].at("crop"), Json::parse("[0, 27, 96, 27]"));
    EXPECT_EQ(pictures[0].at("exists"), false);
    EXPECT_EQ(pictures[1].at("exists"), true);
    EXPECT_EQ(pictures[1].at("action"), "render");  // the existing file has the whole picture
    EXPECT_EQ(pictures[0].at("difference"), "");
    EXPECT_EQ(pictures[1].at("difference"), "--crop: 0,27,96,27, not 0,0,96,54");
    const CommandResult whole = render({"--frames", "2", "--skip-existing", "--dry-run"});
    EXPECT_EQ(Json::parse(whole.out).at("pictures")[0].at("action"), "skip");
    EXPECT_FALSE(fs::exists(frame(1)));
    EXPECT_EQ(runPeelerProcess(arguments({"-o", "/nonexistent/f.%d.exr", "--frames", "1",
                                          "--dry-run", "--report", "/nonexistent/r"}))
                  .exit_code,
              0);
    // The hash in the plan must equal the hash in the rendered file.
    ASSERT_EQ(render({"--frames", "1-4", "--chunk", "1/2", "--tile", "2/2"}).exit_code, 0);
    const CommandResult info = runPeelerProcess({"info", frame(1), "--json"});
    EXPECT_NE(info.out.find(pictures[0].at("settingsHash").get<std::string>()), std::string::npos);
}

TEST_F(Sequence, SchedulersAreToldWithoutEverGoingBack) {
    fs::create_directory(frame(3));  // makes frame 3 fail
    const struct {
        const char* style;
        std::regex line;
    } styles[] = {{"alf", std::regex("ALF_PROGRESS ([0-9]{1,3})%")},
                  {"openjd", std::regex("openjd_progress: ([0-9]+\\.[0-9]+)")},
                  {"json", std::regex(R"(\{"stage":"render","progress":([0-9.e-]+),.*)")}};
    for (const auto& style : styles) {
        const CommandResult result = render({"--frames", "1-5", "--keep-going", "-q", "--progress",
                                             style.style, "--samples", "2", "--size", "320x180"});
        EXPECT_EQ(result.exit_code, 4);
        std::istringstream lines(result.err);
        std::vector<double> told;
        int failures = 0;
        for (std::string line; std::getline(lines, line);) {
            std::smatch match;
            if (std::regex_match(line, match, style.line)) told.push_back(std::stod(match[1]));
            failures += line.starts_with("openjd_fail: frame 3: ");
        }
        ASSERT_GE(told.size(), 2U) << result.err;
        EXPECT_TRUE(std::ranges::is_sorted(told)) << result.err;
        EXPECT_EQ(told.front(), 0);
        EXPECT_EQ(told.back(), std::string(style.style) == "json" ? 1 : 100);
        EXPECT_EQ(failures, std::string(style.style) == "openjd" ? 1 : 0) << result.err;
    }
}

TEST_F(Sequence, ALostContextIsTriedOnceMore) {
    ASSERT_EQ(render({"--frames", "1-3"}).exit_code, 0);
    std::map<int, std::string> bytes;
    for (int i = 1; i <= 3; ++i) {
        bytes[i] = bytesOf(frame(i));
        fs::remove(frame(i));
    }
    const std::string egl = "LD_LIBRARY_PATH=" + fakeEglDir().string();
    const std::vector<std::string> three{"--frames", "1-3", "--backend", "egl"};
    for (const char* when : {"1", "4", "9"}) {
        const CommandResult result =
            render(three, {egl, std::string("PEELER_FAKE_EGL_LOST=") + when});
        ASSERT_EQ(result.exit_code, 0) << result.err;
        EXPECT_NE(result.err.find("once more"), std::string::npos) << result.err;
        for (int i = 1; i <= 3; ++i) {
            EXPECT_EQ(bytesOf(frame(i)), bytes[i]) << when;
            fs::remove(frame(i));
        }
    }
    const CommandResult lost = render(three, {egl, "PEELER_FAKE_EGL_LOST=9+"});
    EXPECT_EQ(lost.exit_code, 5) << lost.err;
    EXPECT_EQ(hidden(), std::vector<std::string>{});
    for (int i = 1; i <= 3; ++i) {
        if (fs::exists(frame(i))) {
            EXPECT_EQ(bytesOf(frame(i)), bytes[i]);
        }
    }
}

TEST_F(Sequence, AFullDiskKeepsWhatIsWhole) {
    if (geteuid() != 0) GTEST_SKIP() << "only root may mount a small disk";
    const fs::path disk = scratch_ / "disk";
    fs::create_directory(disk);
    if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=256k") != 0)
        GTEST_SKIP() << "this machine lets nobody mount: " << std::strerror(errno);
    const CommandResult result =
        render({"-o", (disk / "f.%d.exr").string(), "--frames", "1-30", "--keep-going"});
    std::vector<std::string> verify{"verify"};
    bool only_frames = true;
    for (const auto& entry : fs::directory_iterator(disk)) {
        verify.push_back(entry.path().string());
        only_frames = only_frames && entry.path().filename().string().starts_with("f.");
    }
    const CommandResult verified = runPeelerProcess(verify);
    umount(disk.c_str());
    EXPECT_EQ(result.exit_code, 4) << result.err;
    EXPECT_NE(result.err.find("free some space"), std::string::npos) << result.err;
    EXPECT_TRUE(only_frames);
    EXPECT_GT(verify.size(), 2U);
    EXPECT_LT(verify.size(), 30U);
    EXPECT_EQ(verified.exit_code, 0) << verified.err;
}

TEST_F(Sequence, AFolderThatGoesAway) {
    const fs::path folder = scratch_ / "gone";
    fs::create_directory(folder);
    StartedCommand run(
        peelerCommand(arguments({"-o", (folder / "f.%d.exr").string(), "--frames", "1-2000"})));
    while (!fs::exists(folder / "f.2.exr") && run.running())
        std::this_thread::sleep_for(1ms);
    std::error_code failure;
    while (fs::exists(folder) && run.running())  // the process may still be writing these files
        fs::remove_all(folder, failure);
    const CommandResult result = run.wait();
    EXPECT_EQ(result.exit_code, 4) << result.err;
    EXPECT_NE(result.err.find("peeler: error: "), std::string::npos) << result.err;
}

TEST_F(Sequence, AReadOnlyFolder) {
    if (geteuid() != 0) GTEST_SKIP() << "only root may mount a disk read-only";
    const fs::path disk = scratch_ / "disk";
    fs::create_directory(disk);
    if (mount("tmpfs", disk.c_str(), "tmpfs", MS_RDONLY, "size=64k") != 0)
        GTEST_SKIP() << "this machine lets nobody mount: " << std::strerror(errno);
    const CommandResult result = render({"-o", (disk / "f.%d.exr").string(), "--frames", "1-3"});
    umount(disk.c_str());
    EXPECT_EQ(result.exit_code, 4);
    EXPECT_NE(result.err.find("read-only"), std::string::npos) << result.err;
}

TEST_F(Sequence, TwoProcessesOnTheSameFramesDoNoHarm) {
    ASSERT_EQ(render({"--frames", "1-6"}).exit_code, 0);
    std::map<int, std::string> bytes;
    for (int i = 1; i <= 6; ++i)
        bytes[i] = bytesOf(frame(i));
    StartedCommand a(peelerCommand(arguments({"--frames", "1-6"})));
    StartedCommand b(peelerCommand(arguments({"--frames", "6-1"})));
    EXPECT_EQ(a.wait().exit_code, 0);
    EXPECT_EQ(b.wait().exit_code, 0);
    for (int i = 1; i <= 6; ++i)
        EXPECT_EQ(bytesOf(frame(i)), bytes[i]);
    EXPECT_EQ(hidden(), std::vector<std::string>{});
}

TEST_F(Sequence, StaysUnderItsBudget) {
    if (kShadowMemory) GTEST_SKIP() << "its memory is not the product's";
    const CommandResult result =
        render({"--frames", "1-8", "--size", "1280x720", "--memory", "400M"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_LE(result.peak_memory, 400ULL << 20);
}

}  // namespace
}  // namespace peeler::test
