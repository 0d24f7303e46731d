// SPDX-License-Identifier: Apache-2.0
// Tests scenes stored as arrays, in both containers, and invalid scenes.
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include <peeler/error.h>
#include "formats/arrays/array_writer.h"
#include "formats/meshes/scene_reader.h"
#include "support/python.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// An array and its values as stored in a file.
struct GivenArray {
    NamedArray array;
    std::string numbers;
};

template <class T>
GivenArray given(const char* name, NumberType type, std::vector<std::uint64_t> shape,
                 const std::vector<T>& numbers) {
    std::string bytes(numbers.size() * sizeof(T), '\0');
    if (!bytes.empty()) std::memcpy(bytes.data(), numbers.data(), bytes.size());
    return {{name, type, std::move(shape)}, bytes};
}

struct GivenScene {
    std::map<std::string, GivenArray> arrays;
    ArrayTexts texts;

    void set(GivenArray array) { arrays[array.array.name] = std::move(array); }
    std::string write(const ScratchDir& scratch, const std::string& name) const {
        std::vector<NamedArray> named;
        for (const auto& [key, array] : arrays)
            named.push_back(array.array);
        ArrayWriter writer(scratch / name, named, texts);
        std::size_t i = 0;
        for (const auto& [key, array] : arrays)
            writer.append(i++, asBytes(array.numbers));
        writer.finish();
        return scratch / name;
    }
};

GivenScene quad() {
    GivenScene scene;
    scene.set(
        given<float>("vertices", NumberType::kFloat, {4, 3}, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}));
    scene.set(given<std::int64_t>("faces", NumberType::kInt64, {2, 3}, {0, 1, 2, 0, 2, 3}));
    return scene;
}

TEST(ArrayScenes, HaveEverythingThatTheirArraysSay) {
    const ScratchDir scratch;
    GivenScene scene = quad();
    scene.set(given<double>("normals", NumberType::kDouble, {4, 3}, std::vector<double>(12, 0.5)));
    scene.set(given<float>("uv", NumberType::kFloat, {4, 2}, {0, 0, 1, 0, 1, 1, 0, 1}));
    scene.set(given<std::uint8_t>("colors", NumberType::kUint8, {4, 3},
                                  {0, 51, 255, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
    scene.set(given<std::uint8_t>("texture", NumberType::kUint8, {1, 2, 3}, {1, 2, 3, 4, 5, 6}));
    scene.texts = {{"base_color", "[0.5, 1, 0.25, 0.75]"},
                   {"metallic", "1"},
                   {"roughness", "0.5"},
                   {"alpha_mode", "BLEND"},
                   {"double_sided", "true"},
                   {"name", "a \"quad\""},
                   {"format", "pt"}};
    const std::string path = scene.write(scratch, "scene.bin.safetensors");
    const Scene read = readSceneFile(path);
    EXPECT_TRUE(read.warnings.empty());
    EXPECT_EQ(read.nodes.front().name, "a \"quad\"");
    const Primitive& primitive = read.meshes.front().primitives.front();
    EXPECT_EQ(primitive.indices, (std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3}));
    EXPECT_EQ(primitive.positions[2], glm::vec3(1, 1, 0));
    EXPECT_EQ(primitive.normals[3], glm::vec3(0.5F));
    EXPECT_EQ(primitive.texcoords[0][1], glm::vec2(1, 0));
    EXPECT_EQ(primitive.colors[0], glm::vec4(0, 0.2F, 1, 1));
    const Material& material = read.materials[static_cast<std::size_t>(primitive.material)];
    EXPECT_EQ(material.base_color, glm::vec4(0.5F, 1, 0.25F, 0.75F));
    EXPECT_EQ(material.metallic, 1);
    EXPECT_EQ(material.roughness, 0.5F);
    EXPECT_EQ(material.alpha_mode, AlphaMode::kBlend);
    EXPECT_TRUE(material.double_sided);
    EXPECT_EQ(read.images.at(0).rgba, (std::vector<std::uint8_t>{1, 2, 3, 255, 4, 5, 6, 255}));
    EXPECT_EQ(read.images[0].width, 2);
    // The hash depends on the content, not on the file name.
    EXPECT_EQ(readSceneFile(scene.write(scratch, "b.safetensors")).content_hash, read.content_hash);
    scene.texts["roughness"] = "0.25";
    EXPECT_NE(readSceneFile(scene.write(scratch, "b.safetensors")).content_hash, read.content_hash);
}

TEST(ArrayScenes, NumpyWritesThemAsNpz) {
    PEELER_REQUIRE_PYTHON("numpy");
    const ScratchDir scratch;
    for (const char* save : {"savez", "savez_compressed"}) {
        const std::string path = scratch / (std::string(save) + ".npz");
        const auto written = runPython(
            "import sys, numpy\n"
            "numpy." +
                std::string(save) +
                "(sys.argv[1], faces=numpy.array([[0, 1], [1, 2]]), "
                "vertices=numpy.eye(3), mode='lines', name='é', double_sided=True, metallic=0.5, "
                "base_color=numpy.array([1, 0, 0, 1.0]), alpha_mode=numpy.bytes_(b'MASK'))\n",
            {path});
        ASSERT_EQ(written.exit_code, 0) << written.err;
        const Scene read = readSceneFile(path);
        EXPECT_TRUE(read.warnings.empty()) << read.warnings.front();
        EXPECT_EQ(read.nodes.front().name, "é");
        const Primitive& primitive = read.meshes.front().primitives.front();
        EXPECT_EQ(primitive.topology, Topology::kLines);
        EXPECT_EQ(primitive.indices.size(), 4U);
        const Material& material = read.materials.front();
        EXPECT_TRUE(material.double_sided);
        EXPECT_EQ(material.metallic, 0.5F);
        EXPECT_EQ(material.base_color, glm::vec4(1, 0, 0, 1));
        EXPECT_EQ(material.alpha_mode, AlphaMode::kMask);
    }
}

TEST(ArrayScenes, WithoutFacesTheVerticesStandInOrder) {
    const ScratchDir scratch;
    GivenScene scene = quad();
    scene.arrays.erase("faces");
    scene.texts["mode"] = "points";
    const Scene points = readSceneFile(scene.write(scratch, "a.safetensors"));
    EXPECT_TRUE(points.meshes.front().primitives.front().indices.empty());
    EXPECT_EQ(points.nodes.front().name, "a");
    scene = quad();
    scene.set(given<std::int64_t>("faces", NumberType::kInt64, {0, 3}, {}));
    const Scene nothing = readSceneFile(scene.write(scratch, "b.safetensors"));
    EXPECT_TRUE(nothing.meshes.empty());
    EXPECT_EQ(nothing.warnings.size(), 1U);
}

TEST(ArrayScenes, WhatIsPassedOverIsSaid) {
    const ScratchDir scratch;
    GivenScene scene = quad();
    scene.set(given<float>("weights", NumberType::kFloat, {1}, {1}));
    scene.texts["author"] = "me";
    const std::string path = scene.write(scratch, "a.safetensors");
    EXPECT_EQ(readSceneFile(path).warnings.size(), 2U);
    SceneReadOptions strict;
    strict.strict = true;
    EXPECT_THROW(readSceneFile(path, strict), Error);
    EXPECT_FALSE(isSceneName("a.npz"));
    EXPECT_NE(sceneFormatOf(path), nullptr);
}

}  // namespace
}  // namespace peeler::test
