// SPDX-License-Identifier: Apache-2.0
// Tests warnings about empty pictures, and notes about the scene's own camera.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;
using Options = std::vector<std::string>;

/// A scratch folder with a scene, and runs of verbs that write into it.
struct Shot {
    ScratchDir folder;
    std::string scene = writeScene(folder.path(), stackScene(1)).string();

    void write(const nlohmann::json& json) const;
    std::string file(const char* name) const { return (folder / name).string(); }
    Outcome run(const char* verb, const std::string& in, const char* out,
                const Options& options) const {
        Options line{verb, in, "-o", file(out)};
        line.insert(line.end(), options.begin(), options.end());
        return runPeeler(line);
    }
    Outcome render(Options options, const char* out = "out.exr") const {
        options.insert(options.end(), {"--size", "8x8"});
        return run("render", scene, out, options);
    }
};

// GCC 12 would warn about a dangling pointer if it inlined this function.
[[gnu::noinline]] void Shot::write(const nlohmann::json& json) const {
    writeScene(folder.path(), json);
}

/// Expects that a run warns that its picture is empty for this reason, and that --strict refuses
/// the picture with exit code 6.
void expectEmpty(const Shot& shot, Options options, const std::string& reason) {
    SCOPED_TRACE(reason);
    const Outcome kept = shot.render(options);
    EXPECT_EQ(kept.exit_code, 0) << kept.err;
    EXPECT_TRUE(contains(kept.err, "warning: " + shot.file("out.exr") + " is empty: " + reason))
        << kept.err;
    EXPECT_TRUE(fs::remove(shot.folder / "out.exr"));
    options.emplace_back("--strict");
    const Outcome strict = shot.render(options);
    EXPECT_EQ(strict.exit_code, 6) << strict.err;
    EXPECT_TRUE(contains(strict.err, "error: the picture is empty: " + reason)) << strict.err;
    EXPECT_FALSE(fs::exists(shot.folder / "out.exr"));
}

TEST(EmptyPicture, HasAReason) {
    Shot shot;
    EXPECT_FALSE(contains(shot.render({}).err, "empty"));
    expectEmpty(shot, {"--eye", "0,0,3", "--target", "0,0,9"}, "the scene lies behind the camera");
    expectEmpty(shot, {"--far", "2"}, "the scene lies behind the far plane (--far)");
    expectEmpty(shot, {"--eye", "0,0,300", "--target", "0,300,0", "--fov", "20"},
                "the scene lies outside the camera's field of view");
    expectEmpty(shot, {"--clip-box", "900,900,900,901,901,901"}, "nothing is left inside the clip");
    nlohmann::json scene = stackScene(1);
    scene["nodes"][0]["name"] = "wall";
    shot.write(scene);
    expectEmpty(shot, {"--exclude", "wall"}, "--include and --exclude leave no meshes");
    scene["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"][3] = 0;
    shot.write(scene);
    expectEmpty(shot, {}, "all its surfaces are fully transparent");
    scene["nodes"][0].erase("mesh");
    shot.write(scene);
    expectEmpty(shot, {}, "the scene has no meshes");
}

TEST(EmptyPicture, IsCountedInASequence) {
    const Shot shot;
    const Outcome result = shot.render({"--cameras", shot.file("poses.jsonl")}, "@.exr");
    EXPECT_EQ(result.exit_code, 3);  // the camera file does not exist yet
    writeText(shot.folder / "poses.jsonl", R"({"eye": [0, 0, 3], "target": [0, 0, 9], "fov": 40})"
                                           "\n"
                                           R"({"eye": [0, 0, 3], "target": [0, 0, 0], "fov": 40})"
                                           "\n"
                                           R"({"eye": [0, 0, 3], "target": [0, 0, 8], "fov": 40})"
                                           "\n");
    const Outcome views = shot.render({"--cameras", shot.file("poses.jsonl")}, "@.exr");
    EXPECT_EQ(views.exit_code, 0) << views.err;
    EXPECT_TRUE(contains(views.err, "0000.exr is empty: ")) << views.err;
    EXPECT_FALSE(contains(views.err, "0002.exr is empty: ")) << views.err;
    EXPECT_TRUE(contains(views.err, "warning: 2 of 3 pictures are empty.")) << views.err;
}

TEST(EmptyPicture, OfALayeredFileToo) {
    const Shot shot;
    EXPECT_EQ(shot.render({"--channels", "id"}).exit_code, 0);
    const std::string file = shot.file("out.exr");
    const Outcome kept = shot.run("flatten", file, "flat.png", {"--exclude", "*"});
    EXPECT_EQ(kept.exit_code, 0) << kept.err;
    EXPECT_TRUE(contains(kept.err, "flat.png is empty: --include, --exclude and --material leave"))
        << kept.err;
    EXPECT_EQ(shot.run("flatten", file, "flat.png", {"--exclude", "*", "--strict"}).exit_code, 6);
}

TEST(SceneCamera, IsNamedAndCutsOff) {
    const Shot shot;  // the wall fills the picture and more
    EXPECT_TRUE(contains(shot.render({}).err,
                         ", camera front (cuts the scene off; --camera auto shows all of it), "));
    EXPECT_TRUE(contains(shot.render({"--camera", "front"}).err, ", camera front, "));
    EXPECT_FALSE(contains(shot.render({"--fov", "30"}).err, "camera"));
    nlohmann::json scene = stackScene(1);
    scene["nodes"][0]["scale"] = {1, 1, 1};
    shot.write(scene);
    EXPECT_TRUE(contains(shot.render({}).err, ", camera front, "));
}

/// "auto" gives the picture of the same scene without cameras.
TEST(SceneCamera, CanBeIgnored) {
    const Shot shot;
    const Options compare{"compare", shot.file("auto.exr"), shot.file("none.exr"), "--max-rmse",
                          "0"};
    EXPECT_EQ(shot.render({"--camera", "auto"}, "auto.exr").exit_code, 0);
    nlohmann::json scene = stackScene(1);
    scene.erase("cameras");
    scene["nodes"][1].erase("camera");
    shot.write(scene);
    EXPECT_EQ(shot.render({}, "none.exr").exit_code, 0);
    EXPECT_EQ(runPeeler(compare).exit_code, 0);
    EXPECT_EQ(shot.render({"--camera", "auto", "--fov", "40"}, "none.exr").exit_code, 0);
    EXPECT_EQ(runPeeler(compare).exit_code, 0);
}

}  // namespace
}  // namespace peeler::test
