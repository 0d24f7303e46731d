// SPDX-License-Identifier: Apache-2.0
// Tests the table for glTF files in formats/README.md, "Supported content".
#include <cmath>
#include <functional>

#include "formats/file/file_statements.h"
#include "formats/gltf/gltf_reader.h"
#include "formats/gltf/material_gltf.h"
#include "formats/splats/splat_files.h"

namespace peeler::test {
namespace {

constexpr const char* kGltfGeometry =
    "all primitives, sparse accessors, skins with any number of joints per vertex; attributes and "
    "morph targets: positions, normals, tangents, `TEXCOORD_0`, `TEXCOORD_1`, `COLOR_0`";
constexpr const char* kGltfScenes =
    "all material properties, samplers, images of any media type; nodes, cameras; extras of nodes "
    "(strings, numbers, booleans); animations of translation, rotation, scale, weights; files "
    "without scenes (all nodes)";
constexpr const char* kGltfExtensions =
    "`EXT_mesh_gpu_instancing`, `EXT_meshopt_compression`, `EXT_texture_webp`, "
    "`KHR_draco_mesh_compression`, `KHR_gaussian_splatting`, `KHR_lights_punctual`, "
    "`KHR_mesh_quantization`, `KHR_meshopt_compression`, `KHR_node_visibility`, "
    "`KHR_texture_basisu`, `KHR_texture_transform`, `KHR_xmp`, `KHR_xmp_json_ld`";
constexpr const char* kGltfOddSplats =
    "morph targets of splats, rotations of splats not of unit length";
constexpr const char* kGltfBrokenSplats =
    "splats of other kernels, colour spaces, projections, sorting methods or with further "
    "extensions, without all attributes, with values out of range";
constexpr const char* kGltfPassedOver =
    "ignored: further `COLOR_n`, `TEXCOORD_n`, attributes `_…`; unknown members; `asset.version` "
    "2.x, generator, copyright";
constexpr const char* kGltfOtherExtensions =
    "other extensions; `EXT_texture_avif`, `MSFT_texture_dds` with a fallback";
constexpr const char* kGltfRequiredExtensions =
    "other extensions if required (unless `--ignore-extension`); `EXT_texture_avif`, "
    "`MSFT_texture_dds` without a fallback";
constexpr const char* kGltfOddNumbers =
    "colours outside 0 to 1, normals or tangents not of unit length, a tangent's `w` other than "
    "±1, weights that do not sum to 1, wrong `normalized`, non-finite numbers except positions";
constexpr const char* kGltfUnused =
    "other attributes, morph targets of missing attributes, primitives that draw nothing, leftover "
    "vertices, empty accessors, views and buffers";
constexpr const char* kGltfOddMaterials =
    "factors out of range, `TEXCOORD_2` or beyond, missing coordinates; images that are missing, "
    "damaged or of other formats, that have a URI and a buffer view, or white space in a data URI";
constexpr const char* kGltfOddNodes =
    "a matrix beside translation, rotation or scale, zero rotations, lights of other types, a "
    "wrong number of weights; a scene that lists a node twice, or a child (shown as a root)";
constexpr const char* kGltfOddAnimations =
    "other animations, `KHR_animation_pointer`, animations of nodes with a matrix or of weights "
    "without targets; a version that is a number, a `.glb` longer than its header says or with "
    "more chunks";
constexpr const char* kGltfBrokenGeometry =
    "non-finite positions, indices beyond the vertices or for primitive restart, accessors and "
    "views beyond their bytes, joints that the skin lacks, a scene that lists a node and its "
    "descendant, nodes with two parents or in a cycle";
constexpr const char* kGltfBrokenFile =
    "cameras and lights out of range, animations with falling times or no keys, "
    "`asset.minVersion` above 2.0, version 1, values of wrong type or range, truncation, buffers "
    "missing or outside the folder";

using Edit = std::function<void(GltfBuilder&)>;

/// A test case: an edit of a triangle with a textured material.
struct Said {
    const char *says, *becomes;
    Edit edit;
};

std::string bytesOfGlb(const GltfBuilder& builder) {
    Json gltf = builder.gltf;
    if (!gltf.contains("buffers")) gltf["buffers"] = {{{"byteLength", builder.bin.size()}}};
    return glb(gltf.dump(), builder.bin);
}

/// Returns an edit that merges these members into the root object (RFC 7396).
Edit merged(const char* json) {
    return [json](GltfBuilder& b) { b.gltf.merge_patch(Json::parse(json)); };
}

/// Returns an edit that merges these members into the material.
Edit material(const char* json) {
    return [json](GltfBuilder& b) { b.gltf["materials"][0].merge_patch(Json::parse(json)); };
}

/// Returns an edit that merges these members into the node.
Edit node(const char* json) {
    return [json](GltfBuilder& b) { b.gltf["nodes"][0].merge_patch(Json::parse(json)); };
}

template <class T>
Edit attribute(const char* name, std::vector<T> values, const char* type,
               const Json& more = Json::object()) {
    return [=](GltfBuilder& b) { b.attributes()[name] = b.addAccessor<T>(values, type, more); };
}

/// Returns an edit that declares an extension and adds it to the material.
Edit materialExtension(const std::string& name, const char* json) {
    return [name, json](GltfBuilder& b) {
        b.gltf["extensionsUsed"].push_back(name);
        b.gltf["materials"][0]["extensions"][name] = Json::parse(json);
    };
}

Edit together(std::vector<Edit> edits) {
    return [edits = std::move(edits)](GltfBuilder& b) {
        for (const Edit& edit : edits)
            edit(b);
    };
}

/// Adds a skin with one joint, the node itself.
void addSkin(GltfBuilder& b) {
    b.attributes()["JOINTS_0"] = b.addAccessor<std::uint8_t>(Bytes(12), "VEC4");
    b.attributes()["WEIGHTS_0"] =
        b.addAccessor<float>({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
    b.gltf["nodes"].push_back(Json::object());
    b.gltf["scenes"][0]["nodes"].push_back(1);
    b.gltf["skins"] = {{{"joints", {1}}}};
    b.gltf["nodes"][0]["skin"] = 0;
}

/// Adds keyframes for the node's translation at 0 and 1 s.
void addAnimation(GltfBuilder& b) {
    const int times = b.addAccessor<float>({0, 1}, "SCALAR");
    const int values = b.addAccessor<float>({0, 0, 0, 1, 0, 0}, "VEC3");
    b.gltf["animations"] = {
        {{"samplers", {{{"input", times}, {"output", values}}}},
         {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}}}};
}

void addTarget(GltfBuilder& b) {
    const int three = b.addAccessor<float>(std::vector<float>(9), "VEC3");
    const int two = b.addAccessor<float>(std::vector<float>(6), "VEC2");
    b.attributes()["COLOR_0"] = three;
    b.primitive()["targets"] = {{{"POSITION", three}, {"COLOR_0", three}, {"TEXCOORD_0", two}}};
    b.gltf["meshes"][0]["weights"] = {0.5};
}

/// An image of one grey pixel. The data is a PNG, but its media type is GIF.
constexpr const char* kGltfDataUriImage =
    R"({"images":[{"uri":"data:image/gif;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptV)"
    R"(AAAACklEQVR4nGNoAAAAggCBd81ytgAAAABJRU5ErkJggg=="}]})";
const std::vector<float> kNineZeros(9);
const std::vector<float> kUnitZ = {0, 0, 1, 0, 0, 1, 0, 0, 1};

std::vector<Said> saidOfVertices() {
    return {
        {kGltfGeometry, "read",
         together(
             {attribute<float>("NORMAL", kUnitZ, "VEC3"),
              attribute<float>("TANGENT", {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}, "VEC4"),
              attribute<std::uint8_t>("COLOR_0", Bytes(12, 255), "VEC4", {{"normalized", true}})})},
        {kGltfPassedOver, "read",
         together({attribute<float>("COLOR_1", kNineZeros, "VEC3"),
                   attribute<float>("_AO", {1, 1, 1}, "SCALAR")})},
        {kGltfUnused, "warned", attribute<float>("COLOR", kNineZeros, "VEC3")},
        {kGltfOddNumbers, "warned",
         attribute<float>("COLOR_0", {2, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC3")},
        {kGltfOddNumbers, "warned", attribute<float>("NORMAL", kNineZeros, "VEC3")},
        {kGltfOddNumbers, "warned",
         attribute<float>("TANGENT", {1, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1}, "VEC4")},
        {kGltfOddNumbers, "warned",
         [](GltfBuilder& b) {
             addSkin(b);
             b.attributes()["WEIGHTS_0"] = b.addAccessor<float>(std::vector<float>(12), "VEC4");
         }},
        {kGltfOddNumbers, "warned", attribute<std::uint8_t>("COLOR_0", Bytes(12), "VEC4")},
        {kGltfExtensions, "read",
         together({merged(R"({"extensionsUsed":["KHR_mesh_quantization"]})"),
                   attribute<std::int8_t>("TEXCOORD_0", {0, 0, 1, 0, 0, 1}, "VEC2")})},
        {kGltfOddNumbers, "warned", attribute<float>("TEXCOORD_0", {0, NAN, 0, 0, 0, 0}, "VEC2")},
        {kGltfBrokenGeometry, "refused",
         attribute<float>("POSITION", {0, 0, 0, 1, 0, 0, 0, INFINITY, 0}, "VEC3")},
        {kGltfGeometry, "read",
         [](GltfBuilder& b) {
             b.primitive()["mode"] = 2;
             b.primitive()["indices"] = b.addAccessor<std::uint8_t>({2, 1, 0}, "SCALAR");
         }},
        {kGltfBrokenGeometry, "refused",
         [](GltfBuilder& b) {
             b.primitive()["indices"] = b.addAccessor<std::uint8_t>({2, 1, 255}, "SCALAR");
         }},
        {kGltfUnused, "warned",
         [](GltfBuilder& b) {
             b.primitive()["indices"] = b.addAccessor<std::uint8_t>({2, 1, 0, 0}, "SCALAR");
         }},
        {kGltfUnused, "warned", [](GltfBuilder& b) { b.attributes().erase("POSITION"); }},
        {kGltfGeometry, "read",
         [](GltfBuilder& b) {
             const int where = b.addView({1}), what = b.addView(toBytes<float>({5, 5, 5}));
             b.gltf["accessors"][0]["sparse"] = {
                 {"count", 1},
                 {"indices", {{"bufferView", where}, {"componentType", 5121}}},
                 {"values", {{"bufferView", what}}}};
         }},
        {kGltfUnused, "warned",
         [](GltfBuilder& b) {
             b.gltf["bufferViews"].push_back({{"buffer", 0}, {"byteLength", 0}});
         }},
        {kGltfBrokenGeometry, "refused",
         [](GltfBuilder& b) { b.gltf["accessors"][0]["count"] = 1000; }},
        {kGltfGeometry, "read", addTarget},
        {kGltfUnused, "warned",
         [](GltfBuilder& b) {
             addTarget(b);
             b.attributes().erase("COLOR_0");
         }},
        {kGltfGeometry, "read", addSkin},
        {kGltfGeometry, "read",
         [](GltfBuilder& b) {
             addSkin(b);
             b.attributes()["JOINTS_1"] = b.attributes()["JOINTS_0"];
             b.attributes()["WEIGHTS_0"] = b.attributes()["WEIGHTS_1"] =
                 b.addAccessor<float>({0.5, 0, 0, 0, 0.5, 0, 0, 0, 0.5, 0, 0, 0}, "VEC4");
         }},
        {kGltfBrokenGeometry, "refused",
         [](GltfBuilder& b) {
             addSkin(b);
             b.attributes()["JOINTS_0"] = b.addAccessor<std::uint8_t>(Bytes(12, 7), "VEC4");
         }},
    };
}

std::vector<Said> saidOfMaterials() {
    return {
        {kGltfScenes, "read",
         material(R"({"normalTexture":{"index":0},"occlusionTexture":{"index":0},
                      "pbrMetallicRoughness":{"metallicRoughnessTexture":{"index":0}},
                      "alphaMode":"MASK","doubleSided":true})")},
        {kGltfScenes, "read",
         together({merged(R"({"samplers":[{"magFilter":9728,"minFilter":9984,"wrapS":33648}],
                              "textures":[{"source":0,"sampler":0}],
                              "extensionsUsed":["KHR_texture_transform"]})"),
                   material(R"({"normalTexture":{"index":0,"extensions":{
                                "KHR_texture_transform":{"offset":[0.5,0.5]}}}})")})},
        {kGltfOddMaterials, "warned", material(R"({"pbrMetallicRoughness":{"metallicFactor":2}})")},
        {kGltfOddMaterials, "warned", materialExtension("KHR_materials_ior", R"({"ior":0.5})")},
        {kGltfOddMaterials, "warned",
         materialExtension("KHR_materials_pbrSpecularGlossiness",
                           R"({"diffuseFactor":[2,1,1,1]})")},
        {"`KHR_materials_` anisotropy, clearcoat, emissive_strength, ior, iridescence, "
         "pbrSpecularGlossiness, sheen, specular, transmission, unlit, variants, volume ([no "
         "refraction](../examples/guide/light.md#glass))",
         "read", materialExtension("KHR_materials_clearcoat", R"({"clearcoatFactor":1})")},
        {kGltfOddMaterials, "warned", material(R"({"emissiveTexture":{"index":0,"texCoord":2}})")},
        {kGltfOddMaterials, "warned", [](GltfBuilder& b) { b.attributes().erase("TEXCOORD_0"); }},
        {kGltfScenes, "read", merged(kGltfDataUriImage)},
        {kGltfOddMaterials, "warned", [](GltfBuilder& b) { b.gltf["images"][0]["uri"] = "a.png"; }},
        {kGltfOddMaterials, "warned", merged(R"({"images":[{"uri":"missing.png"}]})")},
        {kGltfOddMaterials, "warned", merged(R"({"images":[{"uri":"data:,GIF89a"}]})")},
        {kGltfExtensions, "read",
         merged(R"({"textures":[{"extensions":{"EXT_texture_webp":{"source":0}}}],
                    "extensionsUsed":["EXT_texture_webp"]})")},
        {kGltfOtherExtensions, "warned",
         merged(R"({"textures":[{"source":0,"extensions":{"EXT_texture_avif":{"source":0}}}],
                    "extensionsUsed":["EXT_texture_avif"]})")},
        {kGltfRequiredExtensions, "refused",
         [](GltfBuilder& b) {
             b.gltf["textures"] = {{{"extensions", {{"MSFT_texture_dds", {{"source", 0}}}}}}};
         }},
    };
}

std::vector<Said> saidOfNodes() {
    return {
        {kGltfScenes, "read", node(R"({"rotation":[0,0,0.7071,0.7071],"scale":[-1,1,1]})")},
        {kGltfOddNodes, "warned",
         node(R"({"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],"scale":[2,2,2]})")},
        {kGltfOddNodes, "warned", node(R"({"rotation":[0,0,0,0]})")},
        {kGltfBrokenGeometry, "refused", node(R"({"children":[0]})")},
        {kGltfOddNodes, "warned", merged(R"({"scenes":[{"nodes":[0,0]}]})")},
        {kGltfOddNodes, "warned",
         [](GltfBuilder& b) {
             b.gltf["nodes"].push_back({{"children", {0}}});
         }},
        {kGltfBrokenGeometry, "refused",
         merged(R"({"nodes":[{"children":[1]},{}],"scenes":[{"nodes":[0,1]}]})")},
        {kGltfScenes, "read",
         [](GltfBuilder& b) {
             b.gltf.erase("scenes");
             b.gltf.erase("scene");
         }},
        {kGltfScenes, "read",
         together({merged(R"({"cameras":[{"type":"perspective",
                              "perspective":{"yfov":1,"znear":0.1}}]})"),
                   node(R"({"camera":0})")})},
        {kGltfBrokenFile, "refused",
         merged(R"({"cameras":[{"type":"perspective","perspective":{"yfov":4,"znear":0.1}}]})")},
        {kGltfExtensions, "read",
         together({merged(R"({"extensionsUsed":["KHR_lights_punctual"],"extensions":
                              {"KHR_lights_punctual":{"lights":[{"type":"point"}]}}})"),
                   node(R"({"extensions":{"KHR_lights_punctual":{"light":0}}})")})},
        {kGltfOddNodes, "warned", merged(R"({"extensionsUsed":["KHR_lights_punctual"],"extensions":
                    {"KHR_lights_punctual":{"lights":[{"type":"area"}]}}})")},
        {kGltfBrokenFile, "refused",
         merged(R"({"extensionsUsed":["KHR_lights_punctual"],"extensions":
                    {"KHR_lights_punctual":{"lights":[{"type":"point","intensity":-1}]}}})")},
        {kGltfOddNodes, "warned", together({addTarget, node(R"({"weights":[1,2]})")})},
        {kGltfScenes, "read", node(R"({"extras":{"extensions":{"X_mine":{}}}})")},
    };
}

std::vector<Said> saidOfAnimations() {
    return {
        {kGltfScenes, "read", addAnimation},
        {kGltfOddAnimations, "warned",
         [](GltfBuilder& b) {
             addAnimation(b);
             b.gltf["animations"][0]["channels"][0]["target"]["path"] = "visible";
         }},
        {kGltfOddAnimations, "warned",
         [](GltfBuilder& b) {
             addAnimation(b);
             b.gltf["animations"][0]["channels"][0]["target"] = {
                 {"path", "pointer"},
                 {"extensions",
                  {{"KHR_animation_pointer", {{"pointer", "/nodes/0/translation"}}}}}};
         }},
        {kGltfOddAnimations, "warned",
         together({addAnimation, node(R"({"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]})")})},
        {kGltfBrokenFile, "refused",
         [](GltfBuilder& b) {
             addAnimation(b);
             b.gltf["animations"][0]["samplers"][0]["input"] =
                 b.addAccessor<float>({1, 0}, "SCALAR");
         }},
    };
}

std::vector<Said> saidOfFiles() {
    return {
        {kGltfPassedOver, "read", merged(R"({"asset":{"version":"2.1","copyright":"me"}})")},
        {kGltfOddAnimations, "warned", merged(R"({"asset":{"version":2.0}})")},
        {kGltfBrokenFile, "refused", merged(R"({"asset":{"minVersion":"2.1"}})")},
        {kGltfExtensions, "read",
         merged(R"({"extensionsUsed":["KHR_xmp"],"extensionsRequired":["KHR_xmp"]})")},
        {kGltfExtensions, "read", [](GltfBuilder& b) { b = splatGltf({knownSplat()}, 1); }},
        {kGltfOddSplats, "warned",
         [](GltfBuilder& b) {
             b = splatGltf({knownSplat()}, 0);
             b.attributes()[splatName("ROTATION")] = b.addAccessor<float>({0, 0, 0, 2}, "VEC4");
         }},
        {kGltfBrokenSplats, "refused",
         [](GltfBuilder& b) {
             b = splatGltf({knownSplat()}, 0);
             splatExtension(b)["kernel"] = "box";
         }},
        {kGltfOtherExtensions, "warned", merged(R"({"extensionsUsed":["X_unheard_of"]})")},
        {kGltfOtherExtensions, "warned",
         material(R"({"extensions":{"KHR_materials_dispersion":{"dispersion":1}}})")},
        {kGltfRequiredExtensions, "refused",
         merged(R"({"extensionsUsed":["X_unheard_of"],"extensionsRequired":["X_unheard_of"]})")},
        {kGltfOddMaterials, "warned",
         [](GltfBuilder& b) {
             Json image = Json::parse(kGltfDataUriImage)["images"][0];
             b.gltf["images"][0] = {{"uri", image["uri"].get<std::string>().insert(40, "\r\n")}};
         }},
        {kGltfPassedOver, "read", merged(R"({"scene2":{},"x":[1]})")},
        {kGltfBrokenFile, "refused", node(R"({"mesh":"0"})")},
    };
}

TEST(Statements, OfAGltf) {
    std::vector<Statement> statements;
    for (const auto& part :
         {saidOfVertices(), saidOfMaterials(), saidOfNodes(), saidOfAnimations(), saidOfFiles()})
        for (const Said& said : part) {
            GltfBuilder builder = withMaterial(R"({"emissiveTexture":{"index":0}})", 1);
            said.edit(builder);
            statements.push_back({said.says, said.becomes, "a.glb", bytesOfGlb(builder)});
        }
    const std::string whole = bytesOfGlb(triangle());
    statements.push_back({kGltfOddAnimations, "warned", "a.glb", whole + "more"});
    statements.push_back({kGltfBrokenFile, "refused", "a.glb", whole.substr(0, whole.size() - 4)});
    expectStatements("glTF", statements, [](const std::filesystem::path& file, bool strict) {
        GltfOptions options;
        options.strict = strict;
        return readGltf(file, options).warnings;
    });
}

}  // namespace
}  // namespace peeler::test
