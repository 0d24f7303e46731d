// SPDX-License-Identifier: Apache-2.0
// Tests verbs whose input is a sequence of files, against one run per file.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class FileSequence : public testing::Test {
  protected:
    /// Renders two views of frames 1 to 3: v0.0001.exr and so on.
    void SetUp() override {
        const std::string scene = (sourceDir() / "examples/scenes/jellyfish.glb").string();
        ok({"render", scene, "-o", at("v@.####.exr"), "--size", "24x16", "--frames", "1-3",
            "--views", "2", "-q"});
        fs::rename(at("v0000.0001.exr"), at("a.0001.exr"));
        fs::rename(at("v0000.0002.exr"), at("a.0002.exr"));
        fs::rename(at("v0000.0003.exr"), at("a.0003.exr"));
    }
    std::string at(const std::string& name) const { return scratch_ / name; }
    std::string bytes(const std::string& name) const { return bytesOf(scratch_ / name); }
    static Outcome ok(const std::vector<std::string>& arguments) {
        const Outcome run = runPeeler(arguments);
        EXPECT_EQ(run.exit_code, 0) << run.err;
        return run;
    }
    static Json json(std::vector<std::string> arguments) {
        arguments.emplace_back("--json");
        return Json::parse(ok(arguments).out);
    }

    ScratchDir scratch_;
};

TEST_F(FileSequence, EveryVerbMakesTheFilesOfSingleRuns) {
    struct Row {
        std::vector<std::string> verb;  ///< options of the verb
        std::string extension;
    };
    const std::vector<Row> rows{{{"flatten"}, ".png"},
                                {{"convert", "--as", "deep"}, ".exr"},
                                {{"merge"}, ".exr"},
                                {{"view", "--orbit", "10,0"}, ".png"},
                                {{"sheet", "--cells", "2"}, ".png"}};
    for (const Row& row : rows) {
        const std::string verb = row.verb.front();
        auto all = row.verb, one = row.verb;
        all.insert(all.end(), {at("a.####.exr"), "-o", at(verb + ".##" + row.extension)});
        const Json frames = json(all).at("frames");
        ASSERT_EQ(frames.size(), 3U) << verb;
        EXPECT_EQ(frames[1].at("frame"), 2);
        EXPECT_EQ(frames[1].at("input"), at("a.0002.exr"));
        EXPECT_EQ(frames[1].at("output"), at(verb + ".02" + row.extension));
        one.insert(one.end(), {at("a.0002.exr"), "-o", at("one" + row.extension), "-q"});
        ok(one);
        EXPECT_EQ(bytes(verb + ".02" + row.extension), bytes("one" + row.extension)) << verb;
        EXPECT_NE(bytes(verb + ".03" + row.extension), bytes("one" + row.extension)) << verb;
    }
}

TEST_F(FileSequence, ExtractsLayersOfEachFrame) {
    // The first placeholder is for the frame, and the second for the layer.
    ok({"extract", at("a.####.exr"), "-o", at("f##.layer#.exr"), "--frames", "2", "-q"});
    ok({"extract", at("a.0002.exr"), "-o", at("layer#.exr"), "-q"});
    EXPECT_EQ(bytes("f02.layer0001.exr"), bytes("layer0001.exr"));
    EXPECT_FALSE(fs::exists(at("f01.layer0001.exr")));
}

TEST_F(FileSequence, ComparesAndVerifies) {
    EXPECT_EQ(runPeeler({"compare", at("a.####.exr"), at("a.####.exr")}).exit_code, 0);
    const Outcome differ =
        runPeeler({"compare", at("a.####.exr"), at("a.0001.exr"), "--json", "-q"});
    EXPECT_EQ(differ.exit_code, 1);
    const Json frames = Json::parse(differ.out).at("frames");
    ASSERT_EQ(frames.size(), 3U);
    EXPECT_EQ(frames[0].at("identical"), true);
    EXPECT_EQ(frames[2].at("identical"), false);
    EXPECT_EQ(json({"verify", at("a.####.exr")}).at("files").size(), 3U);
    const Outcome missing = runPeeler({"verify", at("a.####.exr"), "--frames", "2-4"});
    EXPECT_EQ(missing.exit_code, 3);
    EXPECT_TRUE(contains(missing.out, "a.0004.exr: ")) << missing.out;
}

TEST_F(FileSequence, ViewsAndChunksAreShares) {
    fs::rename(at("a.0001.exr"), at("v0000.0001.exr"));
    const std::vector<std::string> all{"flatten", at("v@@@@.####.exr"), "-o", at("@.##.png")};
    auto second = all;
    second.insert(second.end(), {"--chunk", "2/2"});
    const Json part = json(second).at("frames");  // frame/view of the pictures: 1/0, 1/1, 2/1, 3/1
    ASSERT_EQ(part.size(), 2U);
    EXPECT_EQ(part[0].at("frame"), 2);
    EXPECT_EQ(part[0].at("view"), 1);
    EXPECT_EQ(json(all).at("frames").size(), 4U);
    // With more chunks than pictures, some chunks are empty.
    for (const char* const verb : {"verify", "flatten"}) {
        std::vector<std::string> none{verb, at("a.####.exr"), "--chunk", "1/3"};
        if (none.front() == "flatten") none.insert(none.end(), {"-o", at("none.#.png")});
        EXPECT_TRUE(json(none).at("frames").empty()) << verb;
    }
    const Json views = json({"flatten", at("v@@@@.0001.exr"), "-o", at("w@.png")}).at("views");
    ASSERT_EQ(views.size(), 2U);
    EXPECT_EQ(views[1].at("view"), 1);
    EXPECT_FALSE(views[1].contains("frame"));
}

TEST_F(FileSequence, SkipsFilesThatAreNewerThanTheirInputs) {
    const std::vector<std::string> flatten{"flatten", at("a.####.exr"), "-o", at("f.#.png"),
                                           "--skip-existing"};
    EXPECT_FALSE(json(flatten).at("frames")[0].contains("skipped"));
    const auto later = fs::last_write_time(at("f.0003.png")) + std::chrono::seconds(1);
    fs::last_write_time(at("a.0002.exr"), later);
    const Json again = json(flatten).at("frames");
    EXPECT_EQ(again[0].at("skipped"), true);
    EXPECT_GT(again[0].at("bytes"), 0);
    EXPECT_FALSE(again[1].contains("skipped"));
    EXPECT_EQ(ok(flatten).out, "") << "without --json, the result is not printed";
}

TEST_F(FileSequence, FailuresEndTheRunOrAreListed) {
    fs::remove(at("a.0002.exr"));
    std::vector<std::string> flatten{"flatten", at("a.####.exr"), "-o", at("f.#.png"), "--frames",
                                     "1-3",     "--json"};
    const Outcome ended = runPeeler(flatten);
    EXPECT_EQ(ended.exit_code, 3);
    EXPECT_FALSE(fs::exists(at("f.0003.png")));
    flatten.emplace_back("--keep-going");
    const Outcome gone_on = runPeeler(flatten);
    EXPECT_EQ(gone_on.exit_code, 3);
    EXPECT_TRUE(contains(gone_on.err, "1 of 3 frames failed")) << gone_on.err;
    const Json result = Json::parse(gone_on.out);
    EXPECT_EQ(result.at("frames").size(), 2U);
    EXPECT_EQ(result.at("failed")[0].at("frame"), 2);
    EXPECT_EQ(result.at("failed")[0].at("exitCode"), 3);
    EXPECT_TRUE(fs::exists(at("f.0003.png")));
}

TEST_F(FileSequence, RefusesNamesThatDoNotFit) {
    const auto refused = [](const std::vector<std::string>& arguments, int code,
                            const std::string& text) {
        const Outcome run = runPeeler(arguments);
        EXPECT_EQ(run.exit_code, code);
        EXPECT_TRUE(contains(run.err, text)) << run.err;
    };
    refused({"flatten", at("a.####.exr"), "-o", at("f.png")}, 2, "the same file name: --output");
    refused({"flatten", at("b.####.exr"), "-o", at("f.#.png")}, 3, "no file has such a name");
    refused({"flatten", at("a.0001.exr"), "-o", at("f.png"), "--frames", "1"}, 2,
            "the input is not a sequence: --frames");
    refused({"flatten", at("v@@@@.0001.exr"), "-o", at("f@.png"), "--frames", "1"}, 2,
            "the input has no frames");
    refused({"compare", at("a.####.exr"), at("a.0001.exr"), "--skip-existing"}, 2,
            "this run writes no files to skip");
    // A name with #### is no pattern if a file with exactly this name exists.
    fs::copy_file(at("a.0001.exr"), at("c.####.exr"));
    ok({"flatten", at("c.####.exr"), "-o", at("f.png")});
    EXPECT_TRUE(fs::exists(at("f.png")));
}

}  // namespace
}  // namespace peeler::test
