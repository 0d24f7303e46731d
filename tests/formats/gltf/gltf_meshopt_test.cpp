// SPDX-License-Identifier: Apache-2.0
// Tests compressed buffer views in glTF files: transparent decompression, fallbacks, and wrong
// claims.
#include <gtest/gtest.h>

#include "formats/gltf/gltf_builder.h"
#include "formats/gltf/gltf_reader.h"
#include "formats/gltf/meshopt_gltf.h"
#include "formats/gltf/meshopt_stream.h"

namespace peeler::test {
namespace {

Json& meshoptExtension(GltfBuilder& builder, int view) {
    return builder.gltf["bufferViews"][view]["extensions"]["EXT_meshopt_compression"];
}

void expectTriangle(const Scene& scene) {
    const Primitive& primitive = scene.meshes[0].primitives[0];
    EXPECT_EQ(primitive.positions, (std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(primitive.indices, (std::vector<std::uint32_t>{0, 1, 2}));
}

TEST(GltfMeshopt, IsReadUnderBothNamesFromBothContainers) {
    for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
        for (const char* file : {"scene.gltf", "scene.glb"}) {
            GltfBuilder builder = compressed(name);
            builder.gltf["extensionsRequired"] = {name};
            const ScratchDir folder;
            const Scene scene = readGltf(builder.write(folder, file));
            expectTriangle(scene);
            EXPECT_TRUE(scene.warnings.empty()) << scene.warnings[0];
        }
    }
}

/// Adds a second buffer with the uncompressed triangle, upside down to make it recognisable.
void addFallback(GltfBuilder& builder, const ScratchDir& folder) {
    std::vector<float> corners = kTriangleCorners;
    corners[9] = -1;
    Bytes bytes = toBytes(corners);
    const Bytes indices = toBytes<std::uint16_t>({0, 1, 2});
    bytes.insert(bytes.end(), indices.begin(), indices.end());
    writeFile(folder / "fallback.bin", bytes);
    builder.gltf["buffers"][1] = {
        {"byteLength", bytes.size()},
        {"uri", "fallback.bin"},
        {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}};
}

TEST(GltfMeshopt, ReadsTheFallbackOnlyWhereTheDataIsDamaged) {
    const ScratchDir folder;
    GltfBuilder builder = compressed();
    addFallback(builder, folder);
    const Scene scene = readGltf(builder.write(folder));
    expectTriangle(scene);
    EXPECT_TRUE(scene.warnings.empty());
    const std::uint64_t hash = scene.content_hash;

    // If the compressed data is intact, the reader never opens the fallback file, so this file may
    // be missing and is not hashed.
    std::filesystem::rename(folder / "fallback.bin", folder / "away.bin");
    EXPECT_EQ(readGltf(builder.write(folder)).content_hash, hash);
    std::filesystem::rename(folder / "away.bin", folder / "fallback.bin");

    builder.bin[0] = 0xA1;  // a codec version that the library cannot decode
    const Scene excused = readGltf(builder.write(folder));
    EXPECT_EQ(excused.meshes[0].primitives[0].positions[2], glm::vec3(0, -1, 0));
    EXPECT_TRUE(warned(excused, "version 1 of the codec"));
    GltfOptions strict;
    strict.strict = true;
    const std::string where = "/bufferViews/0/extensions/EXT_meshopt_compression";
    EXPECT_EQ(errorOf(builder.write(folder), strict).where(), where);
    std::filesystem::remove(folder / "fallback.bin");
    EXPECT_EQ(errorOf(builder.write(folder)).where(), where);
}

TEST(GltfMeshopt, ServesSparseAccessorsAndSharedViews) {
    GltfBuilder builder = compressed();
    // Element 1 of the positions is replaced; the others stay as decoded.
    const int index = builder.addView(toBytes<std::uint16_t>({1}));
    const int value = builder.addView(toBytes<float>({5, 6, 7}));
    builder.gltf["buffers"][0]["byteLength"] = builder.bin.size();
    builder.gltf["accessors"][0]["sparse"] = {
        {"count", 1},
        {"indices", {{"bufferView", index}, {"componentType", 5123}}},
        {"values", {{"bufferView", value}}}};
    const Scene scene = load(builder);
    EXPECT_EQ(scene.meshes[0].primitives[0].positions[1], glm::vec3(5, 6, 7));
    EXPECT_EQ(scene.meshes[0].primitives[0].positions[2], glm::vec3(0, 1, 0));
}

class GltfMeshoptLies : public testing::TestWithParam<Lie> {};

TEST_P(GltfMeshoptLies, AreRefused) {
    GltfBuilder builder = compressed();
    GetParam().tell(builder);
    const Error error = errorOf(builder);
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_EQ(error.where(), GetParam().where);
    EXPECT_NE(std::string(error.what()).find(GetParam().words), std::string::npos) << error.what();
}

#define MESHOPT_EXTENSION "/bufferViews/0/extensions/EXT_meshopt_compression"
INSTANTIATE_TEST_SUITE_P(
    All, GltfMeshoptLies,
    testing::Values(
        Lie{"HugeCount",
            [](GltfBuilder& b) {
                meshoptExtension(b, 0)["count"] = 2147483648;
                b.gltf["bufferViews"][0]["byteLength"] = 2147483648 * 16;
            },
            MESHOPT_EXTENSION, "need at least"},
        Lie{"OtherLength", [](GltfBuilder& b) { meshoptExtension(b, 0)["count"] = 4; },
            MESHOPT_EXTENSION, "48 bytes, but its compressed data decodes to 64"},
        Lie{"OtherStride", [](GltfBuilder& b) { b.gltf["bufferViews"][0]["byteStride"] = 12; },
            MESHOPT_EXTENSION "/byteStride", "differ"},
        Lie{"BeyondItsBuffer", [](GltfBuilder& b) { meshoptExtension(b, 0)["byteOffset"] = 60; },
            MESHOPT_EXTENSION, "its buffer has"},
        Lie{"NoSuchBuffer", [](GltfBuilder& b) { meshoptExtension(b, 0)["buffer"] = 2; },
            MESHOPT_EXTENSION "/buffer", "index into \"buffers\""},
        Lie{"FromAPlaceholder", [](GltfBuilder& b) { meshoptExtension(b, 0)["buffer"] = 1; },
            MESHOPT_EXTENSION, "its buffer has 0"},
        Lie{"NoMode", [](GltfBuilder& b) { meshoptExtension(b, 0).erase("mode"); },
            MESHOPT_EXTENSION, "\"mode\" is missing"},
        Lie{"UnknownMode", [](GltfBuilder& b) { meshoptExtension(b, 0)["mode"] = "POINTS"; },
            MESHOPT_EXTENSION "/mode", "must be one of"},
        Lie{"UnknownFilter", [](GltfBuilder& b) { meshoptExtension(b, 0)["filter"] = "BLUR"; },
            MESHOPT_EXTENSION, "\"BLUR\" is not known"},
        Lie{"WideStride", [](GltfBuilder& b) { meshoptExtension(b, 0)["byteStride"] = 1024; },
            MESHOPT_EXTENSION "/byteStride", "from 2 to 256"},
        Lie{"Damage", [](GltfBuilder& b) { b.bin[1] = 0xFF; }, MESHOPT_EXTENSION, "damaged"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(GltfMeshopt, CountsAgainstTheLimitOfGeometry) {
    GltfOptions options;
    options.max_geometry_bytes = 53;  // the decoded data takes 3 · 16 + 3 · 2
    const Error error = errorOf(compressed(), options);
    EXPECT_EQ(error.where(), "/bufferViews/1/extensions/EXT_meshopt_compression");
    EXPECT_NE(std::string(error.what()).find("limit of 53 bytes"), std::string::npos);
}

TEST(GltfMeshopt, PlacesWithoutDataAreNamed) {
    GltfBuilder builder = compressed();
    builder.gltf["bufferViews"][0].erase("extensions");
    EXPECT_EQ(errorOf(builder).where(), "/bufferViews/0");
}

}  // namespace
}  // namespace peeler::test
