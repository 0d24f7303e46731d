// SPDX-License-Identifier: Apache-2.0
// Tests times, frames and the selection of nodes on the command line.
#include <ImfHeader.h>
#include <ImfMultiPartInputFile.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "formats/gltf/gltf_builder.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Writes a triangle ("sail") that moves 3 to the right in one second and, in a second animation, 3
/// up; a triangle that does not move ("rock"); and an orthographic camera, 8 units wide, for
/// pictures of 80 pixels.
fs::path boats(const ScratchDir& folder) {
    GltfBuilder builder = triangle();
    const int times = builder.addAccessor<float>({0, 1}, "SCALAR");
    const int right = builder.addAccessor<float>({0, 0, 0, 3, 0, 0}, "VEC3");
    const int up = builder.addAccessor<float>({0, 0, 0, 0, 3, 0}, "VEC3");
    const auto go = [&](const char* name, int output) {
        return Json{
            {"name", name},
            {"samplers", {{{"input", times}, {"output", output}}}},
            {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}}};
    };
    builder.gltf["animations"] = {go("drift", right), go("fly", up)};
    builder.gltf["cameras"] = {
        {{"type", "orthographic"},
         {"orthographic", {{"xmag", 4}, {"ymag", 4}, {"znear", 0}, {"zfar", 10}}}}};
    builder.gltf["nodes"] = {{{"name", "sail"}, {"mesh", 0}},
                             {{"name", "rock"}, {"mesh", 0}, {"translation", {-3, -3, 0}}},
                             {{"camera", 0}, {"translation", {0, 0, 5}}}};
    builder.gltf["scenes"] = {{{"nodes", {0, 1, 2}}}};
    return builder.write(folder, "boats.glb");
}

/// Returns the data window of a file's first layer.
Imath::Box2i windowOf(const fs::path& file) {
    const Imf::MultiPartInputFile input(file.c_str());
    EXPECT_EQ(input.header(1).name(), "layer_000");
    return input.header(1).dataWindow();
}

Outcome renderBoats(const fs::path& scene, const fs::path& out, std::vector<std::string> more) {
    std::vector<std::string> arguments{"render", scene.string(), "-o",    out.string(),
                                       "--size", "80x80",        "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runPeeler(arguments);
}

TEST(Time, MovesTheScene) {
    const ScratchDir folder;
    const fs::path scene = boats(folder);
    const struct {
        std::vector<std::string> arguments;
        /// Upper left corner of the sail's data window. At rest its left edge is at 40 and its tip
        /// at 30; the first row below the tip is narrower than a pixel.
        int x0, y0;
    } rows[] = {
        {{}, 40, 31},
        {{"--time", "0"}, 40, 31},
        {{"--time", "0.5"}, 55, 31},
        {{"--time", "1"}, 70, 31},
        {{"--time", "99"}, 70, 31},
        {{"--animation", "fly", "--time", "1"}, 40, 1},
        {{"--animation", "1", "--time", "0.5"}, 40, 16},
        {{"--animation", "all", "--time", "0.5"}, 40, 16},
        {{"--animation", "fly"}, 40, 31},
    };
    for (const auto& row : rows) {
        std::vector<std::string> arguments = row.arguments;
        arguments.insert(arguments.end(), {"--exclude", "rock"});
        const Outcome result = renderBoats(scene, folder / "out.exr", arguments);
        ASSERT_EQ(result.exit_code, 0) << result.err;
        EXPECT_FALSE(Json::parse(result.out).contains("frame"));
        const Imath::Box2i window = windowOf(folder / "out.exr");
        EXPECT_EQ(window.min, Imath::V2i(row.x0, row.y0));
    }
}

TEST(Frames, AreFilesOfTheirOwnWithTheirTimes) {
    const ScratchDir folder;
    const fs::path scene = boats(folder);
    const Outcome result = renderBoats(scene, folder / "f.###.exr",
                                       {"--frames", "10-0x5", "--fps", "10", "--exclude", "rock"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Json frames = Json::parse(result.out).at("frames");
    ASSERT_EQ(frames.size(), 3U);
    const int expected_frames[] = {10, 5, 0}, left[] = {70, 55, 40};
    for (std::size_t i = 0; i < 3; ++i) {
        const int frame = expected_frames[i];
        EXPECT_EQ(frames[i].at("frame"), frame);
        EXPECT_EQ(frames[i].at("time"), frame / 10.0);
        EXPECT_EQ(frames[i].at("complete"), true);
        const std::string number = std::to_string(1000 + frame).substr(1);
        const fs::path file = folder / ("f." + number + ".exr");
        EXPECT_EQ(frames[i].at("output"), file.string());
        EXPECT_EQ(windowOf(file).min.x, left[i]);
        // The file must equal that of a frame rendered alone, except for the attributes of the
        // frame.
        ASSERT_EQ(
            renderBoats(scene, folder / "alone.#.exr",
                        {"--frames", std::to_string(frame), "--fps", "10", "--exclude", "rock"})
                .exit_code,
            0);
        const std::string four = std::to_string(10000 + frame).substr(1);
        EXPECT_EQ(bytesOf(file), bytesOf(folder / ("alone." + four + ".exr")));
    }
    const Outcome header = runCommand({"exrheader", (folder / "f.005.exr").string()});
    EXPECT_NE(header.out.find("peeler:frame (type int): 5"), std::string::npos) << header.out;
    EXPECT_NE(header.out.find("peeler:time (type double): 0.5"), std::string::npos);
    EXPECT_NE(header.out.find("framesPerSecond (type rational): 10/1"), std::string::npos);
    std::size_t files = 0;
    for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder.path()))
        ++files;
    EXPECT_EQ(files, 7U);
}

TEST(Frames, AreFramedByTheWholeMovement) {
    const ScratchDir folder;
    GltfBuilder builder = triangle();
    const int times = builder.addAccessor<float>({0, 1}, "SCALAR");
    const int right = builder.addAccessor<float>({0, 0, 0, 30, 0, 0}, "VEC3");
    builder.gltf["animations"] = {
        {{"samplers", {{{"input", times}, {"output", right}}}},
         {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}}}};
    const fs::path scene = builder.write(folder, "far.glb");
    const Outcome result = renderBoats(scene, folder / "f.#.exr", {"--frames", "0,12,24"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Json report = Json::parse(result.out);
    for (const Json& frame : report.at("frames"))
        EXPECT_GT(frame.at("fragmentsCounted"), 0) << frame;
    EXPECT_LT(windowOf(folder / "f.0000.exr").max.x, windowOf(folder / "f.0012.exr").min.x);
    EXPECT_LT(windowOf(folder / "f.0012.exr").max.x, windowOf(folder / "f.0024.exr").min.x);
}

TEST(Frames, RefusesWhatContradictsItself) {
    const ScratchDir folder;
    const fs::path scene = boats(folder);
    const struct {
        const char* out;
        std::vector<std::string> arguments;
        const char* words;
    } rows[] = {
        {"a.exr", {"--frames", "1-2"}, "same file name"},
        {"a.#.exr", {"--frames", "1-2", "--time", "1"}, "every frame already has its own time"},
        {"a.exr", {"--fps", "25"}, "a frame rate needs frames"},
        {"a.#.exr", {"--frames", "1-"}, "--frames 1-"},
        {"a.#.exr", {"--frames", "1", "--fps", "0"}, "--fps 0"},
        {"a.#.exr", {"--frames", "1", "--fps", "1e-310"}, "from 0.001"},
        {"light.hdr.exr",
         {"--environment", (folder / "light.hdr.exr").string()},
         "the output is the input"},
        {"b.#.exr",
         {"--frames", "1-2", "--report", (folder / "b.0002.exr").string()},
         "the report would replace"},
        {"a.exr", {"--animation", "flu"}, "did you mean 'fly'?"},
        {"a.exr", {"--animation", "2"}, "index from 0 to 1"},
        {"a.exr", {"--include", "sial"}, "did you mean 'sail'?"},
        {"boats.glb", {"--frames", "1"}, "boats.glb"},
    };
    for (const auto& row : rows) {
        const Outcome result = renderBoats(scene, folder / row.out, row.arguments);
        EXPECT_EQ(result.exit_code, 2) << row.words << '\n' << result.err;
        EXPECT_NE(result.err.find(row.words), std::string::npos) << result.err;
    }
    // The name of a single frame needs no #.
    EXPECT_EQ(renderBoats(scene, folder / "one.exr", {"--frames", "3"}).exit_code, 0);
}

TEST(Selection, ShowsOnlyWhatIsIncluded) {
    const ScratchDir folder;
    const fs::path scene = boats(folder);
    ASSERT_EQ(renderBoats(scene, folder / "a.exr", {"--include", "r*"}).exit_code, 0);
    EXPECT_EQ(windowOf(folder / "a.exr").min.x, 10);
    ASSERT_EQ(renderBoats(scene, folder / "b.exr", {}).exit_code, 0);
    EXPECT_EQ(windowOf(folder / "b.exr").max.x, 48);
}

TEST(Info, ListsAnimations) {
    const ScratchDir folder;
    const fs::path scene = boats(folder);
    const Json info = Json::parse(runPeeler({"info", "--json", scene.string()}).out);
    ASSERT_EQ(info.at("animations").size(), 2U);
    EXPECT_EQ(info["animations"][1].at("name"), "fly");
    EXPECT_EQ(info["animations"][1].at("duration"), 1.0);
    EXPECT_EQ(info["animations"][1]["channels"][0].at("property"), "translation");
    const std::string text = runPeeler({"info", scene.string()}).out;
    EXPECT_NE(text.find("  1  fly, 1 s, 1 channel\n"), std::string::npos) << text;
}

}  // namespace
}  // namespace peeler::test
