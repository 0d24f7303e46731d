// SPDX-License-Identifier: Apache-2.0
// Tests which libraries are loaded at start-up, and the search for modules that are loaded later.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cmd/tiny_gltf.h"
#include "formats/meshes/threemf_package.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

fs::path exampleScene(const std::string& name) {
    return sourceDir() / "examples" / "scenes" / name;
}

/// A copy of peeler and its modules in another folder.
class Copy {
  public:
    /// Copies the program and its modules to these paths in a scratch folder. Copies no modules if
    /// `modules` is empty.
    Copy(const std::string& program, const std::string& modules) : program_(scratch_ / program) {
        fs::create_directories(program_.parent_path());
        fs::copy(peelerBinary(), program_);
        fs::create_directory(out());
        if (modules.empty()) return;
        fs::create_directories((scratch_ / modules).parent_path());
        fs::copy(peelerBinary().parent_path() / "lib" / "peeler", scratch_ / modules);
    }

    fs::path modules() const { return program_.parent_path().parent_path() / "lib" / "peeler"; }
    fs::path out() const { return scratch_ / "out"; }
    CommandResult render(const fs::path& scene, const std::string& output) const {
        return runCommand({program_, "render", scene, "--size", "64x36", "-o", out() / output});
    }

  private:
    ScratchDir scratch_;
    fs::path program_;
};

/// Returns the names of the libraries that the dynamic linker loads.
std::string loadedBy(const std::vector<std::string>& arguments) {
    const ScratchDir scratch;
    const CommandResult result = runPeelerProcess(
        arguments, {"LD_DEBUG=files", "LD_DEBUG_OUTPUT=" + (scratch / "files").string()});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    std::string text;
    for (const auto& entry : fs::directory_iterator(scratch.path()))
        text += bytesOf(entry.path());
    return text;
}

bool loads(const std::string& text, const std::string& library) {
    return text.find(library) != std::string::npos;
}

constexpr char kImages[] = "libOpenImageIO.so", kVoxels[] = "libopenvdb.so",
               kDraco[] = "libdraco.so";

TEST(Startup, NeedsNoLibraryOfImages) {
    const std::string text = loadedBy({"--version"});
    EXPECT_TRUE(loads(text, "libOpenEXR")) << "the linker does not tell";
    EXPECT_FALSE(loads(text, kImages));
    EXPECT_FALSE(loads(text, kVoxels));
    EXPECT_FALSE(loads(text, kDraco));
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
    EXPECT_FALSE(loads(rendering("picture.png"), kImages)) << "PNG is built in";
    EXPECT_TRUE(loads(rendering("picture.jpg"), kImages));
}

TEST(Startup, HitsOnTheCpuNeedNoGl) {
    const ScratchDir scratch;
    const auto tracing = [&](const std::string& engine) {
        return loadedBy({"rays", exampleScene("jellyfish.glb"), "--axes", "--resolution", "32",
                         "-o", scratch / "hits.npz", "--engine", engine});
    };
    EXPECT_TRUE(loads(tracing("gl"), "libEGL")) << "the linker does not tell";
    const std::string text = tracing("cpu");
    for (const char* library : {"libEGL", "libGL", "libOSMesa", "libLLVM", "libgallium", "_dri.so"})
        EXPECT_FALSE(loads(text, library)) << library;
    EXPECT_FALSE(loads(tracing("auto"), "libOSMesa")) << "it is no GPU";
    EXPECT_FALSE(
        loads(loadedBy({"bake", exampleScene("jellyfish.glb"), "--directions", "2", "--resolution",
                        "16", "-o", scratch / "baked.glb", "--engine", "cpu"}),
              "libEGL"));
}

TEST(Startup, TexturesOfPngNeedNoLibraryOfImages) {
    const ScratchDir scratch;
    for (const char* output : {"layers.exr", "picture.png"}) {
        const std::string text = loadedBy(
            {"render", exampleScene("plant.glb"), "--size", "64x36", "-o", scratch / output});
        EXPECT_TRUE(loads(text, "libspng")) << "the linker does not tell";
        EXPECT_FALSE(loads(text, kImages)) << output;
    }
}

TEST(Startup, TexturesOfJpegNeedNoLibraryOfImages) {
    PEELER_REQUIRE_ASSETS(assets);
    const ScratchDir scratch;
    const fs::path lamp = assets / "gltf-sample-assets" / "StainedGlassLamp" / "glTF-JPG-PNG" /
                          "StainedGlassLamp.gltf";
    EXPECT_FALSE(
        loads(loadedBy({"render", lamp, "--size", "64x36", "-o", scratch / "a.png"}), kImages));
}

TEST(Startup, ModulesStandBesideTheProgramOrAsInstalled) {
    for (const auto& [program, modules] :
         {std::pair("peeler", "lib/peeler"), std::pair("bin/peeler", "lib/peeler")}) {
        const Copy copy(program, modules);
        const CommandResult result = copy.render(exampleScene("jellyfish.glb"), "picture.jpg");
        EXPECT_EQ(result.exit_code, 0) << program << ": " << result.err;
        EXPECT_TRUE(fs::exists(copy.out() / "picture.jpg")) << program;
    }
}

/// Writes the triangle with a texture whose bytes look like WebP.
fs::path webpScene(const ScratchDir& scratch) {
    nlohmann::json scene = triangleScene();
    scene["extensionsUsed"] = {"EXT_texture_webp"};
    scene["images"] = {{{"uri", "texture.webp"}}};
    scene["textures"] = {{{"extensions", {{"EXT_texture_webp", {{"source", 0}}}}}}};
    scene["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
    scene["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 2;
    scene["accessors"].push_back(
        {{"bufferView", 0}, {"componentType", 5126}, {"count", 3}, {"type", "VEC2"}});
    std::ofstream(scratch / "triangle.bin", std::ios::binary) << triangleBuffer();
    std::ofstream(scratch / "texture.webp", std::ios::binary)
        << std::string("RIFF\x16\0\0\0WEBPVP8L\x09\0\0\0\x2f\0\0\0\0\0\0\0\0\0", 30);
    std::ofstream(scratch / "scene.gltf") << scene;
    return scratch / "scene.gltf";
}

/// Writes a triangle that claims to have Draco compression. Returns the scene file.
fs::path dracoScene(const ScratchDir& scratch) {
    constexpr const char* kName = "KHR_draco_mesh_compression";
    nlohmann::json scene = triangleScene();
    scene["extensionsUsed"] = scene["extensionsRequired"] = {kName};
    scene["meshes"][0]["primitives"][0]["extensions"][kName] = {{"bufferView", 0},
                                                                {"attributes", {{"POSITION", 0}}}};
    scene["accessors"][0].erase("bufferView");  // removes the uncompressed fallback
    std::ofstream(scratch / "triangle.bin", std::ios::binary) << triangleBuffer();
    std::ofstream(scratch / "scene.gltf") << scene;
    return scratch / "scene.gltf";
}

TEST(Startup, ADecoderThatIsMissingIsSaid) {
    const ScratchDir scratch;
    const fs::path scene = dracoScene(scratch);
    const CommandResult missing = Copy("bin/peeler", "").render(scene, "layers.exr");
    EXPECT_EQ(missing.exit_code, 1) << missing.err;
    for (const char* part :
         {"a part of peeler is not installed", "lib/peeler/peeler_decode", "copy the folder"})
        EXPECT_NE(missing.err.find(part), std::string::npos) << missing.err;
    const CommandResult there = Copy("bin/peeler", "lib/peeler").render(scene, "layers.exr");
    EXPECT_EQ(there.exit_code, 3) << "the data is no fault of ours";
    EXPECT_NE(there.err.find("not Draco data"), std::string::npos) << there.err;
}

TEST(Startup, AReaderOf3mfWithoutItsLibraryNamesThePackage) {
    const ScratchDir scratch;
    const std::string scene = scratch / "a.3mf";
    std::ofstream(scene) << threeMfOf(threeMfModel(threeMfObject(threeMfBox(1, 1, 1))));
    EXPECT_EQ(runPeelerProcess({"info", scene}).exit_code, 0);
    std::ofstream(scratch / "lib3MF.so.1") << "no library";
    const CommandResult result =
        runPeelerProcess({"info", scene}, {"LD_LIBRARY_PATH=" + scratch.path().string()});
    EXPECT_EQ(result.exit_code, 1) << result.err;
    for (const char* part : {"lacks a library", "lib/peeler/peeler_3mf", "install lib3mf"})
        EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
}

TEST(Startup, AModuleThatIsMissingIsSaidAndLeavesNoFile) {
    const Copy copy("bin/peeler", "");
    const ScratchDir scratch;
    const fs::path jellyfish = exampleScene("jellyfish.glb");
    for (const char* output : {"layers.exr", "picture.png"}) {
        EXPECT_EQ(copy.render(jellyfish, output).exit_code, 0) << "needs none";
        fs::remove(copy.out() / output);
    }
    // The first command needs the module to write a picture, the second to read a texture. The
    // texture is intact, so the error must not name it.
    for (const auto& [scene, output] :
         {std::pair(jellyfish, "picture.jpg"), std::pair(webpScene(scratch), "layers.exr")}) {
        const CommandResult result = copy.render(scene, output);
        EXPECT_EQ(result.exit_code, 1) << scene;
        for (const char* part : {"a part of peeler is not installed", "lib/peeler/peeler_images.so",
                                 "copy the folder"})
            EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
        EXPECT_TRUE(fs::is_empty(copy.out())) << scene;
    }
}

TEST(Startup, AModuleWithoutItsLibraryNamesTheLibrary) {
    const Copy copy("bin/peeler", "lib/peeler");
    const ScratchDir scratch;
    fs::remove(copy.modules() / "peeler_images.so");
    std::ofstream(copy.modules() / "peeler_images.so") << "no library";
    EXPECT_EQ(copy.render(exampleScene("coincident.glb"), "picture.png").exit_code, 0);
    const CommandResult result = copy.render(exampleScene("coincident.glb"), "picture.jpg");
    EXPECT_EQ(result.exit_code, 1) << result.err;
    for (const char* part : {"a part of peeler cannot be loaded", "install OpenImageIO"})
        EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
}

}  // namespace
}  // namespace peeler::test
