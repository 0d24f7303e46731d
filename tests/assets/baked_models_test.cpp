// SPDX-License-Identifier: Apache-2.0
// Tests baked values in real models that are compressed, quantised, instanced, skinned or animated.
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <glm/gtc/type_ptr.hpp>

#include "cmd/bake/bake_options.h"
#include "cmd/bake/bake_values.h"
#include "formats/gltf/gltf_reader.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kModels[] = {
    "2CylinderEngine/glTF-Draco/2CylinderEngine.gltf",
    "BoxTexturedMeshopt",
    "CesiumMan/glTF-Draco/CesiumMan.gltf",
    "CesiumMilkTruck",
    "Duck/glTF-Quantized/Duck.gltf",
    "Fox",
    "MeshoptFallback",
    "MeshoptNoFallback",
    "MeshPrimitiveModes",
    "MorphPrimitivesTest",
    "NegativeScaleTest",
    "SimpleInstancing",
    "SimpleSparseAccessor",
    "VertexColorTest",
};

/// Returns the path of a model's file; if `name` is a folder, returns the first file in it.
fs::path modelFile(const fs::path& assets, const std::string& name) {
    const fs::path path = assets / "gltf-sample-assets" / name;
    if (fs::is_regular_file(path)) return path;
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(path))
        if (entry.path().extension() == ".glb" || entry.path().extension() == ".gltf")
            files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files.empty() ? path : files.front();
}

/// Writes the model with the given occlusion at every vertex.
void bakeConstant(const fs::path& model, float value, const fs::path& out) {
    const Scene scene = readGltf(model);
    const PosedScene shown(scene);
    const VertexReceivers vertices(shown);
    const std::vector<float> values(vertices.receivers().size(), value);
    GlbWriter package(model, GltfOptions{});
    addVertexValues(package, "_AO",
                    cmd::bakedPrimitives(shown, vertices, values, BakeQuantity::kAmbientOcclusion,
                                         {BakeQuantity::kAmbientOcclusion, {}}));
    EXPECT_TRUE(package.warnings().empty());
    package.write(out.string());
}

void expectLoadsElsewhere(const fs::path& path) {
    tinygltf::TinyGLTF reader;
    reader.SetImageLoader([](tinygltf::Image*, int, std::string*, std::string*, int, int,
                             const unsigned char*, int, void*) { return true; },
                          nullptr);
    tinygltf::Model model;
    std::string problems, remarks;
    EXPECT_TRUE(reader.LoadBinaryFromFile(&model, &problems, &remarks, path.string())) << problems;
}

TEST(BakedModels, ShowTheSameGeometryWithColours) {
    PEELER_REQUIRE_ASSETS(assets);
    constexpr float kValue = 0.5F;
    for (const char* name : kModels) {
        SCOPED_TRACE(name);
        const ScratchDir folder;
        const fs::path model = modelFile(assets, name), baked = folder / "baked.glb";
        bakeConstant(model, kValue, baked);
        const Scene before = readGltf(model), after = readGltf(baked);
        EXPECT_EQ(after.warnings, before.warnings);
        EXPECT_EQ(after.animations.size(), before.animations.size());
        EXPECT_EQ(after.images.size(), before.images.size());
        const PosedScene shown(before);
        const PosedScene found(after);
        ASSERT_EQ(found.meshes().size(), shown.meshes().size());
        std::size_t colored = 0;
        for (std::size_t i = 0; i < shown.meshes().size(); ++i) {
            EXPECT_EQ(found.meshes()[i].world, shown.meshes()[i].world);
            const auto& old = shown.primitives(shown.meshes()[i]);
            const auto& now = found.primitives(found.meshes()[i]);
            ASSERT_EQ(now.size(), old.size());
            for (std::size_t p = 0; p < old.size(); ++p) {
                EXPECT_EQ(now[p].positions, old[p].positions);
                EXPECT_EQ(now[p].indices, old[p].indices);
                EXPECT_EQ(now[p].normals, old[p].normals);
                EXPECT_EQ(now[p].texcoords, old[p].texcoords);
                EXPECT_EQ(now[p].material, old[p].material);
                if (!isOfTriangles(old[p])) {
                    EXPECT_EQ(now[p].colors, old[p].colors);
                    continue;
                }
                ASSERT_EQ(now[p].colors.size(), old[p].positions.size());
                for (std::size_t v = 0; v < now[p].colors.size(); v += 7) {
                    const glm::vec4 color = old[p].colors.empty() ? glm::vec4(1) : old[p].colors[v];
                    for (int c = 0; c < 3; ++c)
                        ASSERT_NEAR(now[p].colors[v][c], kValue * color[c], 1.0F / 65535);
                    ASSERT_NEAR(now[p].colors[v].a, color.a, 1.0F / 65535);
                }
                ++colored;
            }
        }
        EXPECT_GT(colored, 0U);
        // Debian's tinygltf can read neither kind of compression (formats/README.md, "Input that is
        // not trusted").
        const std::string text = name;
        if (text.find("Meshopt") == std::string::npos && text.find("Draco") == std::string::npos)
            expectLoadsElsewhere(baked);
    }
}

TEST(BakedModels, LookTheSameWhereNothingIsOccluded) {
    PEELER_REQUIRE_ASSETS(assets);
    for (const char* name : {"Duck/glTF-Quantized/Duck.gltf", "CesiumMilkTruck"}) {
        const ScratchDir folder;
        const fs::path model = modelFile(assets, name);
        bakeConstant(model, 1, folder / "baked.glb");
        const auto render = [&](const fs::path& scene, const std::string& out) {
            const Outcome result =
                runPeeler({"render", scene.string(), "-o", (folder / out).string(), "--as",
                           "composite", "--size", "160x120", "-q"});
            EXPECT_EQ(result.exit_code, 0) << result.err;
        };
        render(model, "before.exr");
        render(folder / "baked.glb", "after.exr");
        const Outcome compared =
            runPeeler({"compare", (folder / "before.exr").string(), (folder / "after.exr").string(),
                       "--max-color", "0.0005"});  // interpolated white may be 1 − 2^−24
        EXPECT_EQ(compared.exit_code, 0) << name << ": " << compared.out << compared.err;
    }
}

}  // namespace
}  // namespace peeler::test
