// SPDX-License-Identifier: Apache-2.0
// Handling of every statement of a glTF file (formats/README.md).
#include <cmath>
#include <functional>

#include "formats/file/file_statements.h"
#include "formats/gltf/gltf_reader.h"
#include "formats/gltf/material_gltf.h"

namespace peeler::test {
namespace {

using Edit = std::function<void(GltfBuilder&)>;

/// A statement, as an addition to a triangle with a textured material.
struct Said {
    const char *says, *becomes;
    Edit edit;
};

std::string bytesOfGlb(const GltfBuilder& builder) {
    Json gltf = builder.gltf;
    if (!gltf.contains("buffers")) gltf["buffers"] = {{{"byteLength", builder.bin.size()}}};
    return glb(gltf.dump(), builder.bin);
}

/// Adds members to the root, or to existing ones of the same names.
Edit merged(const char* json) {
    return [json](GltfBuilder& b) { b.gltf.merge_patch(Json::parse(json)); };
}

/// Changes members of the material.
Edit material(const char* json) {
    return [json](GltfBuilder& b) { b.gltf["materials"][0].merge_patch(Json::parse(json)); };
}

/// Changes members of the node.
Edit node(const char* json) {
    return [json](GltfBuilder& b) { b.gltf["nodes"][0].merge_patch(Json::parse(json)); };
}

template <class T>
Edit attribute(const char* name, std::vector<T> values, const char* type,
               const Json& more = Json::object()) {
    return [=](GltfBuilder& b) { b.attributes()[name] = b.addAccessor<T>(values, type, more); };
}

/// Adds an extension to the material, and declares it.
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

/// Adds a skin of one joint, the node itself.
void addSkin(GltfBuilder& b) {
    b.attributes()["JOINTS_0"] = b.addAccessor<std::uint8_t>(Bytes(12), "VEC4");
    b.attributes()["WEIGHTS_0"] =
        b.addAccessor<float>({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
    b.gltf["nodes"].push_back(Json::object());
    b.gltf["scenes"][0]["nodes"].push_back(1);
    b.gltf["skins"] = {{{"joints", {1}}}};
    b.gltf["nodes"][0]["skin"] = 0;
}

/// Adds keys of the node's translation at 0 and 1 s.
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

/// A grey pixel; the data is a PNG.
constexpr const char* kDataUriImage =
    R"({"images":[{"uri":"data:image/gif;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptV)"
    R"(AAAACklEQVR4nGNoAAAAggCBd81ytgAAAABJRU5ErkJggg=="}]})";
const std::vector<float> kNineZeros(9);
const std::vector<float> kUnitZ = {0, 0, 1, 0, 0, 1, 0, 0, 1};

std::vector<Said> saidOfVertices() {
    return {
        {"positions, normals, tangents, `TEXCOORD_0` and `_1`, `COLOR_0`", "read",
         together(
             {attribute<float>("NORMAL", kUnitZ, "VEC3"),
              attribute<float>("TANGENT", {1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}, "VEC4"),
              attribute<std::uint8_t>("COLOR_0", Bytes(12, 255), "VEC4", {{"normalized", true}})})},
        {"`COLOR_n` and `TEXCOORD_n` beyond these, attributes whose names begin with `_`", "read",
         together({attribute<float>("COLOR_1", kNineZeros, "VEC3"),
                   attribute<float>("_AO", {1, 1, 1}, "SCALAR")})},
        {"attributes of other names", "warned", attribute<float>("COLOR", kNineZeros, "VEC3")},
        {"colours outside 0 to 1", "warned",
         attribute<float>("COLOR_0", {2, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC3")},
        {"normals and tangents that are not of unit length, and a `w` that is no sign", "warned",
         attribute<float>("NORMAL", kNineZeros, "VEC3")},
        {"normals and tangents that are not of unit length, and a `w` that is no sign", "warned",
         attribute<float>("TANGENT", {1, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1}, "VEC4")},
        {"weights that do not add up to 1", "warned",
         [](GltfBuilder& b) {
             addSkin(b);
             b.attributes()["WEIGHTS_0"] = b.addAccessor<float>(std::vector<float>(12), "VEC4");
         }},
        {"integers without `normalized` where they must have it, or with it where they must not",
         "warned", attribute<std::uint8_t>("COLOR_0", Bytes(12), "VEC4")},
        {"`KHR_mesh_quantization`", "read",
         together({merged(R"({"extensionsUsed":["KHR_mesh_quantization"]})"),
                   attribute<std::int8_t>("TEXCOORD_0", {0, 0, 1, 0, 0, 1}, "VEC2")})},
        {"numbers that are not finite, in attributes but positions", "warned",
         attribute<float>("TEXCOORD_0", {0, NAN, 0, 0, 0, 0}, "VEC2")},
        {"positions that are not finite", "refused",
         attribute<float>("POSITION", {0, 0, 0, 1, 0, 0, 0, INFINITY, 0}, "VEC3")},
        {"points, lines, loops, strips, triangles, fans; indices", "read",
         [](GltfBuilder& b) {
             b.primitive()["mode"] = 2;
             b.primitive()["indices"] = b.addAccessor<std::uint8_t>({2, 1, 0}, "SCALAR");
         }},
        {"indices beyond the vertices, and the one that restarts", "refused",
         [](GltfBuilder& b) {
             b.primitive()["indices"] = b.addAccessor<std::uint8_t>({2, 1, 255}, "SCALAR");
         }},
        {"primitives that draw nothing, and vertices left over", "warned",
         [](GltfBuilder& b) {
             b.primitive()["indices"] = b.addAccessor<std::uint8_t>({2, 1, 0, 0}, "SCALAR");
         }},
        {"primitives that draw nothing, and vertices left over", "warned",
         [](GltfBuilder& b) { b.attributes().erase("POSITION"); }},
        {"sparse accessors", "read",
         [](GltfBuilder& b) {
             const int where = b.addView({1}), what = b.addView(toBytes<float>({5, 5, 5}));
             b.gltf["accessors"][0]["sparse"] = {
                 {"count", 1},
                 {"indices", {{"bufferView", where}, {"componentType", 5121}}},
                 {"values", {{"bufferView", what}}}};
         }},
        {"accessors, views and buffers of no size", "warned",
         [](GltfBuilder& b) {
             b.gltf["bufferViews"].push_back({{"buffer", 0}, {"byteLength", 0}});
         }},
        {"accessors and views that reach beyond their bytes", "refused",
         [](GltfBuilder& b) { b.gltf["accessors"][0]["count"] = 1000; }},
        {"morph targets of positions, normals, tangents, `COLOR_0`, `TEXCOORD_0` and `_1`", "read",
         addTarget},
        {"morph targets of what the primitive does not have", "warned",
         [](GltfBuilder& b) {
             addTarget(b);
             b.attributes().erase("COLOR_0");
         }},
        {"skins, any number of joints a vertex", "read", addSkin},
        {"skins, any number of joints a vertex", "read",
         [](GltfBuilder& b) {
             addSkin(b);
             b.attributes()["JOINTS_1"] = b.attributes()["JOINTS_0"];
             b.attributes()["WEIGHTS_0"] = b.attributes()["WEIGHTS_1"] =
                 b.addAccessor<float>({0.5, 0, 0, 0, 0.5, 0, 0, 0, 0.5, 0, 0, 0}, "VEC4");
         }},
        {"joints that the skin does not have", "refused",
         [](GltfBuilder& b) {
             addSkin(b);
             b.attributes()["JOINTS_0"] = b.addAccessor<std::uint8_t>(Bytes(12, 7), "VEC4");
         }},
    };
}

std::vector<Said> saidOfMaterials() {
    return {
        {"metallic-roughness, normal, occlusion and emissive maps, alpha modes, sides", "read",
         material(R"({"normalTexture":{"index":0},"occlusionTexture":{"index":0},
                      "pbrMetallicRoughness":{"metallicRoughnessTexture":{"index":0}},
                      "alphaMode":"MASK","doubleSided":true})")},
        {"filters and wrapping of samplers, `KHR_texture_transform`", "read",
         together({merged(R"({"samplers":[{"magFilter":9728,"minFilter":9984,"wrapS":33648}],
                              "textures":[{"source":0,"sampler":0}],
                              "extensionsUsed":["KHR_texture_transform"]})"),
                   material(R"({"normalTexture":{"index":0,"extensions":{
                                "KHR_texture_transform":{"offset":[0.5,0.5]}}}})")})},
        {"factors outside their range", "warned",
         material(R"({"pbrMetallicRoughness":{"metallicFactor":2}})")},
        {"factors outside their range", "warned",
         materialExtension("KHR_materials_ior", R"({"ior":0.5})")},
        {"factors outside their range", "warned",
         materialExtension("KHR_materials_pbrSpecularGlossiness",
                           R"({"diffuseFactor":[2,1,1,1]})")},
        {"`KHR_materials_` anisotropy, clearcoat, emissive_strength, ior, iridescence, "
         "pbrSpecularGlossiness, sheen, specular, transmission, unlit, variants, volume",
         "read", materialExtension("KHR_materials_clearcoat", R"({"clearcoatFactor":1})")},
        {"a texture with `TEXCOORD_2` or beyond", "warned",
         material(R"({"emissiveTexture":{"index":0,"texCoord":2}})")},
        {"a texture where the primitive has no coordinates for it", "warned",
         [](GltfBuilder& b) { b.attributes().erase("TEXCOORD_0"); }},
        {"images by URI, by buffer view or in data URIs, whatever their media type says", "read",
         merged(kDataUriImage)},
        {"an image with a URI and a buffer view", "warned",
         [](GltfBuilder& b) { b.gltf["images"][0]["uri"] = "a.png"; }},
        {"images that are missing, damaged or in formats that are not decoded", "warned",
         merged(R"({"images":[{"uri":"missing.png"}]})")},
        {"images that are missing, damaged or in formats that are not decoded", "warned",
         merged(R"({"images":[{"uri":"data:,GIF89a"}]})")},
        {"`EXT_texture_webp` and `KHR_texture_basisu`, with or without a fallback", "read",
         merged(R"({"textures":[{"extensions":{"EXT_texture_webp":{"source":0}}}],
                    "extensionsUsed":["EXT_texture_webp"]})")},
        {"`EXT_texture_avif` and `MSFT_texture_dds` with a fallback", "warned",
         merged(R"({"textures":[{"source":0,"extensions":{"EXT_texture_avif":{"source":0}}}],
                    "extensionsUsed":["EXT_texture_avif"]})")},
        {"`EXT_texture_avif` and `MSFT_texture_dds` without a fallback", "refused",
         [](GltfBuilder& b) {
             b.gltf["textures"] = {{{"extensions", {{"MSFT_texture_dds", {{"source", 0}}}}}}};
         }},
    };
}

std::vector<Said> saidOfNodes() {
    return {
        {"matrices or translations, rotations and scales; children", "read",
         node(R"({"rotation":[0,0,0.7071,0.7071],"scale":[-1,1,1]})")},
        {"a matrix and a translation, rotation or scale", "warned",
         node(R"({"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],"scale":[2,2,2]})")},
        {"a rotation of zeros", "warned", node(R"({"rotation":[0,0,0,0]})")},
        {"a node with two parents, or its own ancestor", "refused", node(R"({"children":[0]})")},
        {"a scene that lists a node twice, or one below another", "warned",
         merged(R"({"scenes":[{"nodes":[0,0]}]})")},
        {"a scene that lists a node twice, or one below another", "warned",
         [](GltfBuilder& b) {
             b.gltf["nodes"].push_back({{"children", {0}}});
         }},
        {"a scene that lists a node and one below it", "refused",
         merged(R"({"nodes":[{"children":[1]},{}],"scenes":[{"nodes":[0,1]}]})")},
        {"a file without scenes", "read",
         [](GltfBuilder& b) {
             b.gltf.erase("scenes");
             b.gltf.erase("scene");
         }},
        {"cameras, perspective and orthographic", "read",
         together({merged(R"({"cameras":[{"type":"perspective",
                              "perspective":{"yfov":1,"znear":0.1}}]})"),
                   node(R"({"camera":0})")})},
        {"cameras whose numbers are out of range", "refused",
         merged(R"({"cameras":[{"type":"perspective","perspective":{"yfov":4,"znear":0.1}}]})")},
        {"`KHR_lights_punctual`, `KHR_node_visibility`, `EXT_mesh_gpu_instancing`", "read",
         together({merged(R"({"extensionsUsed":["KHR_lights_punctual"],"extensions":
                              {"KHR_lights_punctual":{"lights":[{"type":"point"}]}}})"),
                   node(R"({"extensions":{"KHR_lights_punctual":{"light":0}}})")})},
        {"lights of other types", "warned",
         merged(R"({"extensionsUsed":["KHR_lights_punctual"],"extensions":
                    {"KHR_lights_punctual":{"lights":[{"type":"area"}]}}})")},
        {"lights whose numbers are out of range", "refused",
         merged(R"({"extensionsUsed":["KHR_lights_punctual"],"extensions":
                    {"KHR_lights_punctual":{"lights":[{"type":"point","intensity":-1}]}}})")},
        {"weights that are not as many as the targets", "warned",
         together({addTarget, node(R"({"weights":[1,2]})")})},
        {"extras", "read", node(R"({"extras":{"extensions":{"X_mine":{}}}})")},
    };
}

std::vector<Said> saidOfAnimations() {
    return {
        {"animations of translation, rotation, scale and weights", "read", addAnimation},
        {"animations of anything else, and `KHR_animation_pointer`", "warned",
         [](GltfBuilder& b) {
             addAnimation(b);
             b.gltf["animations"][0]["channels"][0]["target"]["path"] = "visible";
         }},
        {"animations of anything else, and `KHR_animation_pointer`", "warned",
         [](GltfBuilder& b) {
             addAnimation(b);
             b.gltf["animations"][0]["channels"][0]["target"] = {
                 {"path", "pointer"},
                 {"extensions",
                  {{"KHR_animation_pointer", {{"pointer", "/nodes/0/translation"}}}}}};
         }},
        {"animations of nodes with a matrix, or of weights without targets", "warned",
         together({addAnimation, node(R"({"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]})")})},
        {"animations whose times fall, or without keys", "refused",
         [](GltfBuilder& b) {
             addAnimation(b);
             b.gltf["animations"][0]["samplers"][0]["input"] =
                 b.addAccessor<float>({1, 0}, "SCALAR");
         }},
    };
}

std::vector<Said> saidOfFiles() {
    return {
        {"`asset.version` 2.x; generator and copyright", "read",
         merged(R"({"asset":{"version":"2.1","copyright":"me"}})")},
        {"a version that is a number", "warned", merged(R"({"asset":{"version":2.0}})")},
        {"`asset.minVersion` above 2.0, and version 1", "refused",
         merged(R"({"asset":{"minVersion":"2.1"}})")},
        {"`KHR_draco_mesh_compression`, `EXT_` and `KHR_meshopt_compression`, `KHR_xmp`, "
         "`KHR_xmp_json_ld`",
         "read", merged(R"({"extensionsUsed":["KHR_xmp"],"extensionsRequired":["KHR_xmp"]})")},
        {"other extensions, declared or not", "warned",
         merged(R"({"extensionsUsed":["X_unheard_of"]})")},
        {"other extensions, declared or not", "warned",
         material(R"({"extensions":{"KHR_materials_dispersion":{"dispersion":1}}})")},
        {"other extensions that it requires", "refused",
         merged(R"({"extensionsUsed":["X_unheard_of"],"extensionsRequired":["X_unheard_of"]})")},
        {"white space in a data URI", "warned",
         [](GltfBuilder& b) {
             Json image = Json::parse(kDataUriImage)["images"][0];
             b.gltf["images"][0] = {{"uri", image["uri"].get<std::string>().insert(40, "\r\n")}};
         }},
        {"members that glTF 2.0 does not have", "read", merged(R"({"scene2":{},"x":[1]})")},
        {"values of another type or out of range", "refused", node(R"({"mesh":"0"})")},
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
    statements.push_back({"a `.glb` that is longer than it says, or has more chunks", "warned",
                          "a.glb", whole + "more"});
    statements.push_back(
        {"a file that is cut off, or names files that are missing or outside of "
         "its folder, buffers",
         "refused", "a.glb", whole.substr(0, whole.size() - 4)});
    expectStatements("glTF", statements, [](const std::filesystem::path& file, bool strict) {
        GltfOptions options;
        options.strict = strict;
        return readGltf(file, options).warnings;
    });
}

}  // namespace
}  // namespace peeler::test
