// SPDX-License-Identifier: Apache-2.0
// Tests peeler bake: its output, and its errors before any work.
#include <OpenImageIO/imagebuf.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cmd/tiny_gltf.h"
#include "formats/gltf/gltf_reader.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Returns triangleScene() with an opaque material; with `uvs` the corners have TEXCOORD_0 (0,0),
/// (1,0) and (1/2,1).
Json bakeScene(bool uvs = false) {
    Json scene = triangleScene();
    scene["materials"][0]["alphaMode"] = "OPAQUE";
    if (!uvs) return scene;
    scene["buffers"][0]["byteLength"] = 72;
    scene["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", 48}, {"byteLength", 24}});
    scene["accessors"].push_back(
        {{"bufferView", 2}, {"componentType", 5126}, {"count", 3}, {"type", "VEC2"}});
    scene["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 2;
    return scene;
}

std::string bufferWithUvs() {
    const float uvs[] = {0, 0, 1, 0, 0.5F, 1};
    std::string bytes = triangleBuffer();
    bytes.append(reinterpret_cast<const char*>(uvs), sizeof uvs);
    return bytes;
}

/// Instantiated for each engine (--engine).
class BakeCommand : public testing::TestWithParam<const char*> {
  protected:
    void useUvs() { writeScene(folder_.path(), bakeScene(true), bufferWithUvs()); }

    std::string file(const std::string& name) const { return (folder_ / name).string(); }

    /// Bakes with few directions and few rays, which is fast.
    Outcome bake(const std::string& out, const std::vector<std::string>& more = {}) const {
        std::vector<std::string> arguments{"bake", scene_.string(), "-o",      file(out),
                                           "-q",   "--directions",  "32",      "--resolution",
                                           "128",  "--engine",      GetParam()};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return runPeeler(arguments);
    }

    void expectRefused(const std::string& out, const std::vector<std::string>& more, int code,
                       const std::string& words) const {
        const Outcome result = bake(out, more);
        EXPECT_EQ(result.exit_code, code) << out << ' ' << words << ": " << result.err;
        EXPECT_NE(result.err.find(words), std::string::npos) << result.err;
        EXPECT_FALSE(fs::exists(file(out)) && out != "scene.gltf") << out;
    }

    ScratchDir folder_;
    fs::path scene_ = writeScene(folder_.path(), bakeScene());
};
INSTANTIATE_TEST_SUITE_P(By, BakeCommand, testing::Values("cpu", "gl"),
                         [](const auto& row) { return std::string(row.param); });

TEST_P(BakeCommand, RefusesWhatContradictsItself) {
    expectRefused("out.obj", {}, 2, ".glb, .exr, .png");
    expectRefused("out", {}, 2, ".glb, .exr, .png");
    expectRefused("out.exr", {"--target", "vertices"}, 2, "--target texture");
    expectRefused("out.glb", {"--size", "64"}, 2, "--target texture");
    expectRefused("out.glb", {"--target", "texture", "--quantity", "thickness"}, 2, ".exr");
    expectRefused("out.glb", {"--bounces", "2"}, 2, "--quantity irradiance");
    expectRefused("out.glb", {"--environment", "sky.hdr"}, 2, "--quantity irradiance");
    for (const char* name : {"out.####.glb", "out.%04d.exr"})
        expectRefused(name, {}, 2, "remove #### or %04d");
    expectRefused("out.glb", {"--transmission", "opaque"}, 2, "--transmission");
    expectRefused("out.glb", {"--directions", "33"}, 2, "even number");
    expectRefused("out.glb", {"--max-distance", "0"}, 2, "--max-distance 0");
    expectRefused("out.png", {"--uv", "2"}, 2, "--uv 2");
    expectRefused("out.glb", {"--quantity", "oa"}, 2, "'ao'");
    expectRefused("out.glb", {"--target", "vertex"}, 2, "vertices, texture");
}

TEST_P(BakeCommand, RefusesFilesThatItMustNotWrite) {
    std::error_code ignored;
    // Plain JSON is read even if the name ends in .glb.
    fs::copy_file(scene_, folder_ / "scene.glb", ignored);
    scene_ = folder_ / "scene.glb";
    const std::string before = bytesOf(scene_);
    const Outcome same = bake("scene.glb");
    EXPECT_EQ(same.exit_code, 2) << same.err;
    EXPECT_EQ(bytesOf(scene_), before);
    expectRefused("none/out.glb", {"--no-mkdir"}, 4, "none/out.glb");
    writeText(file("there.glb"), "mine");
    EXPECT_EQ(bake("there.glb", {"--no-clobber"}).exit_code, 4);
    EXPECT_EQ(bytesOf(file("there.glb")), "mine");
}

TEST_P(BakeCommand, KeepsTheFilesOfTheSceneAndItsOwn) {
    Json scene = bakeScene(true);
    scene["images"] = {{{"uri", "m_0000.png"}}};
    writeScene(folder_.path(), scene, bufferWithUvs());
    const auto refused = [&](const std::string& out, const std::string& kept,
                             const std::vector<std::string>& more) {
        writeText(file(kept), kept == "triangle.bin" ? bufferWithUvs() : "mine");
        const std::string before = bytesOf(file(kept));
        const Outcome result = bake(out, more);
        EXPECT_EQ(result.exit_code, 2) << out << ": " << result.err;
        EXPECT_NE(result.err.find(kept), std::string::npos) << result.err;
        EXPECT_EQ(bytesOf(file(kept)), before);
    };
    refused("m_0000.png", "m_0000.png", {});
    refused("m_####.png", "m_0000.png", {});
    refused("out.glb", "triangle.bin", {"--report", file("triangle.bin")});
    refused("n_####.png", "n_0000.png", {"--report", file("n_0000.png")});
    refused("out.glb", "sky.hdr",
            {"--quantity", "irradiance", "--environment", file("sky.hdr"), "--report",
             file("sky.hdr")});
    EXPECT_FALSE(fs::exists(file("out.glb")));
    writeText(file("n_0000.png"), "mine");
    EXPECT_EQ(bake("n_####.png", {"--no-clobber"}).exit_code, 4);
    EXPECT_EQ(bytesOf(file("n_0000.png")), "mine");
}

TEST_P(BakeCommand, NeedsALightForIrradiance) {
    expectRefused("out.glb", {"--quantity", "irradiance"}, 2, "add --environment");
    Json scene = bakeScene();
    scene["materials"][0]["emissiveFactor"] = {0, 0.5, 0};
    writeScene(folder_.path(), scene);
    EXPECT_EQ(bake("out.glb", {"--quantity", "irradiance"}).exit_code, 0);
}

TEST_P(BakeCommand, OpensWithWhatWasBaked) {
    Json scene = bakeScene();
    scene["scenes"].push_back({{"nodes", {0}}, {"name", "second"}});
    scene["materials"].push_back({{"name", "worn"}});
    scene["extensionsUsed"] = {"KHR_materials_variants"};
    scene["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "worn"}}};
    scene["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] = {
        {{"material", 1}, {"variants", {0}}}};
    writeScene(folder_.path(), scene);
    ASSERT_EQ(bake("plain.glb").exit_code, 0);
    EXPECT_EQ(readGltf(file("plain.glb")).default_scene, 0);
    EXPECT_EQ(readGltf(file("plain.glb")).meshes[0].primitives[0].material, 0);
    ASSERT_EQ(bake("out.glb", {"--scene", "second", "--variant", "worn"}).exit_code, 0);
    const Scene baked = readGltf(file("out.glb"));
    EXPECT_EQ(baked.default_scene, 1);
    EXPECT_EQ(baked.meshes[0].primitives[0].material, 1);
}

TEST_P(BakeCommand, SaysWhatASceneLacks) {
    expectRefused("out.png", {}, 3, "TEXCOORD_0");
    Json lines = bakeScene();
    lines["meshes"][0]["primitives"][0]["mode"] = 3;
    writeScene(folder_.path(), lines);
    expectRefused("out.glb", {}, 3, "no triangles");
    Json two = bakeScene(true);
    two["materials"].push_back(two["materials"][0]);
    two["meshes"][0]["primitives"].push_back(two["meshes"][0]["primitives"][0]);
    two["meshes"][0]["primitives"][1]["material"] = 1;
    writeScene(folder_.path(), two, bufferWithUvs());
    expectRefused("out.png", {}, 2, "####");
}

TEST_P(BakeCommand, PutsOpenSkyIntoVertices) {
    const Outcome result = bake("out.glb", {"--json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const Json json = Json::parse(result.out);
    EXPECT_EQ(json["quantity"], "ao");
    EXPECT_EQ(json["target"], "vertices");
    EXPECT_EQ(json["receivers"], 3);
    EXPECT_EQ(json["outputs"][0]["bytes"], fs::file_size(file("out.glb")));
    EXPECT_EQ(json["least"], 1);  // nothing occludes a single triangle
    EXPECT_EQ(json["greatest"], 1);
    const Scene scene = readGltf(file("out.glb"));
    ASSERT_EQ(scene.meshes[0].primitives[0].colors.size(), 3U);
    for (const glm::vec4& color : scene.meshes[0].primitives[0].colors)
        EXPECT_EQ(color.r, 1);
}

TEST_P(BakeCommand, WritesTexturesOfEveryKind) {
    useUvs();
    const std::vector<std::string> small{"--size", "32", "--padding", "2"};
    ASSERT_EQ(bake("out.exr", small).exit_code, 0);
    const OIIO::ImageBuf exr(file("out.exr"));
    EXPECT_EQ(exr.spec().width, 32);
    EXPECT_EQ(exr.spec().nchannels, 1);
    EXPECT_EQ(exr.getchannel(16, 4, 0, 0), 1);  // a texel inside the triangle
    ASSERT_EQ(bake("m.####.png", small).exit_code, 0);
    EXPECT_TRUE(fs::exists(file("m.0000.png")));
    ASSERT_EQ(bake("out.glb", {"--target", "texture", "--size", "32"}).exit_code, 0);
    const Scene scene = readGltf(file("out.glb"));
    EXPECT_TRUE(scene.warnings.empty());
    const TextureRef& texture = scene.materials[0].occlusion_texture;
    ASSERT_GE(texture.image, 0);
    EXPECT_EQ(scene.images[static_cast<std::size_t>(texture.image)].width, 32);
    EXPECT_TRUE(scene.meshes[0].primitives[0].colors.empty());
}

TEST_P(BakeCommand, KeepsItsBudget) {
    if (kShadowMemory) GTEST_SKIP() << "its memory is not the product's";
    ASSERT_EQ(bake("free.glb").exit_code, 0);
    ASSERT_EQ(bake("tight.glb", {"--memory", "500M"}).exit_code, 0);
    EXPECT_TRUE(bytesOf(file("tight.glb")) == bytesOf(file("free.glb")));
    if (std::string(GetParam()) == "gl")  // GL's libraries alone take more than 64 MiB
        expectRefused("none.glb", {"--memory", "64M"}, 33, "--memory");
}

TEST_P(BakeCommand, WarnsOfSharedTexels) {
    Json twice = bakeScene(true);
    twice["nodes"].push_back({{"mesh", 0}, {"translation", {0, 0, 5}}});
    twice["scenes"][0]["nodes"] = {0, 1};
    writeScene(folder_.path(), twice, bufferWithUvs());
    const Outcome result = bake("out.png", {"--size", "32"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_NE(result.err.find("warning: The UVs of material 0 overlap"), std::string::npos)
        << result.err;
}

}  // namespace
}  // namespace peeler::test
