// SPDX-License-Identifier: Apache-2.0
// Tests vertex data that follows the specification, and data that nearly follows it.
#include <gtest/gtest.h>

#include <cmath>

#include "core/scene/posed_scene.h"
#include "formats/gltf/gltf_builder.h"
#include "formats/gltf/material_gltf.h"

namespace peeler::test {
namespace {

constexpr const char* kAttributes = "/meshes/0/primitives/0/attributes/";

/// Returns a triangle with one additional attribute.
template <class T>
GltfBuilder with(const std::string& name, const std::vector<T>& values, const std::string& type,
                 const Json& more = Json::object()) {
    GltfBuilder builder = triangle();
    builder.attributes()[name] = builder.addAccessor<T>(values, type, more);
    return builder;
}

const Primitive& primitiveOf(const Scene& scene) {
    return scene.meshes.at(0).primitives.at(0);
}

/// Expects one warning that names the attribute and the validator's code. With `strict`, expects an
/// error at that attribute.
void expectWarned(const GltfBuilder& builder, const std::string& attribute,
                  const std::string& code) {
    const Scene scene = load(builder);
    ASSERT_EQ(scene.warnings.size(), 1U);
    EXPECT_TRUE(warned(scene, kAttributes + attribute)) << scene.warnings[0];
    EXPECT_TRUE(warned(scene, '(' + code + ')')) << scene.warnings[0];
    GltfOptions strict;
    strict.strict = true;
    EXPECT_EQ(errorOf(builder, strict).where(), kAttributes + attribute);
}

TEST(GltfColors, AreClamped) {
    const GltfBuilder beyond =
        with<float>("COLOR_0", {4, 0, 0, 1, -1, 0.5F, 0, 2, 0, 1, 0.25F, 1}, "VEC4");
    expectWarned(beyond, "COLOR_0", "ACCESSOR_NON_CLAMPED");
    const Scene scene = load(beyond);
    EXPECT_EQ(primitiveOf(scene).colors,
              (std::vector<glm::vec4>{{1, 0, 0, 1}, {0, 0.5F, 0, 1}, {0, 1, 0.25F, 1}}));
    // Rounding errors cause no warning.
    EXPECT_TRUE(
        load(with<float>("COLOR_0", {1.00001F, 0, 0, 0, 1, 0, 0, 0, 1}, "VEC3")).warnings.empty());
}

TEST(GltfColors, OfIntegersAreNormalizedWhetherTheySaySoOrNot) {
    const GltfBuilder builder =
        with<std::uint8_t>("COLOR_0", {255, 0, 0, 255, 0, 51, 0, 255, 0, 0, 255, 0}, "VEC4");
    expectWarned(builder, "COLOR_0", "MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT");
    EXPECT_EQ(primitiveOf(load(builder)).colors[1], glm::vec4(0, 0.2F, 0, 1));
    EXPECT_EQ(primitiveOf(load(with<std::uint16_t>(
                              "COLOR_0", {65535, 0, 0, 0, 65535, 0, 0, 0, 13107}, "VEC3")))
                  .colors[2],
              glm::vec4(0, 0, 0.2F, 1));
    const Error error =
        errorOf(with<std::uint32_t>("COLOR_0", std::vector<std::uint32_t>(9), "VEC3"));
    EXPECT_TRUE(contains(error.what(), "UNSIGNED_INT")) << error.what();
}

TEST(GltfTexcoords, OfIntegersAreNormalizedUnlessTheFileIsQuantized) {
    GltfBuilder builder = with<std::uint8_t>("TEXCOORD_0", {0, 0, 255, 0, 0, 51}, "VEC2");
    expectWarned(builder, "TEXCOORD_0", "MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT");
    EXPECT_EQ(primitiveOf(load(builder)).texcoords[0][2], glm::vec2(0, 0.2F));
    builder.gltf["extensionsUsed"] = {"KHR_mesh_quantization"};
    EXPECT_EQ(primitiveOf(load(builder)).texcoords[0][2], glm::vec2(0, 51));
    EXPECT_TRUE(load(builder).warnings.empty());
}

TEST(GltfWeights, OfIntegersAreNormalizedAndJointsAreNot) {
    GltfBuilder builder =
        with<std::uint8_t>("WEIGHTS_0", {255, 0, 0, 0, 255, 0, 0, 0, 204, 51, 0, 0}, "VEC4");
    builder.attributes()["JOINTS_0"] = builder.addAccessor<std::uint8_t>(
        {0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0}, "VEC4", {{"normalized", true}});
    const Scene scene = load(builder);
    const JointSet& set = primitiveOf(scene).joint_sets.at(0);
    EXPECT_EQ(set.weights[2], glm::vec4(0.8F, 0.2F, 0, 0));
    EXPECT_EQ(set.joints[2], glm::u16vec4(0, 1, 0, 0));
    EXPECT_EQ(scene.warnings.size(), 2U);
}

TEST(GltfWeights, ThatDoNotAddUpToOneAreWarned) {
    GltfBuilder builder =
        with<float>("WEIGHTS_0", {1, 0, 0, 0, 0.5F, 0.5F, 0, 0, 0.5F, 0, 0, 0}, "VEC4");
    const Json joints = builder.addAccessor<std::uint8_t>(std::vector<std::uint8_t>(12), "VEC4");
    builder.attributes()["JOINTS_0"] = joints;
    expectWarned(builder, "WEIGHTS_0", "ACCESSOR_WEIGHTS_NON_NORMALIZED");
    // A set of weights after a gap in the numbering is ignored.
    builder = with<float>("WEIGHTS_0", {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
    builder.attributes()["JOINTS_0"] =
        builder.addAccessor<std::uint8_t>(std::vector<std::uint8_t>(12), "VEC4");
    EXPECT_TRUE(load(builder).warnings.empty());
    builder.attributes()["WEIGHTS_2"] = builder.attributes()["WEIGHTS_0"];
    expectWarned(builder, "WEIGHTS_2", "MESH_PRIMITIVE_INVALID_ATTRIBUTE");
}

TEST(GltfNormals, AreScaledToUnitLength) {
    const GltfBuilder builder = with<float>("NORMAL", {0, 0, 1, 0, 3, 4, 0, 0, 0}, "VEC3");
    expectWarned(builder, "NORMAL", "ACCESSOR_VECTOR3_NON_UNIT");
    EXPECT_EQ(primitiveOf(load(builder)).normals,
              (std::vector<glm::vec3>{{0, 0, 1}, {0, 0.6F, 0.8F}, {0, 0, 0}}));
    // Even vectors with components near the maximum of float are normalised correctly.
    const float most = 3e38F;
    const Scene huge = load(with<float>("NORMAL", {most, most, 0, 0, 0, 1, 0, 0, 1}, "VEC3"));
    EXPECT_NEAR(primitiveOf(huge).normals[0].x, std::sqrt(0.5F), 1e-6);
    // Normals in signed bytes do not have exactly unit length, but keep their bits.
    const Scene stored = load(with<std::int8_t>("NORMAL", {73, 73, 73, 0, 0, 127, 0, 0, 127},
                                                "VEC3", {{"normalized", true}}));
    EXPECT_EQ(primitiveOf(stored).normals[0], glm::vec3(73 / 127.F));
    EXPECT_TRUE(stored.warnings.empty());
}

TEST(GltfTangents, AreUnitVectorsAndSigns) {
    const GltfBuilder builder =
        with<float>("TANGENT", {2, 0, 0, 1, 1, 0, 0, -0.5F, 0, 1, 0, 0}, "VEC4");
    const Scene scene = load(builder);
    EXPECT_EQ(primitiveOf(scene).tangents,
              (std::vector<glm::vec4>{{1, 0, 0, 1}, {1, 0, 0, -1}, {0, 1, 0, 1}}));
    EXPECT_EQ(scene.warnings.size(), 2U);
    EXPECT_TRUE(warned(scene, "ACCESSOR_INVALID_SIGN"));
    EXPECT_TRUE(warned(scene, "ACCESSOR_VECTOR3_NON_UNIT"));
}

TEST(GltfAttributes, ThatGltfDoesNotHaveAreWarned) {
    for (const char* name : {"COLOR", "UV0", "TEXCOORD_", "JOINTS_99999999999999999999"})
        expectWarned(with<float>(name, {0, 0, 0, 0, 0, 0}, "VEC2"), name,
                     "MESH_PRIMITIVE_INVALID_ATTRIBUTE");
    for (const char* name : {"_AO", "COLOR_1", "TEXCOORD_7"})
        EXPECT_TRUE(load(with<float>(name, {0, 0, 0, 0, 0, 0}, "VEC2")).warnings.empty()) << name;
}

TEST(GltfAttributes, WithoutWhichTexturesShowOneTexelAreWarned) {
    GltfBuilder builder = withMaterial(R"({"emissiveTexture":{"index":0}})", 1);
    builder.attributes().erase("TEXCOORD_0");
    Scene scene = load(builder);
    EXPECT_TRUE(warned(scene, "/meshes/0/primitives/0 lacks TEXCOORD_0"));
    EXPECT_TRUE(warned(scene, "MESH_PRIMITIVE_TOO_FEW_TEXCOORDS"));
    builder.attributes()["TEXCOORD_0"] = builder.addAccessor<float>({0, 0, 1, 0, 0, 1}, "VEC2");
    EXPECT_TRUE(load(builder).warnings.empty());
}

TEST(GltfPrimitives, OfNoVerticesAreLeftOut) {
    GltfBuilder builder = triangle();
    builder.gltf["accessors"][0]["count"] = 0;
    Scene scene = load(builder);
    EXPECT_TRUE(scene.meshes.at(0).primitives.empty());
    EXPECT_TRUE(warned(scene, "/accessors/0 is 0 (VALUE_NOT_IN_RANGE)"));
    EXPECT_TRUE(warned(scene, "/meshes/0/primitives/0 has too few vertices"));
    builder = triangle();
    builder.primitive()["indices"] =
        builder.addAccessor<std::uint16_t>({0}, "SCALAR", {{"count", 0}});
    EXPECT_TRUE(load(builder).meshes.at(0).primitives.empty());
}

/// Returns a triangle with a morph target that displaces colours and texture coordinates, at weight
/// 1.
GltfBuilder displacedColors() {
    GltfBuilder builder =
        with<float>("COLOR_0", {1, 0, 0, 1, 1, 0, 0, 1, 0.5F, 0, 0, 0.5F}, "VEC4");
    builder.attributes()["TEXCOORD_1"] = builder.addAccessor<float>({0, 0, 1, 0, 0, 1}, "VEC2");
    const int colors =
        builder.addAccessor<float>({-1, 1, 0, 0, 9, 0, 0, 0, 0.25F, 0, 0, -9}, "VEC4");
    const int texcoords =
        builder.addAccessor<std::int8_t>({127, 0, 0, 0, 0, 127}, "VEC2", {{"normalized", true}});
    builder.primitive()["targets"] = {{{"COLOR_0", colors}, {"TEXCOORD_1", texcoords}}};
    builder.gltf["meshes"][0]["weights"] = {1};
    return builder;
}

TEST(GltfTargets, DisplaceColorsAndTexcoords) {
    Scene scene = load(displacedColors());
    EXPECT_TRUE(scene.warnings.empty());
    PosedScene shown(scene);
    const Geometry geometry{0, 0, shown.meshes().at(0).deformed};
    EXPECT_EQ(shown.colors(geometry),
              (std::vector<glm::vec4>{{0, 1, 0, 1}, {1, 0, 0, 1}, {0.75F, 0, 0, 0}}));
    EXPECT_EQ(shown.texcoords(geometry, 1), (std::vector<glm::vec2>{{1, 0}, {1, 0}, {0, 2}}));
    EXPECT_TRUE(shown.texcoords(geometry, 0).empty());
    // At weight 0, the same arrays exist, with undisplaced values.
    scene.meshes[0].weights = {0};
    EXPECT_EQ(PosedScene(scene).deformed().at(0).at(0).colors, primitiveOf(scene).colors);
    EXPECT_TRUE(PosedScene(scene).deformed().at(0).at(0).texcoords[0].empty());
}

TEST(GltfTargets, OfColorsHaveNoAlphaUnlessTheySaySo) {
    GltfBuilder builder = displacedColors();
    builder.primitive()["targets"][0]["COLOR_0"] =
        builder.addAccessor<float>({0, 1, 0, 0, 0, 0, 0, 0, 0}, "VEC3");
    const Scene scene = load(builder);
    EXPECT_EQ(PosedScene(scene).deformed().at(0).at(0).colors[0], glm::vec4(1, 1, 0, 1));
}

TEST(GltfTargets, OfWhatThePrimitiveLacksAreWarned) {
    GltfBuilder builder = displacedColors();
    builder.attributes().erase("COLOR_0");
    const Scene scene = load(builder);
    EXPECT_EQ(scene.warnings.size(), 1U);
    EXPECT_TRUE(warned(scene, "/meshes/0/primitives/0/targets/0/COLOR_0"));
    EXPECT_TRUE(warned(scene, "MESH_PRIMITIVE_MORPH_TARGET_NO_BASE_ACCESSOR"));
    EXPECT_TRUE(PosedScene(scene).deformed().at(0).at(0).colors.empty());
}

}  // namespace
}  // namespace peeler::test
