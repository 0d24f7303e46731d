// SPDX-License-Identifier: Apache-2.0
// Tests peeler merge: separately rendered tiles give the whole picture, byte for byte.
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <regex>

#include "formats/exr/cut_window.h"
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
    /// Returns the version that merge will record in its output.
    static std::string version() {
        const std::string text = runPeeler({"--version"}).out;
        // The output is the line "peeler 1.2.3 (commit)".
        return text.substr(7, text.find_first_of(" \n", 7) - 7);
    }
    Outcome merge(std::vector<std::string> tiles,
                  const std::vector<std::string>& options = {}) const {
        tiles.insert(tiles.begin(), "merge");
        if (std::ranges::count(options, "-o") == 0)
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

    // Finds an empty pixel in the first row of the picture.
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
    EXPECT_NE(result.err.find("tiles overlap and do not have all layers"), std::string::npos);
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

TEST_F(MergeCommand, ElementsRenderedApartAreThePictureOfBoth) {
    const std::string scene = (sourceDir() / "examples" / "scenes" / "engine.glb").string();
    for (const std::string kind : {"deep", "ldi"}) {
        const auto render = [&](const std::string& name, std::vector<std::string> more) {
            more.insert(more.begin(), {"render", scene, "-o", path(name), "--size", "120x68",
                                       "--channels", "id,normal", "--as", kind, "-q"});
            const Outcome result = runPeeler(more);
            EXPECT_EQ(result.exit_code, 0) << result.err;
            return path(name);
        };
        const std::string whole = render("whole.exr", {});
        const std::string a = render("a.exr", {"--include", "housing/upper"});
        const std::string b = render("b.exr", {"--exclude", "housing/upper"});
        // Without --elements, merge rejects files that are not tiles of one picture.
        EXPECT_EQ(merge({a, b}).exit_code, 3);
        const Outcome result = merge({a, b}, {"--elements", "--json"});
        ASSERT_EQ(result.exit_code, 0) << result.err;
        const Outcome same = runPeeler({"compare", path("merged.exr"), whole});
        EXPECT_EQ(same.exit_code, 0) << same.out << same.err;
        const Outcome good = runPeeler({"verify", path("merged.exr")});
        EXPECT_EQ(good.exit_code, 0) << good.out;
        const Json told = Json::parse(runPeeler({"info", path("merged.exr"), "--json"}).out);
        EXPECT_EQ(told.at("provenance").at("scene"), "engine.glb");
        EXPECT_TRUE(told.at("provenance").at("settings").is_null());
        const Json& elements = told.at("provenance").at("elements");
        ASSERT_EQ(elements.size(), 2U);
        EXPECT_EQ(elements[0].at("file"), "a.exr");
        EXPECT_EQ(elements[0].at("scene"), "engine.glb");
        EXPECT_EQ(elements[0].at("include"), Json::array({"housing/upper"}));
        EXPECT_TRUE(contains(runPeeler({"info", path("merged.exr")}).out,
                             "merged of:\n  a.exr: engine.glb, include [\"housing/upper\"]\n"
                             "  b.exr: engine.glb, exclude [\"housing/upper\"]\n"));
        // IDs and names are still those of the scene.
        for (const std::string& from : {path("merged.exr"), whole}) {
            const Outcome flat =
                runPeeler({"flatten", from, "--include", "base", "-o", from + ".base.exr", "-q"});
            EXPECT_EQ(flat.exit_code, 0) << flat.err;
        }
        EXPECT_EQ(
            runPeeler({"compare", path("merged.exr.base.exr"), whole + ".base.exr"}).exit_code, 0);
    }
}

TEST_F(MergeCommand, ElementsOfOtherScenesKeepTheirNames) {
    const auto render = [&](const std::string& name, const std::string& scene) {
        const Outcome result =
            runPeeler({"render", (sourceDir() / "examples" / "scenes" / scene).string(), "-o",
                       path(name), "--size", "64x36", "--channels", "id", "--eye", "1,1,1",
                       "--target", "0,0,0", "--near", "0.01", "-q"});
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return path(name);
    };
    const std::string a = render("a.exr", "coincident.glb"), b = render("b.exr", "engine.glb");
    ASSERT_EQ(merge({a, b, a}, {"--elements"}).exit_code, 0);
    // If an input is itself a merge, the result lists the input's elements.
    fs::rename(path("merged.exr"), path("three.exr"));
    ASSERT_EQ(merge({path("three.exr"), b}, {"--elements"}).exit_code, 0);
    EXPECT_TRUE(contains(runPeeler({"info", path("merged.exr")}).out,
                         "from: several scenes, frame 0, 0 s, by a-buffer"));
    EXPECT_EQ(Json::parse(runPeeler({"info", path("merged.exr"), "--json"}).out)
                  .at("provenance")
                  .at("elements")
                  .size(),
              4U);
    fs::rename(path("three.exr"), path("merged.exr"));
    const auto flat = [&](const std::string& from, const std::string& glob,
                          const std::string& name) {
        const Outcome result =
            runPeeler({"flatten", from, "--include", glob, "-o", path(name), "-q"});
        EXPECT_EQ(result.exit_code, 0) << result.err;
    };
    flat(path("merged.exr"), "base", "merged.base.exr");
    flat(b, "base", "b.base.exr");
    const Outcome same = runPeeler({"compare", path("merged.base.exr"), path("b.base.exr")});
    EXPECT_EQ(same.exit_code, 0) << same.out;
    // The third file has the same names as the first.
    const Json merged =
        Json::parse(runPeeler({"flatten", path("merged.exr"), "--include", "same cube twice", "-o",
                               path("cube.exr"), "--json", "-q"})
                        .out);
    const Json once = Json::parse(runPeeler({"flatten", a, "--include", "same cube twice", "-o",
                                             path("cube1.exr"), "--json", "-q"})
                                      .out);
    EXPECT_GT(once.at("fragmentsStored").get<int>(), 0);
    EXPECT_EQ(merged.at("fragmentsStored").get<int>(), 2 * once.at("fragmentsStored").get<int>());
}

TEST_F(MergeCommand, ElementsOfOtherPicturesAreRefused) {
    const SyntheticPicture& picture = whole_;
    SyntheticPicture moved = picture, large = picture,
                     precise = makePicture({.width = 90,
                                            .height = 70,
                                            .color_type = PixelType::kFloat,
                                            .extra = true});
    moved.plan.view.camera_to_world[3].x = 1;
    large.plan.view.width = 99;
    const std::string a = write("a.exr", picture);
    const struct {
        std::string path, says;
    } rows[] = {
        {write("moved.exr", moved), "they differ in the camera's position"},
        {write("large.exr", large), "they differ in the size of the picture"},
        {write("precise.exr", precise), "they differ in --precision"},
    };
    for (const auto& row : rows) {
        const Outcome result = merge({a, row.path}, {"--elements"});
        EXPECT_EQ(result.exit_code, 3) << row.says;
        EXPECT_NE(result.err.find(row.says), std::string::npos) << result.err;
    }
    const std::string later = write("later.exr", picture, [](Provenance& p) { p.frame = 8; });
    const Outcome result = merge({a, later}, {"--elements"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NE(result.err.find("differ in the frame: 7 and 8"), std::string::npos) << result.err;
}

TEST_F(MergeCommand, TilesOfOtherSettingsAreToldTheOptions) {
    const std::string scene = (sourceDir() / "examples" / "scenes" / "coincident.glb").string();
    const auto tile = [&](const std::string& name, std::vector<std::string> more) {
        more.insert(more.begin(), {"render", scene, "-o", path(name), "--size", "32x18", "-q"});
        const Outcome result = runPeeler(more);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return path(name);
    };
    const std::string a = tile("a.exr", {"--tile", "1/2"});
    const struct {
        std::vector<std::string> options;
        std::string differ, first, other;
    } rows[] = {
        {{"--channels", "normal,id"}, "--channels", "--channels none", "--channels normal,id"},
        {{"--exclude", "floor"}, "--exclude", "--exclude none", "--exclude floor"},
        {{"--faces", "both", "--samples", "2"},
         "--samples and --faces",
         "--samples 1, --faces gltf",
         "--samples 2, --faces both"},
        {{"--camera", "front"}, "the camera", "the camera main", "the camera front"},
        {{"--shading", "unlit"}, "--shading", "--shading pbr", "--shading unlit"},
        {{"--layers", "2"}, "--layers", "--layers all", "--layers 2"},
        {{"--occlusion-ratio", "0.25"},
         "--occlusion-ratio",
         "--occlusion-ratio 0",
         "--occlusion-ratio 0.25"},
        {{"--transmission", "opaque"},
         "--transmission",
         "--transmission alpha",
         "--transmission opaque"},
        {{"--clip-plane", "0,1,0,0"},
         "--clip-box, --clip-plane or --clip-mesh",
         "--clip-mesh none",
         "--clip-mesh given"},
    };
    for (const auto& row : rows) {
        std::vector<std::string> options = row.options;
        options.insert(options.end(), {"--tile", "2/2"});
        const std::string b = tile("b.exr", options);
        const Outcome result = merge({a, b});
        EXPECT_EQ(result.exit_code, 3) << row.differ;
        EXPECT_NE(result.err.find("they differ in " + row.differ), std::string::npos) << result.err;
        EXPECT_NE(result.err.find(row.first), std::string::npos) << result.err;
        EXPECT_NE(result.err.find(row.other), std::string::npos) << result.err;
        // verify rejects the same pairs, except that tiles may have different cameras. Neither
        // merge nor verify prints hashes.
        const Outcome verified = runPeeler({"verify", a, b});
        const bool camera_only = row.options.front() == "--camera";
        EXPECT_EQ(verified.exit_code, camera_only ? 0 : 3) << verified.out;
        for (const std::string& text : {result.err, verified.out}) {
            EXPECT_FALSE(std::regex_search(text, std::regex("[0-9a-f]{16}"))) << text;
        }
    }
}

TEST_F(MergeCommand, TilesThatHaveChangedAreRefused) {
    const std::string a = write("a.exr", cutPicture(whole_, {0, 0, 40, 70}));
    const std::string b = write("b.exr", cutPicture(whole_, {40, 0, 90, 70}));
    const std::string good = bytesOf(b);
    std::string bytes = good;
    bytes[bytes.find("peeler:renderer") + 30] ^= 1;  // a letter of the renderer's name
    std::ofstream(b, std::ios::binary) << bytes;
    const Outcome result = merge({a, b});
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_TRUE(contains(result.err, b + ": composite")) << result.err;
    EXPECT_TRUE(contains(result.err, "the file has changed since peeler wrote it")) << result.err;
    EXPECT_FALSE(fs::exists(path("merged.exr")));
    std::ofstream(b, std::ios::binary) << good;
    EXPECT_EQ(merge({a, b}).exit_code, 0);
}

TEST_F(MergeCommand, WhatDoesNotBelongTogether) {
    const SyntheticPicture left = cutPicture(whole_, {0, 0, 40, 70});
    const SyntheticPicture right = cutPicture(whole_, {39, 0, 90, 70});
    const std::string a = write("a.exr", left);
    SyntheticPicture moved = right, plain = right, changed = right, precise = right;
    moved.plan.view.camera_to_world[3].x = 1e-9;
    SyntheticPicture large = right;
    ++large.plan.view.height;
    large.plan.view.projection.half_height *= 2;
    plain.image.extra.clear();
    std::size_t fragment = 0;  // index of the first fragment in the column that both tiles contain
    for (int y = 0; fragment == 0; ++y) {
        const std::size_t pixel = right.image.pixelIndex(39, y);
        if (right.image.count(pixel) != 0) fragment = right.image.offsets[pixel];
    }
    changed.image.z[fragment] -= 0.25F;
    struct Row {
        std::string path, says;
    };
    const Row rows[] = {
        {write("camera.exr", moved), "they differ in the camera's position"},
        {write("size.exr", large), "differ in the size of the picture and the field of view"},
        {write("channels.exr", plain), "channels"},
        {write("depth.exr", changed), "differ at pixel (39, "},
        {write("scene.exr", right, [](Provenance& p) { p.scene_hash = "ax"; }),
         "they differ in the scene s.glb, which has changed since"},
        {write("other.exr", right,
               [](Provenance& p) {
                   p.scene_hash = "ax";
                   p.scene = "t.glb";
               }),
         "the first has the scene s.glb\npeeler: hint: the other has the scene t.glb"},
        {write("hash.exr", right, [](Provenance& p) { p.settings_hash = "x"; }),
         "other settings, which peeler " + version() + " did not record"},
        {write("frame.exr", right, [](Provenance& p) { p.frame = 8; }),
         "the first has the frame 7\npeeler: hint: the other has the frame 8"},
        {write("time.exr", right, [](Provenance& p) { p.time = 8; }), "they differ in the time"},
        {write("foreign.exr", right, [](Provenance& p) { p.version = ""; }),
         "does not say which picture"},
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
    EXPECT_NE(result.err.find("differ in renderer: test and another"), std::string::npos);
    EXPECT_EQ(merge({a, other}, {"-o", other}).exit_code, 2);
}

}  // namespace
}  // namespace peeler::test
