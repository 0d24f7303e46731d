// SPDX-License-Identifier: Apache-2.0
// Tests hits without GL: with GL libraries that cannot be opened, and in a root file system without
// any.
#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

/// Returns command lines of rays and bake for a scene with closed parts; they write to `out`.
std::vector<Words> commandsOn(const std::string& scene, const std::string& out) {
    const Words closed{"--include", "bowl/marble*"};
    const auto with = [](Words line, const Words& more) {
        line.insert(line.end(), more.begin(), more.end());
        return line;
    };
    const Words rays{"rays", scene, "--resolution", "48"};
    return {
        with(rays, {"--directions", "3", "-o", out + "/hits.npz"}),
        with(rays, {"--axes", "-o", out + "/hits.ply"}),
        with(rays, {"--axes", "-o", out + "/hits.exr"}),
        {"rays", scene, "--camera", "main", "--size", "64x36", "-o", out + "/camera.npz"},
        with(rays, {"--direction", "1,2,3", "--map", "thickness,count", "-o", out + "/map.exr"}),
        with(rays, {"--axes", "--points", out + "/hits.ply", "-o", out + "/next.npz"}),
        with(with(rays, closed), {"--directions", "4", "--parity", "fail"}),
        with({"rays", scene, "--voxels", "24", "-o", out + "/voxels.npz"}, closed),
        with({"bake", scene, "--directions", "4", "--resolution", "48", "-o", out + "/ao.glb"},
             closed),
    };
}

/// Invalid files with the names of the GL libraries, so that the libraries cannot be loaded.
class GlThatDoesNotOpen : public testing::Test {
  protected:
    GlThatDoesNotOpen() {
        fs::create_directory(hidden_);
        fs::create_directory(out_);
        for (const char* name :
             {"libEGL.so.1", "libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so", "libGL.so.1"})
            writeText(hidden_ / name, "");
    }
    CommandResult run(Words line, const Words& more) const {
        line.insert(line.end(), more.begin(), more.end());
        return runPeelerProcess(line, {"LD_LIBRARY_PATH=" + hidden_.string()});
    }

    const ScratchDir scratch_;
    const fs::path hidden_ = scratch_ / "hidden", out_ = scratch_ / "out";
    const std::string scene_ = sourceDir() / "examples" / "scenes" / "glasses.glb";
};

TEST_F(GlThatDoesNotOpen, IsNotMissedByRaysNorByBake) {
    EXPECT_EQ(run({"render", scene_, "-o", out_ / "a.exr"}, {}).exit_code, 5) << "it does open";
    for (const Words& line : commandsOn(scene_, out_)) {
        const CommandResult automatic = run(line, {"--json", "--quiet"});
        ASSERT_EQ(automatic.exit_code, 0) << automatic.err;
        EXPECT_EQ(automatic.err, "");
        const Json json = Json::parse(automatic.out);
        EXPECT_EQ(json.at("engine"), "cpu");
        EXPECT_EQ(json.at("renderer"), "");
        if (json.at("output").is_null()) continue;
        const fs::path file = json.at("output").get<std::string>();
        const std::string bytes = bytesOf(file);
        EXPECT_FALSE(bytes.empty());
        const CommandResult chosen = run(line, {"--engine", "cpu", "--quiet"});
        ASSERT_EQ(chosen.exit_code, 0) << chosen.err;
        EXPECT_TRUE(bytesOf(file) == bytes) << file;
    }
}

TEST_F(GlThatDoesNotOpen, IsToldOfToThoseWhoAsk) {
    const Words line = commandsOn(scene_, out_).front();
    const CommandResult usual = run(line, {});
    ASSERT_EQ(usual.exit_code, 0) << usual.err;
    EXPECT_FALSE(contains(usual.err, "EGL")) << usual.err;
    EXPECT_TRUE(contains(run(line, {"--verbose"}).err, "libEGL.so.1")) << "why it is the CPU";
    for (const Words& gl : {Words{"--engine", "gl"}, Words{"--require-gpu"},
                            Words{"--backend", "osmesa"}, Words{"--device", "0"}}) {
        const CommandResult refused = run(line, gl);
        EXPECT_EQ(refused.exit_code, 5) << gl.front() << ": " << refused.err;
        EXPECT_TRUE(contains(refused.err, "no usable OpenGL")) << refused.err;
    }
    const CommandResult refused = run(line, {"--engine", "gl"});
    for (const char* packages : {"libegl1 libgl1-mesa-dri (Debian", "mesa-libEGL", "mesa (Arch)"})
        EXPECT_TRUE(contains(refused.err, packages)) << refused.err;
}

/// A root folder that contains only the program, the libraries that it is linked to, and a scene.
class BareRoot {
  public:
    BareRoot() {
        for (const char* folder : {"bin", "proc", "out"})
            fs::create_directory(root_ / folder);
        fs::copy(peelerBinary(), root_ / "bin");
        std::istringstream words(runCommand({"ldd", peelerBinary()}).out);
        for (std::string word; words >> word;) {
            if (!word.starts_with('/')) continue;
            const fs::path to = root_.path().string() + word;
            fs::create_directories(to.parent_path());
            fs::copy(word, to, fs::copy_options::skip_existing);
            libraries_ += word + '\n';
        }
        fs::copy(sourceDir() / "examples" / "scenes" / "glasses.glb", root_ / "scene.glb");
    }

    const std::string& libraries() const { return libraries_; }
    /// Runs peeler with this root folder, in a mount namespace of its own. The mount of /proc ends
    /// with the namespace.
    CommandResult run(Words line) const {
        Words command{"unshare",
                      "--mount",
                      "sh",
                      "-c",
                      "mount --bind /proc \"$0/proc\" && "
                      "exec env -i \"$(command -v chroot)\" \"$0\" /bin/peeler \"$@\"",
                      root_.path()};
        command.insert(command.end(), line.begin(), line.end());
        return runCommand(command);
    }

  private:
    ScratchDir root_;
    std::string libraries_;
};

TEST(RootWithoutGl, IsEnoughForRaysAndBake) {
    if (geteuid() != 0) GTEST_SKIP() << "another root needs the user root";
    const BareRoot root;
    for (const char* library : {"libEGL", "libGL", "libOpenGL", "libOSMesa"})
        EXPECT_FALSE(contains(root.libraries(), library)) << root.libraries();
    if (runCommand({"unshare", "--mount", "true"}).exit_code != 0)
        GTEST_SKIP() << "this machine does not let root make namespaces";
    const CommandResult there = root.run({"info", "/scene.glb"});
    ASSERT_EQ(there.exit_code, 0) << there.err;
    EXPECT_EQ(root.run({"render", "/scene.glb", "-o", "/out/a.exr"}).exit_code, 5);
    for (const Words& line : commandsOn("/scene.glb", "/out")) {
        const CommandResult done = root.run(line);
        EXPECT_EQ(done.exit_code, 0) << line.back() << ": " << done.err;
    }
}

}  // namespace
}  // namespace peeler::test
