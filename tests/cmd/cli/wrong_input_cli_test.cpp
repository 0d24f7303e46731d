// SPDX-License-Identifier: Apache-2.0
// Tests damaged scenes, missing files, folders and full disks. Each gives its exit code and a
// message with problem, place and remedy, and leaves no file.
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

class WrongInput : public testing::Test {
  protected:
    WrongInput() { fs::create_directory(out_); }

    Outcome render(const fs::path& scene, const std::vector<std::string>& more = {}) const {
        std::vector<std::string> arguments{
            "render", scene.string(), "-o", (out_ / "a.exr").string(), "--size", "64x64"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return runPeeler(arguments);
    }

    void expectRefused(const Outcome& result, int code,
                       const std::vector<std::string>& parts) const {
        EXPECT_EQ(result.exit_code, code) << result.err;
        EXPECT_EQ(result.out, "");
        EXPECT_TRUE(contains("\n" + result.err, "\npeeler: error: ")) << result.err;
        EXPECT_TRUE(contains(result.err, "\npeeler: hint: ")) << result.err;
        for (const std::string& part : parts) {
            EXPECT_TRUE(contains(result.err, part)) << "no \"" << part << "\" in\n" << result.err;
        }
        EXPECT_TRUE(fs::is_empty(out_)) << "something was left behind";
    }

    ScratchDir scratch_;
    fs::path out_ = scratch_ / "out";
};

TEST_F(WrongInput, MissingScene) {
    expectRefused(render(scratch_ / "absent.glb"), 3, {"absent.glb"});
    const Outcome info = runPeeler({"info", (scratch_ / "absent.glb").string()});
    expectRefused(info, 3, {"absent.glb"});
}

TEST_F(WrongInput, FolderAsScene) {
    expectRefused(render(scratch_.path()), 3, {scratch_.path().string()});
    expectRefused(runPeeler({"info", scratch_.path().string()}), 3, {scratch_.path().string()});
}

TEST_F(WrongInput, NotAScene) {
    writeText(scratch_ / "scene.gltf", "hello");
    expectRefused(render(scratch_ / "scene.gltf"), 3, {"scene.gltf"});
    expectRefused(runPeeler({"info", (scratch_ / "scene.gltf").string()}), 3, {"scene.gltf"});
    writeText(scratch_ / "scene.gltf", "");
    expectRefused(render(scratch_ / "scene.gltf"), 3, {"scene.gltf"});
}

TEST_F(WrongInput, TruncatedGlbAtEveryPlace) {
    const std::string whole = glb(triangleScene());
    writeText(scratch_ / "whole.glb", whole);
    EXPECT_EQ(render(scratch_ / "whole.glb").exit_code, 0);
    fs::remove(out_ / "a.exr");
    for (const std::size_t size :
         {std::size_t{3}, std::size_t{11}, std::size_t{13}, whole.size() / 2, whole.size() - 60,
          whole.size() - 10, whole.size() - 1}) {
        writeText(scratch_ / "cut.glb", whole.substr(0, size));
        SCOPED_TRACE(size);
        expectRefused(render(scratch_ / "cut.glb"), 3, {"cut.glb"});
    }
}

TEST_F(WrongInput, IndexOutOfRange) {
    const fs::path scene = writeScene(scratch_.path(), triangleScene(), triangleBuffer({0, 1, 7}));
    expectRefused(render(scene), 3, {"index 2 is 7", "/meshes/0/primitives/0/indices"});
    auto json = triangleScene();
    json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 9;
    expectRefused(render(writeScene(scratch_.path(), json)), 3, {"/meshes/0/primitives/0"});
}

TEST_F(WrongInput, NodeCycle) {
    auto json = triangleScene();
    json["nodes"] = {{{"mesh", 0}, {"children", {1}}}, {{"children", {0}}}};
    expectRefused(render(writeScene(scratch_.path(), json)), 3, {"/nodes/"});
}

TEST_F(WrongInput, UnknownRequiredExtension) {
    auto json = triangleScene();
    json["extensionsUsed"] = json["extensionsRequired"] = {"EXT_made_up"};
    expectRefused(render(writeScene(scratch_.path(), json)), 3, {"EXT_made_up"});
}

TEST_F(WrongInput, MissingTextureIsAWarningAndAnErrorUnderStrict) {
    auto json = triangleScene();
    json["images"] = {{{"uri", "absent.png"}}};
    json["textures"] = {{{"source", 0}}};
    json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
    const fs::path scene = writeScene(scratch_.path(), json);
    expectRefused(render(scene, {"--strict"}), 3, {"absent.png"});
    const Outcome lenient = render(scene);
    EXPECT_EQ(lenient.exit_code, 0) << lenient.err;
    EXPECT_TRUE(contains(lenient.err, "peeler: warning: ")) << lenient.err;
    EXPECT_TRUE(contains(lenient.err, "absent.png")) << lenient.err;
    EXPECT_FALSE(contains(lenient.err, "peeler: error:")) << lenient.err;
    EXPECT_TRUE(fs::exists(out_ / "a.exr"));
}

TEST_F(WrongInput, OutputFolderThatTakesNothing) {
    const fs::path scene = writeScene(scratch_.path());
    const auto renderTo = [&](const fs::path& output) {
        return runPeeler({"render", scene.string(), "-o", output.string()});
    };
    const Outcome absent = runPeeler(
        {"render", scene.string(), "-o", (scratch_ / "absent" / "a.exr").string(), "--no-mkdir"});
    expectRefused(absent, 4, {"absent/a.exr"});
    expectRefused(renderTo(scene / "a.exr"), 4, {"scene.gltf/a.exr"});
    // The path is a folder, and its name has no extension.
    expectRefused(renderTo(out_), 2, {out_.string()});

    const fs::path named = scratch_ / "folder.exr";
    fs::create_directory(named);
    expectRefused(renderTo(named), 4, {"folder.exr"});

    // Even root cannot write to /proc.
    const fs::path closed = geteuid() == 0 ? fs::path("/proc") : scratch_ / "closed";
    if (geteuid() != 0) {
        fs::create_directory(closed);
        fs::permissions(closed, fs::perms::owner_read | fs::perms::owner_exec);
    }
    expectRefused(renderTo(closed / "a.exr"), 4, {(closed / "a.exr").string()});
}

TEST_F(WrongInput, ReportThatCannotBeWrittenIsFoundBeforeTheRender) {
    const fs::path scene = writeScene(scratch_.path());
    expectRefused(render(scene, {"--report", (scene / "r.json").string()}), 4,
                  {"scene.gltf/r.json"});
}

TEST_F(WrongInput, NoClobberKeepsWhatIsThere) {
    const fs::path scene = writeScene(scratch_.path());
    writeText(out_ / "a.exr", "mine");
    const Outcome result = render(scene, {"--no-clobber"});
    EXPECT_EQ(result.exit_code, 4) << result.err;
    EXPECT_TRUE(contains(result.err, "a.exr")) << result.err;
    EXPECT_EQ(fs::file_size(out_ / "a.exr"), 4U);
}

TEST_F(WrongInput, LayerLimitIsIncompleteUnderStrict) {
    const fs::path scene = writeScene(scratch_.path(), stackScene(3));
    expectRefused(render(scene, {"--layers", "2", "--strict"}), 6,
                  {"4,096 fragments of 12,288", "--layers all"});
    const Outcome lenient = render(scene, {"--layers", "2"});
    EXPECT_EQ(lenient.exit_code, 0) << lenient.err;
    EXPECT_TRUE(contains(lenient.err, "2 layers, 8,192 fragments of 12,288")) << lenient.err;
}

TEST_F(WrongInput, RequiredGpuThatIsNotThere) {
    const fs::path scene = writeScene(scratch_.path());
    expectRefused(render(scene, {"--backend", "osmesa", "--require-gpu"}), 5, {});
    expectRefused(render(scene, {"--device", "9999"}), 5, {});
}

TEST_F(WrongInput, FlattenOfWhatHasNoLayers) {
    const fs::path scene = writeScene(scratch_.path());
    const std::string output = (out_ / "f.exr").string();
    expectRefused(runPeeler({"flatten", scene.string(), "-o", output}), 3, {"scene.gltf"});
    expectRefused(runPeeler({"flatten", (scratch_ / "absent.exr").string(), "-o", output}), 3,
                  {"absent.exr"});

    ASSERT_EQ(render(scene).exit_code, 0);
    const fs::path layered = scratch_ / "layered.exr";
    fs::rename(out_ / "a.exr", layered);
    fs::resize_file(layered, fs::file_size(layered) / 2);
    expectRefused(runPeeler({"flatten", layered.string(), "-o", output}), 3, {"layered.exr"});
    expectRefused(runPeeler({"info", layered.string()}), 3, {"layered.exr"});
}

/// A file system of 16 KiB, mounted on a folder.
class SmallDisk {
  public:
    explicit SmallDisk(const fs::path& folder) : folder_(folder) {
        mounted_ = mount("tmpfs", folder.c_str(), "tmpfs", 0, "size=16k") == 0;
        if (!mounted_) problem_ = std::strerror(errno);
    }
    ~SmallDisk() {
        if (mounted_) umount2(folder_.c_str(), MNT_DETACH);
    }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;
    bool mounted() const { return mounted_; }
    const std::string& problem() const { return problem_; }

  private:
    fs::path folder_;
    bool mounted_ = false;
    std::string problem_;
};

TEST_F(WrongInput, FullDisk) {
    const fs::path scene = writeScene(scratch_.path(), stackScene(20));
    const SmallDisk disk(out_);
    if (!disk.mounted()) GTEST_SKIP() << "cannot mount a small tmpfs here: " << disk.problem();
    for (const std::vector<std::string>& form :
         {std::vector<std::string>{"-o", (out_ / "a.exr").string()},
          {"-o", (out_ / "b.exr").string(), "--as", "composite"},
          {"-o", (out_ / "a.tif").string()}}) {
        std::vector<std::string> arguments{"render", scene.string(), "--size", "512x512"};
        arguments.insert(arguments.end(), form.begin(), form.end());
        SCOPED_TRACE(form[1]);
        expectRefused(runPeeler(arguments), 4, {form[1], "space"});
    }
}

}  // namespace
}  // namespace peeler::test
