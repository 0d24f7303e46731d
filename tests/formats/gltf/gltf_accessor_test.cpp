// SPDX-License-Identifier: Apache-2.0
// Tests that all legal kinds of vertex data are read exactly, and that damaged data is rejected.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "formats/gltf/gltf_builder.h"

namespace peeler::test {
namespace {

const Primitive& onlyPrimitive(const Scene& scene) {
    return scene.meshes.at(0).primitives.at(0);
}

TEST(GltfAccessor, ReadsPackedFloats) {
    const Scene scene = load(triangle());
    EXPECT_EQ(onlyPrimitive(scene).positions,
              (std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_TRUE(onlyPrimitive(scene).indices.empty());
    EXPECT_TRUE(onlyPrimitive(scene).normals.empty());
    EXPECT_TRUE(onlyPrimitive(scene).tangents.empty());
    EXPECT_TRUE(scene.warnings.empty());
}

TEST(GltfAccessor, ReadsInterleavedVertices) {
    GltfBuilder builder = triangle();
    // Each vertex has position, normal and UV: 32 bytes.
    const std::vector<float> vertices = {0, 0, 0, 0, 0, 1, 0.25F, 0.5F,  //
                                         2, 0, 0, 0, 1, 0, 0.75F, 1.5F,  //
                                         0, 3, 0, 1, 0, 0, -1,    2};
    const int view = builder.addView(toBytes(vertices), {{"byteStride", 32}});
    const auto add = [&](int offset, const char* type) {
        return builder.addAccessor({{"bufferView", view},
                                    {"byteOffset", offset},
                                    {"componentType", 5126},
                                    {"count", 3},
                                    {"type", type}});
    };
    builder.attributes() = {
        {"POSITION", add(0, "VEC3")}, {"NORMAL", add(12, "VEC3")}, {"TEXCOORD_0", add(24, "VEC2")}};
    const Scene scene = load(builder);
    EXPECT_EQ(onlyPrimitive(scene).positions[2], glm::vec3(0, 3, 0));
    EXPECT_EQ(onlyPrimitive(scene).normals[1], glm::vec3(0, 1, 0));
    EXPECT_EQ(onlyPrimitive(scene).texcoords[0],
              (std::vector<glm::vec2>{{0.25F, 0.5F}, {0.75F, 1.5F}, {-1, 2}}));
}

TEST(GltfAccessor, ReadsDataOfAnyAlignment) {
    GltfBuilder builder = triangle();
    Bytes bytes = toBytes<float>({1, 2, 3, 4, 5, 6, 7, 8, 9});
    bytes.insert(bytes.begin(), 0xAA);
    const int view = builder.addView(bytes);
    builder.attributes()["POSITION"] = builder.addAccessor({{"bufferView", view},
                                                            {"byteOffset", 1},
                                                            {"componentType", 5126},
                                                            {"count", 3},
                                                            {"type", "VEC3"}});
    EXPECT_EQ(onlyPrimitive(load(builder)).positions[2], glm::vec3(7, 8, 9));
}

TEST(GltfAccessor, NormalizesIntegersAsTheSpecificationSays) {
    GltfBuilder builder = triangle();
    const Json normalized = {{"normalized", true}};
    builder.attributes()["POSITION"] = builder.addAccessor<std::int8_t>(
        {127, 0, 0, -128, 64, -127, 0, 0, 127}, "VEC3", normalized);
    builder.attributes()["TEXCOORD_0"] =
        builder.addAccessor<std::uint8_t>({0, 255, 51, 102, 1, 2}, "VEC2", normalized);
    builder.attributes()["TEXCOORD_1"] =
        builder.addAccessor<std::uint16_t>({0, 65535, 13107, 1, 2, 3}, "VEC2", normalized);
    builder.attributes()["COLOR_0"] =
        builder.addAccessor<std::uint8_t>({255, 0, 51, 0, 0, 0, 255, 255, 255}, "VEC3", normalized);
    const Scene scene = load(builder);
    EXPECT_EQ(onlyPrimitive(scene).positions[0], glm::vec3(1, 0, 0));
    EXPECT_EQ(onlyPrimitive(scene).positions[1], glm::vec3(-1, 64 / 127.F, -1));
    EXPECT_EQ(onlyPrimitive(scene).texcoords[0][0], glm::vec2(0, 1));
    EXPECT_EQ(onlyPrimitive(scene).texcoords[0][1], glm::vec2(51 / 255.F, 102 / 255.F));
    EXPECT_EQ(onlyPrimitive(scene).texcoords[1][1], glm::vec2(13107 / 65535.F, 1 / 65535.F));
    EXPECT_EQ(onlyPrimitive(scene).colors[0], glm::vec4(1, 0, 51 / 255.F, 1));
}

TEST(GltfAccessor, ReadsColorsWithAlpha) {
    GltfBuilder builder = triangle();
    builder.attributes()["COLOR_0"] =
        builder.addAccessor<float>({1, 0, 0, 0.25F, 0, 1, 0, 0.5F, 0, 0, 1, 0.75F}, "VEC4");
    EXPECT_EQ(onlyPrimitive(load(builder)).colors[2], glm::vec4(0, 0, 1, 0.75F));
    builder.attributes()["COLOR_0"] = builder.addAccessor<std::uint16_t>(
        {65535, 0, 0, 0, 0, 0, 0, 65535, 0, 0, 0, 0}, "VEC4", {{"normalized", true}});
    EXPECT_EQ(onlyPrimitive(load(builder)).colors[1], glm::vec4(0, 0, 0, 1));
}

/// All types that KHR_mesh_quantization allows for positions, with and without normalisation.
template <typename T>
class QuantizedPosition : public testing::Test {};
using QuantizedTypes = testing::Types<std::int8_t, std::uint8_t, std::int16_t, std::uint16_t>;
TYPED_TEST_SUITE(QuantizedPosition, QuantizedTypes);

TYPED_TEST(QuantizedPosition, IsReadWithAndWithoutNormalisation) {
    constexpr TypeParam max = std::numeric_limits<TypeParam>::max();
    for (const bool normalized : {false, true}) {
        GltfBuilder builder = triangle();
        builder.gltf["extensionsUsed"] = {"KHR_mesh_quantization"};
        builder.gltf["extensionsRequired"] = {"KHR_mesh_quantization"};
        Bytes bytes;
        for (int vertex = 0; vertex < 3; ++vertex) {
            Bytes element = toBytes<TypeParam>({max, static_cast<TypeParam>(vertex), 5});
            element.resize(8);  // pads the element to a multiple of 4 bytes
            bytes.insert(bytes.end(), element.begin(), element.end());
        }
        const int view = builder.addView(bytes, {{"byteStride", 8}});
        builder.attributes()["POSITION"] =
            builder.addAccessor({{"bufferView", view},
                                 {"componentType", componentType<TypeParam>()},
                                 {"normalized", normalized},
                                 {"count", 3},
                                 {"type", "VEC3"}});
        const float unit = normalized ? static_cast<float>(max) : 1.F;
        EXPECT_EQ(onlyPrimitive(load(builder)).positions[2],
                  glm::vec3(static_cast<float>(max) / unit, 2 / unit, 5 / unit));
    }
}

TEST(GltfAccessor, AppliesSparseSubstitution) {
    GltfBuilder builder = triangle();
    const int indices = builder.addView(toBytes<std::uint8_t>({0, 2}));
    const int values = builder.addView(toBytes<float>({7, 8, 9, 10, 11, 12}));
    builder.gltf["accessors"][0]["sparse"] = {
        {"count", 2},
        {"indices", {{"bufferView", indices}, {"componentType", 5121}}},
        {"values", {{"bufferView", values}}}};
    EXPECT_EQ(onlyPrimitive(load(builder)).positions,
              (std::vector<glm::vec3>{{7, 8, 9}, {1, 0, 0}, {10, 11, 12}}));

    // A sparse accessor without a buffer view starts from zeros (§3.6.2.3).
    builder.gltf["accessors"][0].erase("bufferView");
    EXPECT_EQ(onlyPrimitive(load(builder)).positions,
              (std::vector<glm::vec3>{{7, 8, 9}, {0, 0, 0}, {10, 11, 12}}));
}

TEST(GltfAccessor, AppliesSparseSubstitutionToIndicesAndToAStretch) {
    GltfBuilder builder;
    builder = triangle();
    const int position =
        builder.addAccessor<float>({0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0, 4, 0, 0, 5, 0, 0}, "VEC3");
    const int places = builder.addView(toBytes<std::uint16_t>({0, 4}));
    const int values = builder.addView(toBytes<float>({-1, -1, -1, 9, 9, 9}));
    builder.gltf["accessors"][static_cast<std::size_t>(position)]["sparse"] = {
        {"count", 2},
        {"indices", {{"bufferView", places}, {"componentType", 5123}}},
        {"values", {{"bufferView", values}}}};
    builder.attributes()["POSITION"] = position;
    // The accessor of the indices has no buffer view, so they start from zeros. The sparse values
    // replace all of them.
    const int which = builder.addView(toBytes<std::uint8_t>({0, 1, 2}));
    const int index_values = builder.addView(toBytes<std::uint32_t>({3, 4, 5}));
    builder.primitive()["indices"] =
        builder.addAccessor({{"componentType", 5125},
                             {"count", 3},
                             {"type", "SCALAR"},
                             {"sparse",
                              {{"count", 3},
                               {"indices", {{"bufferView", which}, {"componentType", 5121}}},
                               {"values", {{"bufferView", index_values}}}}}});
    const Scene scene = load(builder);
    // Only vertices 3 … 5 are used, so only these are kept.
    EXPECT_EQ(onlyPrimitive(scene).positions,
              (std::vector<glm::vec3>{{3, 0, 0}, {9, 9, 9}, {5, 0, 0}}));
    EXPECT_EQ(onlyPrimitive(scene).indices, (std::vector<std::uint32_t>{0, 1, 2}));
}

template <typename T>
class IndexType : public testing::Test {};
using IndexTypes = testing::Types<std::uint8_t, std::uint16_t, std::uint32_t>;
TYPED_TEST_SUITE(IndexType, IndexTypes);

TYPED_TEST(IndexType, IsReadAndChecked) {
    GltfBuilder builder = triangle();
    const int good = builder.addAccessor<TypeParam>({2, 1, 0}, "SCALAR");
    const int beyond = builder.addAccessor<TypeParam>({0, 1, 3}, "SCALAR");
    const int restart =
        builder.addAccessor<TypeParam>({0, std::numeric_limits<TypeParam>::max(), 1}, "SCALAR");
    builder.primitive()["indices"] = good;
    EXPECT_EQ(onlyPrimitive(load(builder)).indices, (std::vector<std::uint32_t>{2, 1, 0}));
    builder.primitive()["indices"] = beyond;
    EXPECT_EQ(errorOf(builder).where(), "/meshes/0/primitives/0/indices");
    builder.primitive()["indices"] = restart;
    EXPECT_NE(std::string(errorOf(builder).what()).find("restart"), std::string::npos);
}

/// Damage::json is a JSON patch (RFC 6902) for triangle(), whose buffer has 36 bytes.
class GltfAccessorDamage : public testing::TestWithParam<Damage> {};

TEST_P(GltfAccessorDamage, IsRefusedWithItsPointer) {
    GltfBuilder builder = triangle();
    builder.gltf["buffers"] = {{{"byteLength", 36}}};
    builder.gltf = builder.gltf.patch(Json::parse(GetParam().json));
    const Error error = errorOf(builder);
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_EQ(error.where(), GetParam().where) << error.what();
    EXPECT_FALSE(error.hint().empty());
}

INSTANTIATE_TEST_SUITE_P(
    All, GltfAccessorDamage,
    testing::Values(
        Damage{"CountTooLarge", R"([{"op":"replace","path":"/accessors/0/count","value":4}])",
               "/accessors/0"},
        Damage{"CountHuge", R"([{"op":"replace","path":"/accessors/0/count","value":2147483648}])",
               "/accessors/0"},
        Damage{"CountWraps",
               R"([{"op":"replace","path":"/accessors/0/count","value":9007199254740992}])",
               "/accessors/0"},
        Damage{"CountBeyondJson", R"([{"op":"replace","path":"/accessors/0/count","value":1e19}])",
               "/accessors/0/count"},
        Damage{"CountNegative", R"([{"op":"replace","path":"/accessors/0/count","value":-1}])",
               "/accessors/0/count"},
        Damage{"CountFraction", R"([{"op":"replace","path":"/accessors/0/count","value":2.5}])",
               "/accessors/0/count"},
        Damage{"UnbackedCountHuge", R"([{"op":"remove","path":"/accessors/0/bufferView"},
                 {"op":"replace","path":"/accessors/0/count","value":2147483648}])",
               "/accessors/0/count"},
        Damage{"OffsetBeyond", R"([{"op":"add","path":"/accessors/0/byteOffset","value":4}])",
               "/accessors/0"},
        Damage{"OffsetWraps",
               R"([{"op":"add","path":"/accessors/0/byteOffset","value":9007199254740991}])",
               "/accessors/0"},
        Damage{"ViewBeyondBuffer",
               R"([{"op":"replace","path":"/bufferViews/0/byteLength","value":37}])",
               "/bufferViews/0"},
        Damage{"ViewOffsetWraps",
               R"([{"op":"replace","path":"/bufferViews/0/byteOffset","value":9007199254740991}])",
               "/bufferViews/0"},
        Damage{"StrideTooSmall", R"([{"op":"add","path":"/bufferViews/0/byteStride","value":8}])",
               "/bufferViews/0/byteStride"},
        Damage{"StrideTooLarge", R"([{"op":"add","path":"/bufferViews/0/byteStride","value":256}])",
               "/bufferViews/0/byteStride"},
        Damage{"StrideOdd", R"([{"op":"add","path":"/bufferViews/0/byteStride","value":13}])",
               "/bufferViews/0/byteStride"},
        Damage{"WrongType", R"([{"op":"replace","path":"/accessors/0/type","value":"VEC2"}])",
               "/meshes/0/primitives/0/attributes/POSITION"},
        Damage{"MatrixOfTheRightWidth",
               R"([{"op":"add","path":"/accessors/1","value":
                    {"bufferView":0,"componentType":5126,"count":3,"type":"MAT2"}},
                   {"op":"add","path":"/meshes/0/primitives/0/attributes/TANGENT","value":1}])",
               "/meshes/0/primitives/0/attributes/TANGENT"},
        Damage{"UnknownType", R"([{"op":"replace","path":"/accessors/0/type","value":"VEC5"}])",
               "/accessors/0/type"},
        Damage{"WrongComponentType",
               R"([{"op":"replace","path":"/accessors/0/componentType","value":5125}])",
               "/meshes/0/primitives/0/attributes/POSITION"},
        Damage{"Double", R"([{"op":"replace","path":"/accessors/0/componentType","value":5130}])",
               "/accessors/0/componentType"},
        Damage{"IndicesNotScalar",
               R"([{"op":"add","path":"/meshes/0/primitives/0/indices","value":0}])",
               "/meshes/0/primitives/0/indices"},
        Damage{"BufferLongerThanFile",
               R"([{"op":"replace","path":"/buffers/0/byteLength","value":37}])", "/buffers/0"},
        Damage{"SparseCountTooLarge", R"([{"op":"add","path":"/accessors/0/sparse","value":
                 {"count":4,"indices":{"bufferView":0,"componentType":5121},
                  "values":{"bufferView":0}}}])",
               "/accessors/0/sparse/count"},
        Damage{"SparseValuesBeyond", R"([{"op":"add","path":"/accessors/0/sparse","value":
                 {"count":2,"indices":{"bufferView":0,"componentType":5121},
                  "values":{"bufferView":0,"byteOffset":16}}}])",
               "/accessors/0/sparse/values"},
        Damage{"SparseIndexBeyond", R"([{"op":"add","path":"/accessors/0/sparse","value":
                 {"count":1,"indices":{"bufferView":0,"byteOffset":14,"componentType":5121},
                  "values":{"bufferView":0}}}])",
               "/accessors/0/sparse/indices"},
        Damage{"SparseWithoutValues", R"([{"op":"add","path":"/accessors/0/sparse","value":
                 {"count":1,"indices":{"bufferView":0,"componentType":5121}}}])",
               "/accessors/0/sparse"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(GltfAccessor, WantsEqualCounts) {
    GltfBuilder builder = triangle();
    builder.attributes()["NORMAL"] = builder.addAccessor<float>({0, 0, 1, 0, 0, 1}, "VEC3");
    EXPECT_EQ(errorOf(builder).where(), "/meshes/0/primitives/0/attributes/NORMAL");
}

TEST(GltfAccessor, RefusesPositionsThatAreNotFinite) {
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        GltfBuilder builder = triangle();
        builder.attributes()["POSITION"] =
            builder.addAccessor<float>({0, 0, 0, 1, bad, 0, 0, 1, 0}, "VEC3");
        EXPECT_EQ(errorOf(builder).where(), "/meshes/0/primitives/0/attributes/POSITION");
    }
}

TEST(GltfAccessor, PutsZerosForOtherNumbersThatAreNotFinite) {
    GltfBuilder builder = triangle();
    builder.attributes()["NORMAL"] = builder.addAccessor<float>(
        {0, 0, 1, 0, std::numeric_limits<float>::quiet_NaN(), 1, 0, 0, 1}, "VEC3");
    const Scene scene = load(builder);
    EXPECT_EQ(onlyPrimitive(scene).normals[1], glm::vec3(0, 0, 1));
    EXPECT_TRUE(warned(scene, "/meshes/0/primitives/0/attributes/NORMAL"));
}

TEST(GltfAccessor, KeepsTheGeometryInItsLimit) {
    GltfOptions options;
    options.max_geometry_bytes = 36;
    EXPECT_NO_THROW(load(triangle(), options));
    options.max_geometry_bytes = 35;
    EXPECT_EQ(errorOf(triangle(), options).where(), "/meshes/0/primitives/0");
}

}  // namespace
}  // namespace peeler::test
