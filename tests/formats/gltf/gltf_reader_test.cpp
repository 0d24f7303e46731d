// SPDX-License-Identifier: Apache-2.0
// Tests nodes, scenes, cameras, meshes and extensions, and every kind of structural damage with the
// JSON pointer in the error.
#include "formats/gltf/gltf_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "core/scene/material.h"
#include "core/scene/posed_scene.h"
#include "formats/gltf/gltf_builder.h"
#include "formats/gltf/material_gltf.h"

namespace peeler::test {
namespace {

GltfBuilder empty(const std::string& members) {
    GltfBuilder builder;
    builder.gltf.update(Json::parse("{" + members + "}"));
    return builder;
}

TEST(GltfNodes, ComposeTranslationRotationScale) {
    // Scales by (2, 3, 4), then rotates by a quarter turn about z. The rounded quaternion is not of
    // unit length.
    const Scene scene = load(empty(R"("nodes":[{"translation":[10,20,30],"scale":[2,3,4],
        "rotation":[0,0,0.7071,0.7071]}])"));
    const glm::dmat4& local = scene.nodes.at(0).local;
    const glm::dvec4 expected[] = {{0, 2, 0, 0}, {-3, 0, 0, 0}, {0, 0, 4, 0}, {10, 20, 30, 1}};
    for (int column = 0; column < 4; ++column)
        for (int row = 0; row < 4; ++row)
            EXPECT_NEAR(local[column][row], expected[column][row], 1e-12) << column << row;
}

TEST(GltfNodes, TakeMatricesInDoublePrecision) {
    const Scene scene = load(
        empty(R"("nodes":[{"matrix":[1,2,3,0, 4,5,6,0, 7,8,9,0, 0.123456789012345,11,12,1]}])"));
    EXPECT_EQ(scene.nodes[0].local[3][0], 0.123456789012345);
    EXPECT_EQ(scene.nodes[0].local[1], glm::dvec4(4, 5, 6, 0));
}

TEST(GltfNodes, IgnoreARotationOfZeros) {
    const Scene scene = load(empty(R"("nodes":[{"rotation":[0,0,0,0]}])"));
    EXPECT_EQ(scene.nodes[0].local, glm::dmat4(1));
    EXPECT_TRUE(warned(scene, "/nodes/0"));
}

TEST(GltfNodes, NestTenThousandLevels) {
    GltfBuilder builder;
    const int depth = 10000;
    for (int i = 0; i < depth; ++i)
        builder.gltf["nodes"].push_back(i + 1 < depth ? Json{{"children", {i + 1}}}
                                                      : Json::object());
    const Scene scene = load(builder);
    EXPECT_EQ(scene.scenes.at(0).roots, std::vector<int>{0});
    EXPECT_TRUE(PosedScene(scene, 0).meshes().empty());
    // One more node above the first exceeds the maximum depth.
    builder.gltf["nodes"].push_back({{"children", {0}}});
    EXPECT_NE(std::string(errorOf(builder).what()).find("deeper than 10000"), std::string::npos);
    // The nodes form a ring.
    builder.gltf["nodes"][depth - 1]["children"] = {depth};
    EXPECT_NE(std::string(errorOf(builder).what()).find("ancestor"), std::string::npos);
}

TEST(GltfScenes, AreListedWithTheDefault) {
    const Scene scene = load(empty(R"("nodes":[{},{}],"scene":1,
        "scenes":[{"name":"a","nodes":[0]},{"name":"b","nodes":[1,0]}])"));
    ASSERT_EQ(scene.scenes.size(), 2U);
    EXPECT_EQ(scene.scenes[1].name, "b");
    EXPECT_EQ(scene.scenes[1].roots, (std::vector<int>{1, 0}));
    EXPECT_EQ(scene.default_scene, 1);
}

TEST(GltfScenes, AreAllRootsWhereTheFileHasNone) {
    const Scene scene = load(empty(R"("nodes":[{"children":[1]},{},{}])"));
    ASSERT_EQ(scene.scenes.size(), 1U);
    EXPECT_EQ(scene.scenes[0].roots, (std::vector<int>{0, 2}));
    EXPECT_EQ(load(empty("")).scenes.size(), 1U);
}

TEST(GltfCameras, AreReadInBothKinds) {
    const Scene scene = load(empty(R"("nodes":[{"camera":1}],"cameras":[
        {"name":"p","type":"perspective","perspective":{"yfov":0.5,"znear":0.25,"zfar":8,"aspectRatio":1.5}},
        {"type":"perspective","perspective":{"yfov":1,"znear":1}},
        {"type":"orthographic","orthographic":{"xmag":2,"ymag":3,"znear":0,"zfar":9}}])"));
    ASSERT_EQ(scene.cameras.size(), 3U);
    EXPECT_EQ(scene.cameras[0].name, "p");
    EXPECT_EQ(scene.cameras[0].yfov, 0.5);
    EXPECT_EQ(scene.cameras[0].zfar, 8);
    EXPECT_EQ(scene.cameras[0].aspect_ratio, 1.5);
    EXPECT_FALSE(scene.cameras[1].zfar);
    EXPECT_FALSE(scene.cameras[1].aspect_ratio);
    EXPECT_FALSE(scene.cameras[2].perspective);
    EXPECT_EQ(scene.cameras[2].ymag, 3);
    EXPECT_EQ(scene.cameras[2].znear, 0);
    EXPECT_EQ(scene.nodes[0].camera, 1);
}

TEST(GltfMeshes, HaveAllSevenTopologies) {
    for (int mode = 0; mode < 7; ++mode) {
        GltfBuilder builder = triangle();
        builder.primitive()["mode"] = mode;
        const Scene scene = load(builder);
        ASSERT_EQ(scene.meshes[0].primitives.size(), 1U);
        EXPECT_EQ(static_cast<int>(scene.meshes[0].primitives[0].topology), mode);
    }
    EXPECT_EQ(load(triangle()).meshes[0].primitives[0].topology, Topology::kTriangles);
}

TEST(GltfMeshes, LoseIncompletePrimitives) {
    // Two of the three vertices make a line; one is left over.
    GltfBuilder builder = triangle();
    builder.primitive()["mode"] = 1;
    Scene scene = load(builder);
    EXPECT_EQ(scene.meshes[0].primitives.at(0).positions.size(), 2U);
    EXPECT_TRUE(warned(scene, "leftover vertices"));

    builder = triangle();
    builder.primitive()["indices"] = builder.addAccessor<std::uint8_t>({0, 1, 2, 0, 1}, "SCALAR");
    EXPECT_EQ(load(builder).meshes[0].primitives.at(0).indices.size(), 3U);

    for (const int mode : {4, 5, 6}) {
        builder.primitive()["mode"] = mode;
        builder.primitive()["indices"] = builder.addAccessor<std::uint8_t>({0, 1}, "SCALAR");
        scene = load(builder);
        EXPECT_TRUE(scene.meshes[0].primitives.empty());
        EXPECT_TRUE(warned(scene, "too few vertices"));
    }
}

TEST(GltfMeshes, SkipPrimitivesWithoutPositions) {
    GltfBuilder builder = triangle();
    builder.gltf["meshes"][0]["primitives"].push_back({{"attributes", Json::object()}});
    const Scene scene = load(builder);
    EXPECT_EQ(scene.meshes[0].primitives.size(), 1U);
    EXPECT_TRUE(warned(scene, "/meshes/0/primitives/1"));
}

TEST(GltfMeshes, KeepOnlyTheStretchOfVerticesThatTheyIndex) {
    GltfBuilder builder = triangle();
    std::vector<float> many(3000);
    for (std::size_t i = 0; i < many.size(); ++i)
        many[i] = static_cast<float>(i);
    builder.attributes()["POSITION"] = builder.addAccessor<float>(many, "VEC3");
    builder.primitive()["indices"] =
        builder.addAccessor<std::uint16_t>({502, 500, 501, 500, 503, 502}, "SCALAR");
    const Primitive primitive = load(builder).meshes[0].primitives.at(0);
    ASSERT_EQ(primitive.positions.size(), 4U);
    EXPECT_EQ(primitive.positions[0], glm::vec3(1500, 1501, 1502));
    EXPECT_EQ(primitive.indices, (std::vector<std::uint32_t>{2, 0, 1, 0, 3, 2}));
}

TEST(GltfExtensions, WarnOnceEachWhereOptional) {
    GltfBuilder builder = triangle();
    builder.gltf["extensionsUsed"] = {"KHR_materials_dispersion", "KHR_materials_dispersion",
                                      "X_unheard_of", "KHR_materials_unlit"};
    builder.gltf["extensions"] = {{"KHR_materials_dispersion", {{"variants", "nonsense"}}}};
    const Scene scene = load(builder);
    EXPECT_EQ(scene.warnings.size(), 2U);
    EXPECT_TRUE(warned(scene, "KHR_materials_dispersion"));
    EXPECT_TRUE(warned(scene, "X_unheard_of"));
    EXPECT_EQ(scene.extensions_used.size(), 4U);
    for (const Text& warning : scene.warnings)
        EXPECT_EQ(warning.str().back(), '.') << warning;
}

TEST(GltfExtensions, AreRefusedWhereRequiredAndUnknown) {
    GltfBuilder builder = triangle();
    builder.gltf["extensionsRequired"] = {"KHR_mesh_quantization", "MSFT_texture_dds"};
    const Error error = errorOf(builder);
    EXPECT_EQ(error.where(), "/extensionsRequired/1");
    EXPECT_NE(std::string(error.what()).find("MSFT_texture_dds"), std::string::npos);
    EXPECT_NE(error.hint().find("`ignored_extensions` MSFT_texture_dds"), std::string::npos);
}

TEST(GltfExtensions, AreLeftOutWhereTheyAreIgnored) {
    GltfBuilder builder = triangle();
    builder.gltf["extensionsUsed"] = {"MSFT_texture_dds", "X_unheard_of"};
    builder.gltf["extensionsRequired"] = {"MSFT_texture_dds", "X_unheard_of"};
    GltfOptions options;
    options.ignored_extensions = {"X_unheard_of", "MSFT_texture_dds"};
    const Scene scene = load(builder, options);
    EXPECT_EQ(scene.warnings.size(), 2U);
    EXPECT_TRUE(warned(scene, "X_unheard_of, which the file requires, is ignored"));
    options.ignored_extensions.pop_back();
    EXPECT_EQ(errorOf(builder, options).where(), "/extensionsRequired/0");
}

TEST(GltfExtensions, AreSortedAndTheSupportedOnesMayBeRequired) {
    const auto& all = gltfExtensions();
    EXPECT_TRUE(std::is_sorted(all.begin(), all.end(), [](const auto& a, const auto& b) {
        return std::string(a.name) < b.name;
    }));
    ASSERT_FALSE(supportedGltfExtensions().empty());
    for (const GltfExtension& extension : supportedGltfExtensions()) {
        GltfBuilder builder = triangle();
        builder.gltf["extensionsRequired"] = {extension.name};
        EXPECT_NO_THROW(load(builder)) << extension.name;
    }
}

TEST(GltfReader, KeepsWhoMadeTheFile) {
    const Scene scene = load(
        empty(R"("asset":{"version":"2.1","minVersion":"2.0","generator":"g","copyright":"c"})"));
    EXPECT_EQ(scene.generator, "g");
    EXPECT_EQ(scene.copyright, "c");
}

TEST(GltfReader, TakesWholeNumbersWrittenAsFractions) {
    GltfBuilder builder = triangle();
    builder.gltf["accessors"][0]["count"] = 3.0;
    builder.primitive()["mode"] = 4.0;
    builder.gltf["nodes"][0]["mesh"] = 0.0;
    const Scene scene = load(builder);
    EXPECT_EQ(scene.nodes[0].mesh, 0);
    EXPECT_EQ(scene.meshes[0].primitives[0].positions.size(), 3U);
}

/// Expects one warning with these words. With `strict`, expects an error; if `where` is not empty,
/// `where` is the error's location.
void expectOneWarning(const GltfBuilder& builder, const std::string& words,
                      const std::string& where) {
    const Scene scene = load(builder);
    ASSERT_EQ(scene.warnings.size(), 1U);
    EXPECT_TRUE(warned(scene, words)) << scene.warnings[0];
    GltfOptions strict;
    strict.strict = true;
    const Error error = errorOf(builder, strict);
    EXPECT_TRUE(where.empty() || error.where() == where) << error.where();
}

TEST(GltfReader, TakesVersionsThatAreNumbers) {
    for (const Json& version : {Json(2.0), Json(2), Json(2.1)})
        expectOneWarning(empty(R"("asset":{"version":)" + version.dump() + "}"), "(TYPE_MISMATCH)",
                         "/asset/version");
    expectOneWarning(empty(R"("asset":{"version":"2.0","minVersion":2.0})"), "(TYPE_MISMATCH)",
                     "/asset/minVersion");
    EXPECT_EQ(errorOf(empty(R"("asset":{"version":2.1,"minVersion":2.1})")).where(),
              "/asset/minVersion");
}

TEST(GltfReader, TakesNodesBelowTheRootAsRoots) {
    // UniGLTF writes scenes whose root is the child of a node outside all scenes.
    const char* below = R"("nodes":[{"children":[1,2],"translation":[9,9,9]},
                                    {"name":"model","children":[3],"translation":[1,0,0]},{},{}],
                           "scenes":[{"nodes":[1]}])";
    expectOneWarning(empty(below), "(SCENE_NON_ROOT_NODE)", "/scenes/0/nodes/0");
    const Scene scene = load(empty(below));
    EXPECT_EQ(scene.scenes[0].roots, std::vector<int>{1});
    EXPECT_EQ(scene.nodes[0].children, std::vector<int>{2});
    EXPECT_EQ(scene.nodes[1].children, std::vector<int>{3});
    EXPECT_EQ(idNames(scene).parents[1], 0U);

    // A parent in another scene keeps its child.
    const Scene two = load(empty(
        R"("nodes":[{"children":[1]},{"children":[2]},{}],"scenes":[{"nodes":[0]},{"nodes":[2]}])"));
    EXPECT_EQ(two.nodes[1].children, std::vector<int>{2});
    EXPECT_EQ(two.scenes[1].roots, std::vector<int>{2});
    EXPECT_EQ(two.warnings.size(), 1U);
}

TEST(GltfReader, ShowsNodesOnceThatAreListedTwice) {
    const char* twice = R"("nodes":[{},{}],"scenes":[{"nodes":[1,0,1]}])";
    expectOneWarning(empty(twice), "(DUPLICATE_ELEMENTS)", "/scenes/0/nodes/2");
    EXPECT_EQ(load(empty(twice)).scenes[0].roots, (std::vector<int>{1, 0}));
}

TEST(GltfReader, TakesDeepScenesWhoseNodesAreAllListed) {
    // All 9,000 roots are at level 9,000. The reader must cache results per node, because walking
    // up from every root would take too long.
    constexpr std::size_t kDepth = 9000;
    Json nodes = Json::array(), roots = Json::array();
    for (std::size_t i = 0; i < kDepth; ++i)
        nodes.push_back({{"children", {i + 1}}});
    nodes.push_back(Json::object());
    for (std::size_t i = 0; i < kDepth; ++i) {
        nodes.back()["children"].push_back(nodes.size() + i);
        roots.push_back(nodes.size() + i);
    }
    for (std::size_t i = 0; i < kDepth; ++i)
        nodes.push_back(Json::object());
    GltfBuilder builder = empty("");
    builder.gltf["nodes"] = nodes;
    builder.gltf["scenes"] = {{{"nodes", roots}}};
    EXPECT_EQ(load(builder).scenes[0].roots.size(), kDepth);
}

TEST(GltfReader, TakesViewsThatAreEmpty) {
    GltfBuilder builder = triangle();
    builder.gltf["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", 36}, {"byteLength", 0}});
    expectOneWarning(builder, "/bufferViews/1 is 0 (VALUE_NOT_IN_RANGE)", "/bufferViews/1");
    builder.gltf["accessors"][0]["bufferView"] = 1;
    EXPECT_EQ(errorOf(builder).where(), "/accessors/0");
    builder = triangle();
    builder.gltf["buffers"] = {{{"byteLength", 36}}, {{"byteLength", 0}}};
    expectOneWarning(builder, "/buffers/1 is 0 (VALUE_NOT_IN_RANGE)", "/buffers/1");
}

TEST(GltfReader, WarnsOfExtensionsThatAreNotDeclared) {
    GltfBuilder builder = withMaterial(R"({"extensions":{"KHR_materials_sheen":{},
        "KHR_materials_dispersion":{"dispersion":1}},
        "extras":{"extensions":{"mine":{}}}})");
    expectOneWarning(builder, "The extension KHR_materials_dispersion is ignored", "");
    builder.gltf["extensionsUsed"] = {"KHR_materials_dispersion"};
    EXPECT_EQ(load(builder).warnings.size(), 1U);
}

TEST(GltfReader, WarnsOfNodesWithTwoPlaces) {
    const char* both = R"("nodes":[{"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,7,0,0,1],
                                    "translation":[1,2,3]}])";
    expectOneWarning(empty(both), "(NODE_MATRIX_TRS)", "/nodes/0");
    EXPECT_EQ(load(empty(both)).nodes[0].local[3].x, 7);
}

TEST(GltfReader, LimitsTheNumberOfWarnings) {
    GltfBuilder builder = triangle();
    for (int i = 0; i < 1000; ++i)
        builder.gltf["meshes"][0]["primitives"].push_back({{"attributes", Json::object()}});
    EXPECT_LE(load(builder).warnings.size(), 101U);
}

/// Damage::json has the members of the root object other than "asset".
class GltfDamage : public testing::TestWithParam<Damage> {};

TEST_P(GltfDamage, IsRefusedWithItsPointer) {
    const Error error = errorOf(empty(GetParam().json));
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_EQ(error.where(), GetParam().where) << error.what();
    EXPECT_FALSE(error.hint().empty());
}

INSTANTIATE_TEST_SUITE_P(
    Indices, GltfDamage,
    testing::Values(
        Damage{"Scene", R"("scene":0)", "/scene"},
        Damage{"SceneNode", R"("scenes":[{"nodes":[0]}])", "/scenes/0/nodes/0"},
        Damage{"SceneNodeNegative", R"("nodes":[{}],"scenes":[{"nodes":[-1]}])",
               "/scenes/0/nodes/0"},
        Damage{"SceneNodeHuge", R"("nodes":[{}],"scenes":[{"nodes":[4294967296]}])",
               "/scenes/0/nodes/0"},
        Damage{"Child", R"("nodes":[{"children":[1]}])", "/nodes/0/children/0"},
        Damage{"NodeMesh", R"("nodes":[{"mesh":0}])", "/nodes/0/mesh"},
        Damage{"NodeCamera", R"("nodes":[{"camera":0}])", "/nodes/0/camera"},
        Damage{"NodeSkin", R"("nodes":[{"skin":0}])", "/nodes/0/skin"},
        Damage{"Attribute", R"("meshes":[{"primitives":[{"attributes":{"_A/B~":0}}]}])",
               "/meshes/0/primitives/0/attributes/_A~1B~0"},
        Damage{"PrimitiveIndices", R"("meshes":[{"primitives":[{"attributes":{},"indices":0}]}])",
               "/meshes/0/primitives/0/indices"},
        Damage{"PrimitiveMaterial", R"("meshes":[{"primitives":[{"attributes":{},"material":0}]}])",
               "/meshes/0/primitives/0/material"},
        Damage{"Target",
               R"("meshes":[{"primitives":[{"attributes":{},"targets":[{"POSITION":0}]}]}])",
               "/meshes/0/primitives/0/targets/0/POSITION"},
        Damage{"AccessorView",
               R"("accessors":[{"bufferView":0,"componentType":5126,"count":1,"type":"VEC3"}])",
               "/accessors/0/bufferView"},
        Damage{"ViewBuffer", R"("bufferViews":[{"buffer":0,"byteLength":1}])",
               "/bufferViews/0/buffer"},
        Damage{"TextureSource", R"("textures":[{"source":0}])", "/textures/0/source"},
        Damage{"TextureSampler", R"("textures":[{"sampler":0}])", "/textures/0/sampler"},
        Damage{"TextureWebp", R"("textures":[{"extensions":{"EXT_texture_webp":{"source":3}}}])",
               "/textures/0/extensions/EXT_texture_webp/source"},
        Damage{"TextureKtx2", R"("textures":[{"extensions":{"KHR_texture_basisu":{"source":3}}}])",
               "/textures/0/extensions/KHR_texture_basisu/source"},
        Damage{"ImageView", R"("images":[{"bufferView":0}])", "/images/0/bufferView"},
        Damage{"MaterialTexture",
               R"("materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}])",
               "/materials/0/pbrMetallicRoughness/baseColorTexture/index"}),
    [](const auto& test) { return std::string(test.param.name); });

INSTANTIATE_TEST_SUITE_P(
    Types, GltfDamage,
    testing::Values(
        Damage{"NodesObject", R"("nodes":{})", "/nodes"},
        Damage{"NodeNull", R"("nodes":[null])", "/nodes/0"},
        Damage{"IndexString", R"("nodes":[{"mesh":"0"}])", "/nodes/0/mesh"},
        Damage{"MatrixShort", R"("nodes":[{"matrix":[1,2,3]}])", "/nodes/0/matrix"},
        Damage{"TranslationText", R"("nodes":[{"translation":[1,2,"3"]}])",
               "/nodes/0/translation/2"},
        Damage{"ScaleBeyondFloat", R"("nodes":[{"scale":[1,1e39,1]}])", "/nodes/0/scale/1"},
        Damage{"AttributesMissing", R"("meshes":[{"primitives":[{}]}])", "/meshes/0/primitives/0"},
        Damage{"PrimitivesMissing", R"("meshes":[{}])", "/meshes/0"},
        Damage{"Mode", R"("meshes":[{"primitives":[{"attributes":{},"mode":7}]}])",
               "/meshes/0/primitives/0/mode"},
        Damage{"AlphaMode", R"("materials":[{"alphaMode":"GLASS"}])", "/materials/0/alphaMode"},
        Damage{"DoubleSided", R"("materials":[{"doubleSided":1}])", "/materials/0/doubleSided"},
        Damage{"Wrap", R"("samplers":[{"wrapS":1}])", "/samplers/0/wrapS"},
        Damage{
            "TransformOffset",
            R"("images":[{}],"textures":[{"source":0}],"materials":[{"emissiveTexture":{"index":0,
                 "extensions":{"KHR_texture_transform":{"offset":[1]}}}}])",
            "/materials/0/emissiveTexture/extensions/KHR_texture_transform/offset"},
        Damage{"BufferLengthMissing", R"("buffers":[{}])", "/buffers/0"},
        Damage{"ExtensionsArray", R"("extensions":[])", "/extensions"},
        Damage{"UsedNumber", R"("extensionsUsed":[1])", "/extensionsUsed/0"},
        Damage{"RequiredNumber", R"("extensionsRequired":[1])", "/extensionsRequired/0"}),
    [](const auto& test) { return std::string(test.param.name); });

INSTANTIATE_TEST_SUITE_P(
    Rules, GltfDamage,
    testing::Values(
        Damage{"VersionMissing", R"("asset":{})", "/asset"},
        Damage{"Version1", R"("asset":{"version":"1.0"})", "/asset/version"},
        Damage{"Version20", R"("asset":{"version":"20"})", "/asset/version"},
        Damage{"VersionNumber1", R"("asset":{"version":1.0})", "/asset/version"},
        Damage{"VersionList", R"("asset":{"version":[2]})", "/asset/version"},
        Damage{"MinVersion", R"("asset":{"version":"2.1","minVersion":"2.1"})",
               "/asset/minVersion"},
        Damage{"OwnChild", R"("nodes":[{"children":[0]}])", "/nodes/0"},
        Damage{"Ring", R"("nodes":[{},{"children":[2]},{"children":[1]}])", "/nodes/1"},
        Damage{"TwoParents", R"("nodes":[{"children":[2]},{"children":[2]},{}])",
               "/nodes/1/children/0"},
        Damage{"ChildTwice", R"("nodes":[{"children":[1,1]},{}])", "/nodes/0/children/1"},
        Damage{"SceneOfAChild", R"("nodes":[{"children":[1]},{}],"scenes":[{"nodes":[0,1]}])",
               "/scenes/0/nodes/1"},
        Damage{"SceneOfAGrandchild",
               R"("nodes":[{"children":[1]},{"children":[2]},{}],"scenes":[{"nodes":[2,0]}])",
               "/scenes/0/nodes/0"},
        Damage{"CameraWithoutLens", R"("cameras":[{"type":"perspective"}])", "/cameras/0"},
        Damage{"CameraKind", R"("cameras":[{"type":"fisheye"}])", "/cameras/0/type"},
        Damage{"YfovZero",
               R"("cameras":[{"type":"perspective","perspective":{"yfov":0,"znear":1}}])",
               "/cameras/0/perspective/yfov"},
        Damage{"YfovPi", R"("cameras":[{"type":"perspective",
                 "perspective":{"yfov":3.14159265358979324,"znear":1}}])",
               "/cameras/0/perspective/yfov"},
        Damage{"ZnearZero",
               R"("cameras":[{"type":"perspective","perspective":{"yfov":1,"znear":0}}])",
               "/cameras/0/perspective/znear"},
        Damage{"ZfarNear",
               R"("cameras":[{"type":"perspective","perspective":{"yfov":1,"znear":1,"zfar":1}}])",
               "/cameras/0/perspective/zfar"},
        Damage{"ZfarZero",
               R"("cameras":[{"type":"perspective","perspective":{"yfov":1,"znear":1,"zfar":0}}])",
               "/cameras/0/perspective/zfar"},
        Damage{"AspectNegative", R"("cameras":[{"type":"perspective",
                 "perspective":{"yfov":1,"znear":1,"aspectRatio":-1}}])",
               "/cameras/0/perspective/aspectRatio"},
        Damage{"XmagZero", R"("cameras":[{"type":"orthographic",
                 "orthographic":{"xmag":0,"ymag":1,"znear":0,"zfar":1}}])",
               "/cameras/0/orthographic/xmag"},
        Damage{"OrthographicZnear", R"("cameras":[{"type":"orthographic",
                 "orthographic":{"xmag":1,"ymag":1,"znear":-1,"zfar":1}}])",
               "/cameras/0/orthographic/znear"},
        Damage{"OrthographicZfar", R"("cameras":[{"type":"orthographic",
                 "orthographic":{"xmag":1,"ymag":1,"znear":2,"zfar":1}}])",
               "/cameras/0/orthographic/zfar"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(GltfDamage, BuffersWithoutDataAreNoticedWhereUsed) {
    GltfBuilder builder = triangle();
    builder.gltf["buffers"] = {{{"byteLength", 36}}, {{"byteLength", 36}}};
    EXPECT_NO_THROW(load(builder));
    builder.gltf["bufferViews"][0]["buffer"] = 1;
    EXPECT_EQ(errorOf(builder).where(), "/bufferViews/0");
}

}  // namespace
}  // namespace peeler::test
