// SPDX-License-Identifier: Apache-2.0
// Tests file sets (--layout per-file) in all verbs: nothing is lost or overwritten.
#include <gtest/gtest.h>

#include <fstream>

#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

class FileSets : public testing::Test {
  protected:
    Outcome run(std::vector<std::string> arguments) {
        return runPeelerProcess(arguments, {}, folder_.path());
    }
    void render(const std::string& output, std::vector<std::string> options = {}) {
        options.insert(options.begin(),
                       {"render", (sourceDir() / "examples/scenes/glasses.glb").string(), "-o",
                        output, "--size", "60x34", "-q"});
        const Outcome result = run(options);
        ASSERT_EQ(result.exit_code, 0) << result.err;
    }
    std::string bytes(const std::string& name) const { return bytesOf(folder_ / name); }

    ScratchDir folder_;
};

TEST_F(FileSets, AreNeverWrittenOverByWhatReadsThem) {
    render("set.exr", {"--layout", "per-file"});
    fs::create_symlink("set.layer_001.exr", folder_ / "link.exr");
    const std::string layer = bytes("set.layer_002.exr");
    const std::vector<std::vector<std::string>> commands{
        {"extract", "set.exr", "-o", "set.layer_###.exr"},
        {"flatten", "set.exr", "-o", "set.layer_002.exr"},
        {"convert", "set.exr", "-o", "./set.layer_002.exr", "--as", "ldi"},
        {"view", "set.exr", "-o", "set.layer_002.exr"},
        {"extract", "set.exr", "--depth-complexity", "set.layer_002.exr"},
        {"convert", "link.exr", "-o", "set.exr", "--layout", "per-file"},
        {"convert", "set.exr", "-o", "other.exr", "--report", "set.exr"},
    };
    for (const auto& command : commands)
        EXPECT_EQ(run(command).exit_code, 2) << command[0] << ' ' << command[3];
    EXPECT_EQ(bytes("set.layer_002.exr"), layer);
    EXPECT_EQ(run({"verify", "set.exr", "set.layer_002.exr"}).exit_code, 0);
    // This file has the name of a layer's file but belongs to no set.
    render("alone.exr");
    EXPECT_EQ(run({"flatten", "alone.exr", "-o", "alone.layer_000.exr"}).exit_code, 0);
}

TEST_F(FileSets, TellOfLayersThatAreLeftAndGuardThem) {
    render("set.exr", {"--layout", "per-file"});
    fs::remove(folder_ / "set.exr");
    fs::remove(folder_ / "set.layer_000.exr");
    const std::string scene = (sourceDir() / "examples/scenes/glasses.glb").string();
    const std::vector<std::string> again{"render",   scene,    "-o",    "set.exr",  "--layout",
                                         "per-file", "--size", "60x34", "--layers", "2"};
    auto guarded = again;
    guarded.emplace_back("--no-clobber");
    EXPECT_EQ(run(guarded).exit_code, 4);
    const Outcome result = run(again);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_NE(result.err.find("set.layer_002.exr"), std::string::npos) << result.err;
}

TEST_F(FileSets, OfMergedTilesAreThoseOfTheWhole) {
    const std::vector<std::string> set{"--layout", "per-file", "--cryptomatte"};
    render("whole.exr", set);
    render("left.exr", {"--crop", "0,0,30,34", "--cryptomatte"});
    render("right.exr", {"--crop", "30,0,30,34", "--cryptomatte"});
    ASSERT_EQ(run({"merge", "left.exr", "right.exr", "-o", "merged.exr", "--layout", "per-file"})
                  .exit_code,
              0);
    EXPECT_EQ(bytes("merged.exr"), bytes("whole.exr"));
    for (const char* layer : {".layer_000.exr", ".layer_005.exr"})
        EXPECT_EQ(bytes(std::string("merged") + layer), bytes(std::string("whole") + layer));
    EXPECT_EQ(
        run({"merge", "left.exr", "right.exr", "-o", "m.exr", "--as", "midpoint-depth"}).exit_code,
        2);
}

TEST_F(FileSets, ConvertKeepsCryptomatteAndHowSamplesWereMerged) {
    render("layers.exr", {"--cryptomatte"});
    ASSERT_EQ(run({"convert", "layers.exr", "-o", "again.exr", "--as", "ldi"}).exit_code, 0);
    EXPECT_EQ(bytes("again.exr"), bytes("layers.exr"));
    const std::vector<std::string> merging{
        "--as", "deep", "--deep-merge", "by-z", "--deep-z-tolerance", "0.1"};
    render("deep.exr", merging);
    ASSERT_EQ(run({"convert", "deep.exr", "-o", "deep2.exr", "--as", "deep"}).exit_code, 0);
    EXPECT_EQ(bytes("deep2.exr"), bytes("deep.exr"));
}

TEST_F(FileSets, AManifestStaysWithItsPicture) {
    const std::string scene = (sourceDir() / "examples/scenes/glasses.glb").string();
    const auto render_with = [&](std::vector<std::string> options) {
        options.insert(options.begin(),
                       {"render", scene, "-o", "a.exr", "--size", "60x34", "--channels", "id"});
        return run(options).exit_code;
    };
    EXPECT_EQ(render_with({"--manifest", "a.layer_000.exr", "--layout", "per-file"}), 2);
    EXPECT_EQ(render_with({"--manifest", "ids.json", "--layers", "1", "--strict"}), 6);
    EXPECT_FALSE(fs::exists(folder_ / "ids.json"));
    std::ofstream(folder_ / "ids.json") << "mine";
    EXPECT_EQ(render_with({"--manifest", "ids.json", "--no-clobber"}), 4);
    EXPECT_EQ(bytes("ids.json"), "mine");
}

}  // namespace
}  // namespace peeler::test
