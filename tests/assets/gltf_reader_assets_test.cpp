// SPDX-License-Identifier: Apache-2.0
// Tests that real models are read, or are rejected for an extension that they require, and that
// broken models cause nothing worse than an input error.
#include <gtest/gtest.h>

#include <algorithm>

#include <peeler/error.h>
#include "assets/model_files.h"
#include "core/scene/posed_scene.h"
#include "formats/file/content_hash.h"
#include "formats/gltf/gltf_reader.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

/// Expects the invariants that the renderer assumes without checking (peeler/scene.h).
void expectSound(const Scene& scene) {
    ASSERT_FALSE(scene.scenes.empty());
    ASSERT_FALSE(scene.materials.empty());
    ASSERT_GE(scene.default_scene, 0);
    ASSERT_LT(static_cast<std::size_t>(scene.default_scene), scene.scenes.size());
    for (const Mesh& mesh : scene.meshes) {
        for (const Primitive& primitive : mesh.primitives) {
            const std::size_t count = primitive.positions.size();
            ASSERT_GT(count, 0U);
            ASSERT_LT(static_cast<std::size_t>(primitive.material), scene.materials.size());
            for (const std::uint32_t index : primitive.indices)
                ASSERT_LT(index, count);
            const auto expectCount = [&](std::size_t size) {
                EXPECT_TRUE(size == 0 || size == count) << size;
            };
            expectCount(primitive.normals.size());
            expectCount(primitive.tangents.size());
            expectCount(primitive.texcoords[0].size());
            expectCount(primitive.texcoords[1].size());
            expectCount(primitive.colors.size());
        }
    }
    for (const Material& material : scene.materials)
        for (const TextureRef* texture :
             {&material.base_color_texture, &material.metallic_roughness_texture,
              &material.normal_texture, &material.occlusion_texture, &material.emissive_texture})
            ASSERT_LT(texture->image, static_cast<int>(scene.images.size()));
    for (const Image& image : scene.images)
        ASSERT_EQ(image.rgba.size(), std::size_t{4} * static_cast<std::size_t>(image.width) *
                                         static_cast<std::size_t>(image.height));
    for (std::size_t i = 0; i < scene.scenes.size(); ++i)
        PosedScene(scene, static_cast<int>(i)).bounds();
}

void expectReadable(const fs::path& folder, std::size_t at_least) {
    const std::vector<fs::path> files = modelFiles(folder);
    std::size_t read = 0;
    for (const fs::path& file : files) {
        SCOPED_TRACE(file.string());
        GltfOptions options;
        options.strict = true;  // makes a texture that cannot be decoded an error
        try {
            expectSound(readGltf(file, options));
            ++read;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
            const bool refused = error.where().rfind("/extensionsRequired/", 0) == 0 ||
                                 error.where() == "/asset/minVersion";
            EXPECT_TRUE(refused) << error.what() << " at " << error.where();
        }
    }
    EXPECT_GE(read, at_least) << "of " << files.size();
}

TEST(GltfAssets, SampleModelsAreRead) {
    PEELER_REQUIRE_ASSETS(assets);
    expectReadable(assets / "gltf-sample-assets", 40);
}

TEST(GltfAssets, GeneratedModelsAreRead) {
    PEELER_REQUIRE_ASSETS(assets);
    expectReadable(assets / "gltf-asset-generator", 50);
}

TEST(GltfAssets, TextureTransformTurnsTheArrowToTheGreenMarker) {
    PEELER_REQUIRE_ASSETS(assets);
    const Scene scene =
        readGltf(assets / "gltf-sample-assets/TextureTransformTest/glTF/TextureTransformTest.gltf");
    const auto named = [](const auto& items, const char* name) {
        return *std::find_if(items.begin(), items.end(),
                             [&](const auto& item) { return item.name == name; });
    };
    // The quad spans −0.5 … 0.5, with texture coordinates 0 … 1 and v down. The picture has an
    // arrow that points from its upper left corner along the diagonal, so the marker node must be
    // at that corner.
    const glm::dvec4 marker = named(scene.nodes, "Rotation - Correct").local[3];
    const Material material = named(scene.materials, "Rotation");
    const glm::vec3 uv =
        material.base_color_texture.transform * glm::vec3(marker.x + 0.5, 0.5 - marker.y, 1);
    EXPECT_NEAR(uv.x, uv.y, 1e-4);
    EXPECT_GT(uv.x, 0.7);
}

TEST(GltfAssets, Ktx2TexturesHaveTheBitsOfTheReferenceTranscoder) {
    PEELER_REQUIRE_ASSETS(assets);
    const Scene scene = readGltf(assets / "gltf-sample-assets/AgiHqKtx2/0.glb");
    EXPECT_TRUE(scene.warnings.empty());
    ASSERT_EQ(scene.images.size(), 1U);
    const Image& image = scene.images[0];
    EXPECT_EQ(image.width, 1024);
    EXPECT_EQ(image.height, 1024);
    EXPECT_EQ(image.codec, "KTX2, ETC1S, BasisLZ");
    // The hash of basis_universal's RGBA32 output for this file (BinomialLLC, commit 9bebe16).
    EXPECT_EQ(hexText(contentHash(std::as_bytes(std::span(image.rgba)), 0)), "06e0620b0df6ae8f");
}

TEST(GltfAssets, MalformedFilesEndInASceneOrAnInputError) {
    PEELER_REQUIRE_ASSETS(assets);
    const std::vector<fs::path> files = modelFiles(assets / "malformed-gltf");
    EXPECT_FALSE(files.empty());
    for (const fs::path& file : files) {
        SCOPED_TRACE(file.string());
        try {
            expectSound(readGltf(file));
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput) << error.what();
            EXPECT_FALSE(error.where().empty()) << error.what();
        }
    }
}

}  // namespace
}  // namespace peeler::test
