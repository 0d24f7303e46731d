// SPDX-License-Identifier: Apache-2.0
// Tests nodes, skins, instances and visibility of glTF files.
#include "formats/gltf/gltf_parts.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "formats/gltf/gltf_builder.h"

namespace peeler::test {
namespace {

/// Returns a triangle with a skin of two joints, nodes 1 and 2.
GltfBuilder skinned() {
    GltfBuilder builder = triangle();
    builder.attributes()["JOINTS_0"] =
        builder.addAccessor<std::uint8_t>({0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 9}, "VEC4");
    builder.attributes()["WEIGHTS_0"] = builder.addAccessor<std::uint8_t>(
        {51, 204, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0}, "VEC4", {{"normalized", true}});
    std::vector<float> matrices(32);
    for (std::size_t i = 0; i < 32; ++i)
        matrices[i] = i % 16 % 5 == 0 ? 1.0F : 0.0F;
    matrices[16 + 13] = -7;  // moves the second joint down by 7
    const int view = builder.addView(toBytes(matrices));
    const int bind = builder.addAccessor(
        Json{{"bufferView", view}, {"componentType", 5126}, {"count", 2}, {"type", "MAT4"}});
    builder.gltf["nodes"] = {
        {{"mesh", 0}, {"skin", 0}}, {{"children", {2}}}, {{"translation", {0, 7, 0}}}};
    builder.gltf["skins"] = {
        {{"name", "bones"}, {"joints", {1, 2}}, {"inverseBindMatrices", bind}}};
    builder.gltf["scenes"] = {{{"nodes", {0, 1}}}};
    return builder;
}

TEST(GltfSkins, HaveJointsMatricesAndWeights) {
    const Scene scene = load(skinned());
    ASSERT_EQ(scene.skins.size(), 1U);
    EXPECT_EQ(scene.skins[0].name, "bones");
    EXPECT_EQ(scene.skins[0].joints, (std::vector<int>{1, 2}));
    EXPECT_EQ(scene.skins[0].inverse_bind[0], glm::dmat4(1));
    EXPECT_EQ(scene.skins[0].inverse_bind[1], glm::translate(glm::dmat4(1), glm::dvec3(0, -7, 0)));
    EXPECT_EQ(scene.nodes[0].skin, 0);
    const auto& sets = scene.meshes[0].primitives[0].joint_sets;
    ASSERT_EQ(sets.size(), 1U);
    EXPECT_EQ(sets[0].joints[0], glm::u16vec4(0, 1, 0, 0));
    EXPECT_EQ(sets[0].weights[0], glm::vec4(0.2F, 0.8F, 0, 0));
    EXPECT_TRUE(scene.warnings.empty());
}

TEST(GltfSkins, WithoutMatricesBindAtTheOrigin) {
    GltfBuilder builder = skinned();
    builder.gltf["skins"][0].erase("inverseBindMatrices");
    EXPECT_EQ(load(builder).skins[0].inverse_bind, (std::vector<glm::dmat4>(2, glm::dmat4(1))));
}

TEST(GltfSkins, RefuseDamage) {
    const struct {
        const char* what;
        void (*damage)(GltfBuilder&);
        const char* where;
    } rows[] = {
        {"a joint that the skin has not",
         [](GltfBuilder& b) { b.gltf["skins"][0]["joints"] = {1}; }, "/nodes/0/skin"},
        {"no joints", [](GltfBuilder& b) { b.gltf["skins"][0]["joints"] = Json::array(); },
         "/skins/0/joints"},
        {"too few matrices",
         [](GltfBuilder& b) {
             b.gltf["skins"][0]["joints"] = {1, 2, 0};
         },
         "/skins/0/inverseBindMatrices"},
        {"matrices that are none",
         [](GltfBuilder& b) { b.gltf["skins"][0]["inverseBindMatrices"] = 0; },
         "/skins/0/inverseBindMatrices"},
        {"joints without weights", [](GltfBuilder& b) { b.attributes().erase("WEIGHTS_0"); },
         "/meshes/0/primitives/0/attributes"},
        {"a joint node that is not there",
         [](GltfBuilder& b) {
             b.gltf["skins"][0]["joints"] = {1, 3};
         },
         "/skins/0/joints/1"},
    };
    for (const auto& row : rows) {
        GltfBuilder builder = skinned();
        row.damage(builder);
        EXPECT_EQ(errorOf(builder).where(), row.where) << row.what;
    }
}

TEST(GltfMorphTargets, AreAsManyInEveryPrimitive) {
    GltfBuilder builder = triangle();
    const Json plain = builder.primitive();
    builder.primitive()["targets"] = {{{"POSITION", 0}, {"NORMAL", 0}}};
    builder.gltf["meshes"][0]["primitives"].push_back(plain);
    EXPECT_EQ(errorOf(builder).where(), "/meshes/0/primitives/1/targets");
    builder.gltf["meshes"][0]["primitives"][1]["targets"] = {{{"POSITION", 0}}};
    const Scene scene = load(builder);
    EXPECT_EQ(scene.meshes[0].primitives[0].targets[0].normals.size(), 3U);
    EXPECT_TRUE(scene.meshes[0].primitives[1].targets[0].normals.empty());
}

GltfBuilder instanced() {
    GltfBuilder builder = triangle();
    const int places = builder.addAccessor<float>({1, 2, 3, 4, 5, 6}, "VEC3");
    const int turns = builder.addAccessor<std::int8_t>({0, 0, 0, 127, 0, 0, 127, 0}, "VEC4",
                                                       {{"normalized", true}});
    const int sizes = builder.addAccessor<float>({1, 1, 1, 2, 3, 4}, "VEC3");
    builder.gltf["extensionsUsed"] =
        builder.gltf["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
    builder.gltf["nodes"][0]["extensions"] = {
        {"EXT_mesh_gpu_instancing",
         {{"attributes",
           {{"TRANSLATION", places}, {"ROTATION", turns}, {"SCALE", sizes}, {"_ID", 0}}}}}};
    return builder;
}

Json& instanceAttributes(GltfBuilder& builder) {
    return builder.gltf["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
}

TEST(GltfInstances, AreTranslationRotationScale) {
    const Scene scene = load(instanced());
    ASSERT_TRUE(scene.nodes[0].instances);
    ASSERT_EQ(scene.nodes[0].instances->size(), 2U);
    const auto& instances = *scene.nodes[0].instances;
    EXPECT_EQ(instances[0], glm::translate(glm::dmat4(1), glm::dvec3(1, 2, 3)));
    // The second instance is rotated by half a turn about Z.
    EXPECT_EQ(instances[1] * glm::dvec4(1, 1, 1, 1), glm::dvec4(4 - 2, 5 - 3, 6 + 4, 1));
    EXPECT_TRUE(scene.warnings.empty());
}

TEST(GltfInstances, MayLackAttributes) {
    GltfBuilder builder = instanced();
    instanceAttributes(builder).erase("ROTATION");
    instanceAttributes(builder).erase("SCALE");
    EXPECT_EQ((*load(builder).nodes[0].instances)[1],
              glm::translate(glm::dmat4(1), glm::dvec3(4, 5, 6)));
    instanceAttributes(builder).erase("TRANSLATION");
    EXPECT_EQ(load(builder).nodes[0].instances->size(), 1U);
}

TEST(GltfInstances, RefuseDamage) {
    GltfBuilder builder = instanced();
    instanceAttributes(builder)["SCALE"] = builder.addAccessor<float>({1, 1, 1}, "VEC3");
    const std::string where = "/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes/";
    EXPECT_EQ(errorOf(builder).where(), where + "SCALE");
    builder = instanced();
    instanceAttributes(builder)["TRANSLATION"] =
        builder.addAccessor<float>({0, 0, INFINITY, 0, 0, 0}, "VEC3");
    EXPECT_EQ(errorOf(builder).where(), where + "TRANSLATION");
    builder = instanced();
    instanceAttributes(builder)["ROTATION"] = 99;
    EXPECT_EQ(errorOf(builder).where(), where + "ROTATION");
    GltfOptions tight;
    tight.max_geometry_bytes = 1200;
    EXPECT_EQ(errorOf(instanced(), tight).where(), where + "ROTATION");
}

TEST(GltfSkins, CountTheRoomOfEveryNodeThatTheyDeform) {
    GltfBuilder builder = skinned();
    for (int i = 0; i < 10; ++i)
        builder.gltf["nodes"].push_back({{"mesh", 0}, {"skin", 0}});
    GltfOptions tight;
    tight.max_geometry_bytes = 600;  // each node takes 120 bytes for its three vertices
    EXPECT_EQ(errorOf(builder, tight).where(), "/nodes/7");
    EXPECT_EQ(load(builder).nodes.size(), 13U);
}

TEST(GltfInstances, OfASkinnedMeshAreLeftOut) {
    GltfBuilder builder = skinned();
    const int places = builder.addAccessor<float>({1, 2, 3, 4, 5, 6}, "VEC3");
    builder.gltf["nodes"][0]["extensions"] = {
        {"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", places}}}}}};
    const Scene scene = load(builder);
    EXPECT_FALSE(scene.nodes[0].instances);
    EXPECT_TRUE(warned(scene, "joints place the skinned mesh"));
}

TEST(GltfNodes, CanBeHidden) {
    GltfBuilder builder = triangle();
    builder.gltf["extensionsUsed"] = builder.gltf["extensionsRequired"] = {"KHR_node_visibility"};
    EXPECT_TRUE(load(builder).nodes[0].visible);
    builder.gltf["nodes"][0]["extensions"] = {{"KHR_node_visibility", {{"visible", false}}}};
    EXPECT_FALSE(load(builder).nodes[0].visible);
    builder.gltf["nodes"][0]["extensions"] = {{"KHR_node_visibility", {{"visible", 0}}}};
    EXPECT_EQ(errorOf(builder).where(), "/nodes/0/extensions/KHR_node_visibility/visible");
}

TEST(GltfNodes, KeepTextsAndNumbersOfTheirExtras) {
    using Extras = std::vector<std::pair<std::string, std::string>>;
    GltfBuilder builder = triangle();
    EXPECT_TRUE(load(builder).nodes[0].extras.empty());
    builder.gltf["nodes"][0]["extras"] = {{"class", "car"},   {"id", 9007199254740993},
                                          {"mass", 0.1},      {"parked", true},
                                          {"tags", {"a", 1}}, {"none", nullptr}};
    EXPECT_EQ(
        load(builder).nodes[0].extras,
        (Extras{
            {"class", "car"}, {"id", "9007199254740993"}, {"mass", "0.1"}, {"parked", "true"}}));
    builder.gltf["nodes"][0]["extras"] = "a text";  // the specification allows any value
    EXPECT_TRUE(load(builder).nodes[0].extras.empty());
}

}  // namespace
}  // namespace peeler::test
