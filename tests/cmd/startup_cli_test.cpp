// SPDX-License-Identifier: Apache-2.0
// What a command loads before it works, and where it finds the modules it loads later.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

fs::path exampleScene(const std::string& name) {
    return sourceDir() / "examples" / "scenes" / name;
}

/// peeler and its modules somewhere else.
class Copy {
  public:
    /// Paths in a scratch folder; no modules where `modules` is empty.
    Copy(const std::string& program, const std::string& modules) : program_(scratch_ / program) {
        fs::create_directories(program_.parent_path());
        fs::copy(peelerBinary(), program_);
        fs::create_directory(out());
        if (modules.empty()) return;
        fs::create_directories((scratch_ / modules).parent_path());
        fs::copy(peelerBinary().parent_path() / "lib" / "peeler", scratch_ / modules);
    }

    fs::path out() const { return scratch_ / "out"; }
    CommandResult render(const std::string& scene, const std::string& output) const {
        return runCommand(
            {program_, "render", exampleScene(scene), "--size", "64x36", "-o", out() / output});
    }

  private:
    ScratchDir scratch_;
    fs::path program_;
};

/// What the dynamic linker says it opens.
std::string loadedBy(const std::vector<std::string>& arguments) {
    const ScratchDir scratch;
    const CommandResult result =
        runPeeler(arguments, {"LD_DEBUG=files", "LD_DEBUG_OUTPUT=" + (scratch / "files").string()});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::string text;
    for (const auto& entry : fs::directory_iterator(scratch.path()))
        text += bytesOf(entry.path());
    return text;
}

bool loads(const std::string& text, const std::string& library) {
    return text.find(library) != std::string::npos;
}

constexpr char kImages[] = "libOpenImageIO.so", kVoxels[] = "libopenvdb.so";

TEST(Startup, NeedsNoLibraryOfImages) {
    const std::string text = loadedBy({"--version"});
    EXPECT_TRUE(loads(text, "libOpenEXR")) << "the linker does not tell";
    EXPECT_FALSE(loads(text, kImages));
    EXPECT_FALSE(loads(text, kVoxels));
    EXPECT_FALSE(loads(text, "libEGL"));
}

TEST(Startup, LayersOfASceneWithoutTexturesNeedNoLibraryOfImages) {
    const ScratchDir scratch;
    const auto rendering = [&](const std::string& output) {
        return loadedBy(
            {"render", exampleScene("jellyfish.glb"), "--size", "64x36", "-o", scratch / output});
    };
    const std::string layers = rendering("layers.exr");
    EXPECT_TRUE(loads(layers, "libEGL"));
    EXPECT_FALSE(loads(layers, kImages));
    EXPECT_FALSE(loads(layers, kVoxels));
    EXPECT_FALSE(loads(layers, "libOSMesa")) << "EGL works";
    EXPECT_TRUE(loads(rendering("picture.png"), kImages));
}

TEST(Startup, ModulesStandBesideTheProgramOrAsInstalled) {
    for (const auto& [program, modules] :
         {std::pair("peeler", "lib/peeler"), std::pair("bin/peeler", "lib/peeler")}) {
        const Copy copy(program, modules);
        const CommandResult result = copy.render("jellyfish.glb", "picture.png");
        EXPECT_EQ(result.exit_code, 0) << program << ": " << result.err;
        EXPECT_TRUE(fs::exists(copy.out() / "picture.png")) << program;
    }
}

TEST(Startup, AModuleThatIsMissingIsSaidAndLeavesNoFile) {
    const Copy copy("bin/peeler", "");
    EXPECT_EQ(copy.render("jellyfish.glb", "layers.exr").exit_code, 0) << "needs none";
    fs::remove(copy.out() / "layers.exr");
    // A picture is to be written; a texture is to be read, which is no fault of the texture's.
    for (const auto& [scene, output] :
         {std::pair("jellyfish.glb", "picture.png"), std::pair("plant.glb", "layers.exr")}) {
        const CommandResult result = copy.render(scene, output);
        EXPECT_EQ(result.exit_code, 1) << scene;
        for (const char* part : {"a part of peeler is not installed", "lib/peeler/peeler_images.so",
                                 "copy the folder"})
            EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
        EXPECT_TRUE(fs::is_empty(copy.out())) << scene;
    }
}

}  // namespace
}  // namespace peeler::test
