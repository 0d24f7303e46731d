// SPDX-License-Identifier: Apache-2.0
// Tests strips of a picture that are rendered separately and merged.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

struct Kind {
    const char* name;
    std::vector<std::string> options;
    /// Whether the files are identical, or only their pixels: tiles of a composite do not record
    /// its background.
    bool same_file = true;
};

class Tiles : public testing::TestWithParam<Kind> {};

TEST_P(Tiles, TogetherAreThePicture) {
    const ScratchDir scratch;
    const fs::path scene = sourceDir() / "examples" / "scenes" / "glasses.glb";
    const auto render = [&](const std::string& name, const std::vector<std::string>& more) {
        std::vector<std::string> all{"render", scene.string(), "-o",     scratch / name,
                                     "-q",     "--size",       "211x107"};
        all.insert(all.end(), GetParam().options.begin(), GetParam().options.end());
        all.insert(all.end(), more.begin(), more.end());
        const Outcome result = runPeeler(all);
        ASSERT_EQ(result.exit_code, 0) << result.err;
    };
    render("whole.exr", {});
    for (const int count : {2, 3, 7}) {
        // The order of the tiles must not matter.
        std::vector<std::string> merge{"merge", "-q", "-o", scratch / "merged.exr"};
        for (int i = count; i >= 1; --i) {
            const std::string tile = std::to_string(i) + "of" + std::to_string(count) + ".exr";
            render(tile, {"--tile", std::to_string(i) + "/" + std::to_string(count)});
            merge.push_back(scratch / tile);
        }
        const auto as = std::ranges::find(GetParam().options, "--as");
        if (as != GetParam().options.end()) merge.insert(merge.end(), as, as + 2);
        const Outcome merged = runPeeler(merge);
        ASSERT_EQ(merged.exit_code, 0) << merged.err;
        if (GetParam().same_file) {
            EXPECT_EQ(bytesOf(scratch / "merged.exr"), bytesOf(scratch / "whole.exr")) << count;
        }
        const Outcome diff = runCommand({"idiff", "-a", "-fail", "0", "-warn", "0",
                                         scratch / "merged.exr", scratch / "whole.exr"});
        const bool deep = std::string(GetParam().name) == "Deep";  // idiff cannot read deep files
        if (!deep) {
            EXPECT_EQ(diff.exit_code, 0) << count << diff.out << diff.err;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(
    Each, Tiles,
    testing::Values(Kind{"Layered", {"--as", "ldi"}},
                    Kind{"LayeredFloat", {"--precision", "float", "--channels", "position,id"}},
                    Kind{"Sampled", {"--samples", "4"}}, Kind{"Deep", {"--as", "deep"}},
                    Kind{"Composite", {"--as", "composite"}, false},
                    Kind{"CompositeOverBlue",
                         {"--as", "composite", "--background", "#0040ff", "--precision", "float"},
                         false},
                    Kind{"CompositeWithMattes",
                         {"--as", "composite", "--channels", "normal,id", "--cryptomatte"},
                         false}),
    [](const auto& each) { return std::string(each.param.name); });

TEST(Strips, OfACropDivideTheCrop) {
    const ScratchDir scratch;
    const fs::path scene = sourceDir() / "examples" / "scenes" / "panes.glb";
    const auto render = [&](const std::string& name, std::vector<std::string> more) {
        more.insert(more.begin(), {"render", scene.string(), "-o", scratch / name, "-q", "--size",
                                   "120x80", "--crop", "10,20,50,31"});
        ASSERT_EQ(runPeeler(more).exit_code, 0);
    };
    render("whole.exr", {});
    render("a.exr", {"--tile", "1/2"});
    render("b.exr", {"--tile", "2/2"});
    ASSERT_EQ(runPeeler({"merge", scratch / "a.exr", scratch / "b.exr", "-o", scratch / "m.exr"})
                  .exit_code,
              0);
    EXPECT_EQ(bytesOf(scratch / "m.exr"), bytesOf(scratch / "whole.exr"));
}

TEST(Strips, WithGapsAreNotTakenForThePicture) {
    const ScratchDir scratch;
    const fs::path scene = sourceDir() / "examples" / "scenes" / "panes.glb";
    const auto render = [&](const std::string& name, std::vector<std::string> more) {
        more.insert(more.begin(), {"render", scene.string(), "-o", scratch / name, "--json",
                                   "--size", "60x40", "--skip-existing"});
        return runPeeler(more);
    };
    ASSERT_EQ(render("a.exr", {"--tile", "1/3"}).exit_code, 0);
    ASSERT_EQ(render("b.exr", {"--tile", "2/3"}).exit_code, 0);
    ASSERT_EQ(render("c.exr", {"--tile", "3/3"}).exit_code, 0);
    const auto merge = [&](std::vector<std::string> tiles) {
        tiles.insert(tiles.begin(), {"merge", "--allow-gaps", "-o", scratch / "m.exr"});
        ASSERT_EQ(runPeeler(tiles).exit_code, 0);
    };
    merge({scratch / "a.exr", scratch / "c.exr"});
    EXPECT_EQ(render("m.exr", {}).out.find("skipped"), std::string::npos);
    merge({scratch / "a.exr", scratch / "b.exr", scratch / "c.exr"});
    EXPECT_NE(render("m.exr", {}).out.find("skipped"), std::string::npos);
}

TEST(Strips, OfWhichEachKeepsOtherLayersAreNotOfOnePicture) {
    const ScratchDir scratch;
    const fs::path scene = sourceDir() / "examples" / "scenes" / "panes.glb";
    for (const char* tile : {"1/2", "2/2"}) {
        ASSERT_EQ(
            runPeeler({"render", scene.string(), "-o", scratch / (tile[0] + std::string(".exr")),
                       "--size", "60x40", "--occlusion-ratio", "0.1", "--tile", tile})
                .exit_code,
            0);
    }
    EXPECT_EQ(runPeeler({"merge", scratch / "1.exr", scratch / "2.exr", "-o", scratch / "m.exr"})
                  .exit_code,
              3);
}

TEST(Strips, CompositesAreNotMixedWithLayersOrBackgrounds) {
    const ScratchDir scratch;
    const fs::path scene = sourceDir() / "examples" / "scenes" / "panes.glb";
    const auto render = [&](const std::string& name, std::vector<std::string> more) {
        more.insert(more.begin(),
                    {"render", scene.string(), "-o", scratch / name, "-q", "--size", "60x40"});
        ASSERT_EQ(runPeeler(more).exit_code, 0);
    };
    const std::string a = scratch / "a.exr", b = scratch / "b.exr", c = scratch / "c.exr";
    render("a.exr", {"--as", "composite", "--tile", "1/2"});
    render("b.exr", {"--as", "composite", "--tile", "2/2"});
    render("c.exr", {"--tile", "2/2"});
    const std::string out = scratch / "m.exr";
    EXPECT_EQ(runPeeler({"merge", a, b, "-o", out, "--as", "ldi"}).exit_code, 2);
    EXPECT_EQ(runPeeler({"merge", a, b, "-o", out, "--background", "1,0,0"}).exit_code, 2);
    EXPECT_EQ(runPeeler({"merge", a, c, "-o", out}).exit_code, 3);
    EXPECT_EQ(runPeeler({"merge", a, "-o", out}).exit_code, 3);  // the other tile is missing
    EXPECT_EQ(runPeeler({"merge", b, "-o", out, "--allow-gaps"}).exit_code, 0);
    EXPECT_EQ(runPeeler({"merge", a, a, "-o", out}).exit_code, 3);
    EXPECT_EQ(runPeeler({"merge", a, b, "-o", out}).exit_code, 0);  // --as is not required
    EXPECT_EQ(runPeeler({"verify", out}).exit_code, 0);
}

}  // namespace
}  // namespace peeler::test
