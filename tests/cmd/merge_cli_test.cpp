// SPDX-License-Identifier: Apache-2.0
// merge: tiles rendered apart are the picture rendered whole, byte for byte.
#include <gtest/gtest.h>

#include <functional>

#include "formats/cut_window.h"
#include "formats/exr/exr_writers.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

class MergeCommand : public testing::Test {
  protected:
    std::string path(const std::string& name) const { return (scratch_ / name).string(); }

    std::string write(const std::string& name, const SyntheticPicture& picture,
                      const std::function<void(Provenance&)>& change = {}) const {
        Provenance provenance{.version = version(),
                              .method = "a-buffer",
                              .surfaces = "all",
                              .scene = "s.glb",
                              .scene_hash = "ab",
                              .settings_hash = "cd",
                              .renderer = "test",
                              .frame = 7,
                              .time = 0.1,
                              .frames_per_second = 24};
        if (change) change(provenance);
        ExrLdiWriter writer(path(name), {.provenance = provenance});
        writePicture(writer, picture);
        return path(name);
    }
    /// What merge will say of its result.
    static std::string version() {
        const std::string text = runPeeler({"--version"}).out;
        return text.substr(7, text.size() - 8);  // "peeler 1.2.3\n"
    }
    Outcome merge(std::vector<std::string> tiles,
                  const std::vector<std::string>& options = {}) const {
        tiles.insert(tiles.begin(), "merge");
        tiles.insert(tiles.end(), {"-o", path("merged.exr")});
        tiles.insert(tiles.end(), options.begin(), options.end());
        return runPeeler(tiles);
    }

    ScratchDir scratch_;
    const SyntheticPicture whole_ = makePicture({.width = 90, .height = 70, .extra = true});
};

TEST_F(MergeCommand, TilesOfAScene) {
    const std::string scene = (sourceDir() / "examples" / "scenes" / "coincident.glb").string();
    const auto render = [&](const std::string& name, std::vector<std::string> more) {
        more.insert(more.begin(), {"render", scene, "-o", path(name), "--size", "160x90", "-q"});
        ASSERT_EQ(runPeeler(more).exit_code, 0);
    };
    render("whole.exr", {});
    std::vector<std::string> tiles;
    for (const char* crop :
         {"0,0,57,90", "57,0,103,1", "57,1,50,89", "107,1,53,40", "107,41,53,49"}) {
        tiles.push_back(path(std::string(crop) + ".exr"));
        render(std::string(crop) + ".exr", {"--crop", crop});
    }
    const Outcome result = merge(tiles);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(bytesOf(path("merged.exr")), bytesOf(path("whole.exr")));
    render("whole.png", {"--samples", "1", "--environment", "none", "--exposure", "0"});
    ASSERT_EQ(merge(tiles, {"-o", path("merged.png"), "--exposure", "0"}).exit_code, 0);
    EXPECT_EQ(bytesOf(path("merged.png")), bytesOf(path("whole.png")));
}

TEST_F(MergeCommand, TilesWithChannelsThatOverlap) {
    const std::string whole = write("whole.exr", whole_);
    const std::vector<Window> windows = {
        {40, 0, 90, 50}, {0, 0, 45, 37}, {0, 37, 40, 70}, {33, 49, 90, 70}};
    std::vector<std::string> tiles;
    for (const Window& window : windows)
        tiles.push_back(write(std::to_string(tiles.size()) + ".exr", cutPicture(whole_, window)));
    const Outcome result = merge(tiles);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(bytesOf(path("merged.exr")), bytesOf(whole));
}

TEST_F(MergeCommand, ACropOfCropsAndATileWithoutFragments) {
    SyntheticPicture picture = whole_;
    const std::string a = write("a.exr", cutPicture(picture, {20, 10, 60, 30}));
    const std::string b = write("b.exr", cutPicture(picture, {20, 30, 60, 41}));
    const std::string both = write("both.exr", cutPicture(picture, {20, 10, 60, 41}));
    ASSERT_EQ(merge({b, a}).exit_code, 0);
    EXPECT_EQ(bytesOf(path("merged.exr")), bytesOf(both));

    // The synthetic blocks leave some pixels empty.
    Window empty{0, 0, 1, 1};
    while (picture.image.count(picture.image.pixelIndex(empty.x0, empty.y0)) != 0)
        ++empty.x0, ++empty.x1;
    const std::string hole = write("hole.exr", cutPicture(picture, empty));
    ASSERT_EQ(merge({hole}).exit_code, 0);
    EXPECT_EQ(bytesOf(path("merged.exr")), bytesOf(hole));
    const Window below{empty.x0, 1, empty.x1, 70};
    const std::string rest = write("rest.exr", cutPicture(picture, below));
    const std::string column = write("column.exr", cutPicture(picture, unite(empty, below)));
    ASSERT_EQ(merge({hole, rest}).exit_code, 0);
    EXPECT_EQ(bytesOf(path("merged.exr")), bytesOf(column));
}

TEST_F(MergeCommand, GapsAreRefusedOrLeftEmpty) {
    const std::string a = write("a.exr", cutPicture(whole_, {0, 0, 90, 20}));
    const std::string b = write("b.exr", cutPicture(whole_, {0, 25, 90, 70}));
    const Outcome result = merge({a, b});
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_NE(result.err.find("no tile has the 90 x 5 pixels at (0, 20)"), std::string::npos)
        << result.err;
    EXPECT_FALSE(fs::exists(path("merged.exr")));
    ASSERT_EQ(merge({a, b}, {"--allow-gaps"}).exit_code, 0);
    EXPECT_EQ(runPeeler({"verify", path("merged.exr")}).exit_code, 0);
}

TEST_F(MergeCommand, IncompleteTilesAddUpUnlessTheyOverlap) {
    const auto incomplete = [&](const Window& window) {
        SyntheticPicture tile = cutPicture(whole_, window);
        tile.plan.fragments_counted += 10;
        return tile;
    };
    const std::string a = write("a.exr", incomplete({0, 0, 90, 20}));
    const std::string b = write("b.exr", incomplete({0, 20, 90, 70}));
    const std::string c = write("c.exr", incomplete({0, 19, 90, 70}));
    SyntheticPicture whole = whole_;
    whole.plan.fragments_counted += 20;
    ASSERT_EQ(merge({a, b}).exit_code, 0);
    EXPECT_EQ(bytesOf(path("merged.exr")), bytesOf(write("whole.exr", whole)));
    const Outcome result = merge({a, c});
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_NE(result.err.find("tiles overlap and lack fragments"), std::string::npos);
}

TEST_F(MergeCommand, OptionsThatDoNotSuitWhatTheTilesAre) {
    const std::string scene = (sourceDir() / "examples" / "scenes" / "coincident.glb").string();
    const auto refused = [&](const std::string& kind, std::vector<std::string> options) {
        const std::string tile = path(kind + ".exr");
        ASSERT_EQ(
            runPeeler({"render", scene, "-o", tile, "--as", kind, "--size", "16x9"}).exit_code, 0);
        const Outcome result = merge({tile}, options);
        EXPECT_EQ(result.exit_code, 2) << kind << " " << options.front() << ": " << result.err;
        EXPECT_NE(result.err.find(options.front()), std::string::npos) << result.err;
        EXPECT_FALSE(fs::exists(path("merged.exr")));
    };
    for (const char* kind : {"deep", "composite"}) {
        refused(kind, {"--layout", "per-file"});
        refused(kind, {"--no-composite"});
    }
    refused("composite", {"--compression", "zips"});
}

TEST_F(MergeCommand, WhatDoesNotBelongTogether) {
    const SyntheticPicture left = cutPicture(whole_, {0, 0, 40, 70});
    const SyntheticPicture right = cutPicture(whole_, {39, 0, 90, 70});
    const std::string a = write("a.exr", left);
    SyntheticPicture moved = right, plain = right, changed = right, precise = right;
    moved.plan.view.camera_to_world[3].x = 1e-9;
    plain.image.extra.clear();
    std::size_t fragment = 0;  // the first of the shared column
    for (int y = 0; fragment == 0; ++y) {
        const std::size_t pixel = right.image.pixelIndex(39, y);
        if (right.image.count(pixel) != 0) fragment = right.image.offsets[pixel];
    }
    changed.image.z[fragment] -= 0.25F;
    struct Row {
        std::string path, says;
    };
    const Row rows[] = {
        {write("camera.exr", moved), "peeler:cameraJson"},
        {write("channels.exr", plain), "channels"},
        {write("depth.exr", changed), "do not agree on pixel (39, "},
        {write("scene.exr", right, [](Provenance& p) { p.scene_hash = "ax"; }), "peeler:sceneHash"},
        {write("hash.exr", right, [](Provenance& p) { p.settings_hash = "x"; }),
         "peeler:settingsHash"},
        {write("frame.exr", right, [](Provenance& p) { p.frame = 8; }), "peeler:frame"},
        {write("time.exr", right, [](Provenance& p) { p.time = 8; }), "peeler:time"},
        {write("foreign.exr", right, [](Provenance& p) { p.version = ""; }),
         "nothing in it says which picture"},
    };
    for (const Row& row : rows) {
        const Outcome result = merge({a, row.path});
        EXPECT_EQ(result.exit_code, 3) << row.says;
        EXPECT_NE(result.err.find(row.says), std::string::npos) << row.says << '\n' << result.err;
    }
    EXPECT_FALSE(fs::exists(path("merged.exr")));
    const std::string other =
        write("renderer.exr", right, [](Provenance& p) { p.renderer = "another"; });
    const Outcome result = merge({a, other});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_NE(result.err.find("differ in peeler:renderer: test and another"), std::string::npos);
    EXPECT_EQ(merge({a, other}, {"-o", other}).exit_code, 2);
}

}  // namespace
}  // namespace peeler::test
