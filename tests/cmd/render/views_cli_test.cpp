// SPDX-License-Identifier: Apache-2.0
// Tests many views of a scene in one process: orbits, and files of cameras.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "formats/exr/layered_input.h"
#include "formats/gltf/gltf_builder.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

class Views : public testing::Test {
  protected:
    Outcome render(const std::string& output, std::vector<std::string> more) const {
        std::vector<std::string> arguments{
            "render", scene_.string(), "-o",    (scratch_ / output).string(),
            "--size", "48x40",         "--json"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return runPeeler(arguments);
    }
    /// Returns the views in the report of a render.
    Json rendered(const std::string& output, const std::vector<std::string>& more) const {
        const Outcome result = render(output, more);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return result.exit_code == 0 ? Json::parse(result.out).at("views") : Json::array();
    }
    std::string text(const std::string& file) const { return bytesOf(scratch_ / file); }
    std::string write(const std::string& file, const std::string& content) const {
        std::ofstream(scratch_ / file) << content;
        return (scratch_ / file).string();
    }

    ScratchDir scratch_;
    fs::path scene_ = sourceDir() / "examples/scenes/coincident.glb";
};

TEST_F(Views, OfOneProcessAreThoseOfMany) {
    const Json views = rendered("one/@@.exr", {"--views", "5", "--around", "orbit"});
    ASSERT_EQ(views.size(), 5U);
    for (int view = 0; view < 5; ++view) {
        const std::string name = "0" + std::to_string(view) + ".exr";
        EXPECT_EQ(views[static_cast<std::size_t>(view)].at("view"), view);
        EXPECT_EQ(views[static_cast<std::size_t>(view)].at("camera"), "000" + std::to_string(view));
        const std::string chunk = std::to_string(view + 1) + "/5";
        ASSERT_EQ(
            rendered("many/@@.exr", {"--views", "5", "--around", "orbit", "--chunk", chunk}).size(),
            1U);
        EXPECT_EQ(text("one/" + name), text("many/" + name)) << name;
        const ExrInfo info = readExrInfo((scratch_ / ("one/" + name)).string());
        EXPECT_EQ(info.provenance.view, view);
        EXPECT_EQ(info.plan.view.camera_name, "000" + std::to_string(view));
    }
    EXPECT_NE(text("one/00.exr"), text("one/01.exr"));
}

TEST_F(Views, OfATurntableCountFromOneIfAsked) {
    const std::vector<std::string> turn{
        "--views",   "3",  "--around",     "turntable", "--elevation", "10", "--clockwise",
        "--azimuth", "45", "--first-view", "1"};
    const Json views = rendered("turn.@@@@.exr", turn);
    ASSERT_EQ(views.size(), 3U);
    for (int i = 1; i <= 3; ++i) {
        const Json& view = views[static_cast<std::size_t>(i - 1)];
        const std::string file = "turn.000" + std::to_string(i) + ".exr";
        EXPECT_EQ(view.at("view"), i);
        EXPECT_EQ(view.at("camera"), "000" + std::to_string(i));
        EXPECT_EQ(readExrInfo((scratch_ / file).string()).provenance.view, i);
        EXPECT_TRUE(contains(view.at("output").get<std::string>(), file)) << view.at("output");
    }
    EXPECT_FALSE(fs::exists(scratch_ / "turn.0000.exr"));
    // A chunk of the turn writes the same files.
    std::vector<std::string> last = turn;
    last.insert(last.end(), {"--chunk", "3/3"});
    rendered("part.@@@@.exr", last);
    EXPECT_EQ(text("part.0003.exr"), text("turn.0003.exr"));
}

TEST_F(Views, OnlyOfACircleHaveAnElevation) {
    for (const std::vector<std::string>& option :
         {std::vector<std::string>{"--elevation", "10"}, {"--azimuth", "10"}, {"--clockwise"}}) {
        std::vector<std::string> line{"--views", "2"};
        line.insert(line.end(), option.begin(), option.end());
        const Outcome refused = render("@.exr", line);
        EXPECT_EQ(refused.exit_code, 2) << option[0];
        EXPECT_TRUE(contains(refused.err, "on a circle: " + option[0] + "\n")) << refused.err;
        EXPECT_TRUE(contains(refused.err, "add --around turntable")) << refused.err;
    }
    EXPECT_EQ(render("@.exr", {"--views", "2", "--around", "orbit", "--elevation", "90"}).exit_code,
              2);
    EXPECT_EQ(render("a.exr", {"--first-view", "1"}).exit_code, 2);
}

TEST_F(Views, OfTheirOwnFileOfCamerasAreTheSame) {
    const std::string cameras = (scratch_ / "transforms.json").string();
    rendered("a/v_@@@.exr", {"--views", "4", "--fov", "33", "--around", "random", "--normalize",
                             "unit-sphere", "--cameras-out", cameras});
    const Json file = Json::parse(text("transforms.json"));
    EXPECT_EQ(file.at("frames")[2].at("file_path"), "a/v_002.exr");
    rendered("b/v_@@@.exr", {"--cameras", cameras, "--normalize", "unit-sphere"});
    for (const std::string name : {"v_000.exr", "v_001.exr", "v_002.exr", "v_003.exr"})
        EXPECT_EQ(text("a/" + name), text("b/" + name)) << name;
}

TEST_F(Views, AreWrittenForOtherPrograms) {
    rendered("@.exr", {"--views", "3", "--cameras-out", (scratch_ / "model").string() + "/"});
    EXPECT_TRUE(fs::exists(scratch_ / "model/points3D.bin"));
    EXPECT_GT(fs::file_size(scratch_ / "model/points3D.bin"), 1000U);
    const Json again = rendered("again/@.exr", {"--cameras", (scratch_ / "model").string()});
    ASSERT_EQ(again.size(), 3U);
    // The conversion of poses to quaternions and back causes rounding errors of 1e-16.
    EXPECT_EQ(runPeeler({"compare", (scratch_ / "0002.exr").string(),
                         (scratch_ / "again/0002.exr").string(), "--max-depth", "1e-5"})
                  .exit_code,
              0);
    rendered("@.exr",
             {"--views", "3", "--cameras-out", (scratch_ / "bop/scene_camera.json").string()});
    EXPECT_EQ(
        rendered("bop/@.exr", {"--cameras", (scratch_ / "bop/scene_camera.json").string()}).size(),
        3U);
}

TEST_F(Views, AreWrittenIntoAFolderThatIsThere) {
    const std::string folder = (scratch_ / "c").string();
    fs::create_directory(folder);
    const std::vector<std::string> asked{"--views", "2", "--cameras-out", folder};
    rendered("@.exr", asked);
    const std::string cameras = text("c/cameras.bin");
    EXPECT_FALSE(cameras.empty());
    for (const char* again : {"--skip-existing", "--no-mkdir"}) {
        std::vector<std::string> more = asked;
        more.emplace_back(again);
        rendered("@.exr", more);
        EXPECT_EQ(text("c/cameras.bin"), cameras) << again;
    }
    const auto refused = [&](const std::vector<std::string>& more, int code, const char* what) {
        const Outcome result = render("x/@.exr", more);
        EXPECT_EQ(result.exit_code, code) << result.err;
        EXPECT_TRUE(contains(result.err, what)) << result.err;
        EXPECT_FALSE(fs::exists(scratch_ / "x"));
    };
    refused({"--views", "2", "--cameras-out", folder, "--no-clobber"}, 4, "already exists");
    // Files that the command reads must not be replaced.
    refused({"--cameras", folder, "--cameras-out", folder + "/"}, 2, "would replace");
    refused({"--cameras", folder + "/images.bin", "--cameras-out", folder}, 2, "would replace");
    write("c/points3D.txt", "");
    fs::remove(scratch_ / "c/points3D.bin");
    fs::create_directory(scratch_ / "c/points3D.bin");
    refused({"--views", "2", "--cameras-out", folder}, 4, "points3D.bin");
    const std::string bop = (scratch_ / "scene_camera.json").string();
    rendered("@.exr", {"--views", "2", "--cameras-out", bop});
    refused({"--cameras", bop, "--cameras-out", (scratch_ / "camera.json").string()}, 2,
            "would replace");
}

TEST_F(Views, OfColmapTextWithoutPointsAreRefused) {
    write("cameras.txt", "1 PINHOLE 48 40 40 40 24 20\n");
    write("images.txt", "1 1 0 0 0 0 0 0 1 a.png\n2 1 0 0 0 0 0 1 1 b.png\n");
    const Outcome result = render("@@.exr", {"--cameras", scratch_.path().string()});
    EXPECT_EQ(result.exit_code, 3) << result.err;
    EXPECT_TRUE(contains(result.err, "images.txt:2")) << result.err;
}

TEST_F(Views, AndFramesMultiply) {
    const Json views = rendered("f##_v@@.exr", {"--frames", "3,7", "--views", "2"});
    ASSERT_EQ(views.size(), 4U);
    const std::pair<int, int> numbers[] = {{3, 0}, {3, 1}, {7, 0}, {7, 1}};
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(views[i].at("frame"), numbers[i].first);
        EXPECT_EQ(views[i].at("view"), numbers[i].second);
        EXPECT_TRUE(fs::exists(scratch_ / ("f0" + std::to_string(numbers[i].first) + "_v0" +
                                           std::to_string(numbers[i].second) + ".exr")));
    }
}

TEST_F(Views, ThatAreThereAreLeftAlone) {
    const std::vector<std::string> asked{"--views", "3", "--skip-existing"};
    rendered("@.exr", asked);
    fs::remove(scratch_ / "0001.exr");
    const Json views = rendered("@.exr", asked);
    EXPECT_TRUE(views[0].contains("skipped"));
    EXPECT_FALSE(views[1].contains("skipped"));
    EXPECT_TRUE(views[2].contains("skipped"));
    // A different scale of the scene changes the picture.
    std::vector<std::string> other = asked;
    other.insert(other.end(), {"--normalize", "unit-cube"});
    const Json again = rendered("@.exr", other);
    EXPECT_FALSE(again[0].contains("skipped"));
    EXPECT_GT(again[0].at("normalized").at("scale"), 0);
}

TEST_F(Views, OfRaysAreBundlesOrFiles) {
    const auto rays = [&](const std::string& output, std::vector<std::string> more) {
        std::vector<std::string> arguments{
            "rays",   scene_.string(), "-o",     (scratch_ / output).string(),
            "--size", "48x40",         "--json", "--views",
            "3",      "--engine",      "cpu"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome result = runPeeler(arguments);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return Json::parse(result.out);
    };
    const Json all = rays("all.npz", {});
    EXPECT_EQ(all.at("bundles"), 3);
    const Json alone = rays("@.npz", {}).at("views");
    ASSERT_EQ(alone.size(), 3U);
    std::uint64_t hits = 0;
    for (const Json& view : alone)
        hits += view.at("hits").get<std::uint64_t>();
    EXPECT_EQ(all.at("hits"), hits);
    EXPECT_EQ(alone[2].at("camera"), "0002");
    // A view's file does not depend on other views traced before it.
    const std::string third = text("0002.npz");
    fs::remove(scratch_ / "0002.npz");
    const Json again = rays("@.npz", {"--skip-existing", "--chunk", "2/2"}).at("views");
    EXPECT_EQ(text("0002.npz"), third);
    EXPECT_FALSE(again.back().contains("skipped"));
    EXPECT_TRUE(rays("@.npz", {"--skip-existing"}).at("views")[2].contains("skipped"));
    // --dense changes the files; a second run with it skips them.
    EXPECT_FALSE(
        rays("@.npz", {"--skip-existing", "--dense", "4"}).at("views")[2].contains("skipped"));
    EXPECT_TRUE(
        rays("@.npz", {"--skip-existing", "--dense", "4"}).at("views")[2].contains("skipped"));
    const Outcome one = runPeeler({"rays", scene_.string(), "-o", (scratch_ / "all.npz").string(),
                                   "--views", "3", "--skip-existing"});
    EXPECT_EQ(one.exit_code, 2);
    EXPECT_NE(one.err.find("@@@@"), std::string::npos) << one.err;
}

TEST_F(Views, OfSheetsAreSheets) {
    const auto sheets = [&](std::vector<std::string> more) {
        std::vector<std::string> arguments{
            "sheet",  scene_.string(), "-o",     (scratch_ / "@.png").string(),
            "--size", "48x40",         "--json", "--views",
            "2",      "--cells",       "3"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Outcome result = runPeeler(arguments);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return Json::parse(result.out).at("views");
    };
    const Json views = sheets({});
    ASSERT_EQ(views.size(), 2U);
    EXPECT_EQ(views[1].at("output"), (scratch_ / "0001.png").string());
    EXPECT_NE(text("0000.png"), text("0001.png"));
    const std::string second = text("0001.png");
    EXPECT_EQ(sheets({"--chunk", "2/2"}).size(), 1U);
    EXPECT_EQ(text("0001.png"), second);
    EXPECT_TRUE(sheets({"--skip-existing"})[1].contains("skipped"));
    EXPECT_FALSE(sheets({"--skip-existing", "--progression"})[1].contains("skipped"));
    // An existing file that must not be replaced stops only its own picture.
    fs::remove(scratch_ / "0000.png");
    const Outcome kept = runPeeler({"sheet", scene_, "-o", (scratch_ / "@.png").string(), "--views",
                                    "2", "--size", "40x30", "--keep-going", "--no-clobber"});
    EXPECT_EQ(kept.exit_code, 4) << kept.err;
    EXPECT_NE(kept.err.find("0001.png"), std::string::npos) << kept.err;
    EXPECT_TRUE(fs::exists(scratch_ / "0000.png"));
}

TEST_F(Views, OfBopHaveObjectsInPlace) {
    // The scene is a triangle whose node is object 7. BOP's files place it 2 in front of a camera
    // at the origin, and 1 to the right.
    GltfBuilder builder = triangle();
    builder.gltf["nodes"] = {{{"name", "obj_000007"}, {"mesh", 0}, {"translation", {50, 60, 70}}}};
    builder.gltf["scenes"] = {{{"nodes", {0}}}};
    scene_ = builder.write(scratch_, "object.glb");
    write("camera.json", R"({"width": 40, "height": 40})");
    const std::string cameras = write("scene_camera.json", R"({
        "4": {"cam_K": [20, 0, 19.5, 0, 20, 19.5, 0, 0, 1], "depth_scale": 1}})");
    write("scene_gt.json", R"({"4": [{"obj_id": 7, "cam_R_m2c": [1, 0, 0, 0, 1, 0, 0, 0, 1],
                                      "cam_t_m2c": [1000, 0, 2000]}]})");
    const Json views = rendered("@.exr", {"--cameras", cameras, "--faces", "both"});
    ASSERT_EQ(views.size(), 1U);
    EXPECT_EQ(views[0].at("camera"), "000004");
    const ExrInfo info = readExrInfo((scratch_ / "0000.exr").string());
    ASSERT_FALSE(info.plan.layers.empty());
    // In OpenCV's axes y points down. With a focal length of 20, x from 1 to 2 and y from 0 to 1 at
    // depth 2 are pixels 30 to 40 and 20 to 30.
    EXPECT_EQ(info.plan.layers[0].data_window.x0, 30);
    EXPECT_EQ(info.plan.layers[0].data_window.y0, 20);

    // Rays and sheets must show the object in the same place, and detect when it moves.
    const auto made = [&](const char* verb, const char* name) {
        const Outcome result =
            runPeeler({verb, scene_, "-o", (scratch_ / name).string(), "--cameras", cameras,
                       "--faces", "both", "--skip-existing", "--json"});
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return Json::parse(result.out).at("views")[0];
    };
    EXPECT_GT(made("rays", "@.npz").at("hits"), 20);
    EXPECT_EQ(made("sheet", "@.png").at("layers"), 1);
    for (const auto& [verb, name] : {std::pair{"rays", "@.npz"}, {"sheet", "@.png"}})
        EXPECT_TRUE(made(verb, name).contains("skipped"));
    write("scene_gt.json", R"({"4": [{"obj_id": 7, "cam_R_m2c": [1, 0, 0, 0, 1, 0, 0, 0, 1],
                                      "cam_t_m2c": [5000, 0, 2000]}]})");
    EXPECT_EQ(made("rays", "@.npz").at("hits"), 0);
    EXPECT_EQ(made("sheet", "@.png").at("layers"), 0);
    const Outcome together =
        runPeeler({"rays", scene_, "-o", (scratch_ / "all.npz").string(), "--cameras", cameras});
    EXPECT_EQ(together.exit_code, 2);
    EXPECT_NE(together.err.find("@@@@"), std::string::npos) << together.err;

    write("scene_gt.json", R"({"4": [{"obj_id": 8, "cam_R_m2c": [1, 0, 0, 0, 1, 0, 0, 0, 1],
                                      "cam_t_m2c": [1000, 0, 2000]}]})");
    const Outcome missing = render("@.exr", {"--cameras", cameras});
    EXPECT_EQ(missing.exit_code, 3);
    EXPECT_NE(missing.err.find("obj_8"), std::string::npos) << missing.err;
}

TEST_F(Views, OfXRayGoThroughCorners) {
    for (const auto& [preset, axis] : {std::pair{"lari", 24.0}, {"xray", 24.5}}) {
        const std::string cameras = (scratch_ / preset / "transforms.json").string();
        const char* const name = preset == std::string("lari") ? "lari/@.png" : "xray/@.npz";
        rendered(name, {"--preset", preset, "--views", "1", "--cameras-out", cameras});
        EXPECT_EQ(Json::parse(bytesOf(cameras)).at("cx"), axis) << "corners have whole numbers";
    }
}

TEST_F(Views, ThatCannotBeAreRefused) {
    const std::string skewed =
        write("skewed.jsonl",
              "{\"K\": [[9,1,4],[0,9,4],[0,0,1]], \"size\": [9, 9], \"eye\": [0, 0, 9]}\n");
    const std::string singular = write(
        "singular.jsonl",
        "{\"fov\": 40, \"size\": [9, 9], \"cameraToWorld\": [[1,0,0,0],[0,1,0,0],[0,0,0,9]]}\n");
    const struct {
        std::vector<std::string> arguments;
        int code;
        std::string told;
    } rows[] = {
        {{"--views", "2"}, 2, "@@@@"},
        {{"--views", "0"}, 2, "--views 0"},
        {{"--views", "1000000000"}, 2, "1000000"},
        {{"--views", "1", "--around", "cube"}, 2, "sphere"},
        {{"--views", "1", "--seed", "3"}, 2, "--around random"},
        {{"--views", "1", "--camera", "0"}, 2, "--camera"},
        {{"--around", "orbit"}, 2, "--views"},
        {{"--cameras-out", "x.json"}, 2, "--views"},
        {{"--chunk", "1/2"}, 2, "--views"},
        {{"--camera-convention", "opencv"}, 2, "--cameras"},
        {{"--views", "1", "--cameras", skewed}, 2, "--cameras, --views"},
        {{"--cameras", skewed}, 3, "skew"},
        {{"--cameras", singular}, 3, "singular.jsonl"},
        {{"--cameras", skewed, "--camera-convention", "blunder"}, 2, "opencv, opengl"},
        {{"--cameras", (scratch_ / "none.json").string()}, 3, "none.json"},
    };
    for (const auto& row : rows) {
        const Outcome result = render("out.exr", row.arguments);
        EXPECT_EQ(result.exit_code, row.code) << result.err;
        EXPECT_NE(result.err.find(row.told), std::string::npos) << result.err << row.told;
        EXPECT_FALSE(fs::exists(scratch_ / "out.exr"));
    }
}

}  // namespace
}  // namespace peeler::test
