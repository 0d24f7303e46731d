// SPDX-License-Identifier: Apache-2.0
// Tests several scenes in one command, and output folders that the command creates.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

class ManyScenes : public testing::Test {
  protected:
    ManyScenes() {
        for (const char* name : {"a", "b", "below/a"}) {
            fs::create_directories((scenes_ / name).parent_path());
            const fs::path scene = writeScene((scenes_ / name).parent_path(), stackScene(2));
            fs::rename(scene, (scenes_ / name).string() + ".gltf");
        }
    }

    Outcome render(std::vector<std::string> arguments) const {
        arguments.insert(arguments.begin(), "render");
        arguments.insert(arguments.end(), {"--size", "16x9"});
        return runPeeler(arguments);
    }
    std::string out(const std::string& name) const { return (out_ / name).string(); }
    std::vector<std::string> written() const {
        std::vector<std::string> names;
        if (!fs::exists(out_)) return names;
        for (const auto& entry : fs::recursive_directory_iterator(out_))
            if (entry.is_regular_file())
                names.push_back(entry.path().lexically_relative(out_).string());
        std::ranges::sort(names);
        return names;
    }

    ScratchDir scratch_;
    fs::path scenes_ = scratch_ / "scenes";
    fs::path out_ = scratch_ / "out" / "deep";
};

TEST_F(ManyScenes, OfAFolderHaveTheirNames) {
    const Outcome result =
        render({scenes_.string(), "-o", out("{folder}/{stem}.exr"), "--json", "--quiet"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(written(), (std::vector<std::string>{"below/a.exr", "scenes/a.exr", "scenes/b.exr"}));
    const Json json = Json::parse(result.out);
    ASSERT_EQ(json.at("scenes").size(), 3U);
    EXPECT_EQ(json["scenes"][0]["layers"], 2);
    EXPECT_EQ(json["scenes"][0]["output"], out("scenes/a.exr"));
    EXPECT_FALSE(json.contains("failed"));
    // The files must equal those of scenes rendered one by one.
    ASSERT_EQ(render({(scenes_ / "b.gltf").string(), "-o", out("alone.exr")}).exit_code, 0);
    EXPECT_EQ(bytesOf(out("alone.exr")), bytesOf(out("scenes/b.exr")));
}

TEST_F(ManyScenes, OfAGlob) {
    const Outcome result = render({(scenes_ / "*.gltf").string(), "-o", out("{stem}.png")});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(written(), (std::vector<std::string>{"a.png", "b.png"}));
    const Outcome none = render({(scenes_ / "*.obj").string(), "-o", out("{stem}.png")});
    EXPECT_EQ(none.exit_code, 3);
    EXPECT_TRUE(contains(none.err, "no file has a matching name")) << none.err;
}

TEST_F(ManyScenes, NeedNamesOfTheirOwn) {
    const Outcome result = render({scenes_.string(), "-o", out("{stem}.exr")});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_TRUE(contains(result.err, "would have the same file name")) << result.err;
    EXPECT_TRUE(contains(result.err, "{folder}")) << result.err;
    EXPECT_EQ(written().size(), 0U);
}

TEST_F(ManyScenes, HaveCamerasAndManifestsOfTheirOwn) {
    const std::vector<std::string> line{(scenes_ / "*.gltf").string(), "-o", out("{stem}@.exr"),
                                        "--views", "2"};
    const auto with = [&](const std::string& option, const std::string& name) {
        std::vector<std::string> asked = line;
        asked.insert(asked.end(), {option, out(name)});
        return render(asked);
    };
    for (const char* option : {"--cameras-out", "--manifest"}) {
        const Outcome result = with(option, "all/transforms.json");
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_TRUE(contains(result.err, option)) << result.err;
        EXPECT_EQ(written().size(), 0U);
    }
    const Outcome result = with("--cameras-out", "{stem}/transforms.json");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(fs::exists(out_ / "a/transforms.json"));
    EXPECT_TRUE(fs::exists(out_ / "b/transforms.json"));
}

TEST_F(ManyScenes, GoOnAfterAFailureIfAsked) {
    writeText(scenes_ / "a.gltf", "no scene");
    const std::vector<std::string> command{(scenes_ / "*.gltf").string(), "-o", out("{stem}.exr"),
                                           "--json"};
    Outcome result = render(command);
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_EQ(written().size(), 0U);
    std::vector<std::string> on = command;
    on.emplace_back("--keep-going");
    result = render(on);
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_EQ(written(), (std::vector<std::string>{"b.exr"}));
    const Json json = Json::parse(result.out);
    EXPECT_EQ(json.at("failed")[0]["exitCode"], 3);
    EXPECT_TRUE(contains(result.err, "1 of 2 scenes failed")) << result.err;
}

TEST_F(ManyScenes, AreListedByADryRun) {
    const Outcome result =
        render({(scenes_ / "*.gltf").string(), "-o", out("{stem}.exr"), "--dry-run"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(Json::parse(result.out).at("scenes").size(), 2U);
    EXPECT_EQ(written().size(), 0U);
}

TEST_F(ManyScenes, AreForecastTogether) {
    const Outcome plan = render(
        {(scenes_ / "*.gltf").string(), "-o", out("{stem}_@@.npz"), "--views", "4", "--dry-run"});
    ASSERT_EQ(plan.exit_code, 0) << plan.err;
    const std::size_t whole = plan.err.find("8 pictures like"), part = plan.err.find("4 pictures");
    EXPECT_LT(whole, part) << plan.err;
    EXPECT_NE(part, std::string::npos) << "of the last scene alone";
}

TEST_F(ManyScenes, FoldersAreMadeUnlessTheyMayNot) {
    const std::string scene = (scenes_ / "a.gltf").string();
    const Outcome refused = render({scene, "-o", out("a.exr"), "--no-mkdir"});
    EXPECT_EQ(refused.exit_code, 4);
    EXPECT_TRUE(contains(refused.err, "the folder does not exist")) << refused.err;
    EXPECT_FALSE(fs::exists(out_));
    const Outcome planned = render({scene, "-o", out("a.exr"), "--dry-run"});
    EXPECT_EQ(planned.exit_code, 0) << planned.err;
    EXPECT_FALSE(fs::exists(out_));
    EXPECT_EQ(render({scene, "-o", out("a.exr")}).exit_code, 0);
    EXPECT_TRUE(fs::exists(out_ / "a.exr"));
    // If a folder cannot be created, there is an error before any work, even in a dry run.
    writeText(scratch_ / "file", "");
    for (const char* more : {"--quiet", "--dry-run"}) {
        const Outcome impossible =
            render({scene, "-o", (scratch_ / "file").string() + "/below/a.exr", more});
        EXPECT_EQ(impossible.exit_code, 4) << impossible.err;
        EXPECT_TRUE(contains(impossible.err, "cannot make the folder")) << impossible.err;
    }
}

TEST_F(ManyScenes, ANumbersPlaceWithoutFramesIsWarnedOf) {
    const Outcome result = render({(scenes_ / "a.gltf").string(), "-o", out("a.####.exr")});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_TRUE(contains(result.err, "warning: Without --frames, the name keeps its placeholder"))
        << result.err;
}

TEST_F(ManyScenes, VerboseSaysWhatIsGoingOn) {
    const std::string scene = (scenes_ / "a.gltf").string();
    const Outcome plain = render({scene, "-o", out("a.exr")});
    const Outcome wordy = render({scene, "-o", out("a.exr"), "-v"});
    for (const char* part : {"reading ", "GL: ", "counted ", "captured in 1 geometry pass"}) {
        EXPECT_TRUE(contains(wordy.err, part)) << part << " is not in\n" << wordy.err;
        EXPECT_FALSE(contains(plain.err, part)) << plain.err;
    }
}

TEST_F(ManyScenes, SoftwareIsNoNewsToThoseWhoChoseIt) {
    const std::string scene = (scenes_ / "a.gltf").string();
    const Outcome chosen = render({scene, "-o", out("a.exr"), "--backend", "osmesa"});
    EXPECT_EQ(chosen.exit_code, 0) << chosen.err;
    EXPECT_FALSE(contains(chosen.err, "no GPU")) << chosen.err;
}

}  // namespace
}  // namespace peeler::test
