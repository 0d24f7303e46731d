// SPDX-License-Identifier: Apache-2.0
// Scene seeds that use every feature of glTF, and compressed meshes.
#include <draco/compression/expert_encode.h>
#include <draco/mesh/mesh.h>

#include "formats/gltf/gltf_builder.h"
#include "formats/gltf/meshopt_gltf.h"
#include "formats/image/png_builder.h"
#include "fuzz/seeds.h"

namespace peeler::fuzz {
namespace {

using test::Bytes;
using test::GltfBuilder;
using test::Json;

SeedBytes glbOf(GltfBuilder builder) {
    if (!builder.bin.empty() && !builder.gltf.contains("buffers"))
        builder.gltf["buffers"] = {{{"byteLength", builder.bin.size()}}};
    return seedOf(test::glb(builder.gltf.dump(), builder.bin));
}

/// Returns the JSON as a .gltf. Its buffer is a data: URI of zeros.
SeedBytes gltfOf(GltfBuilder builder) {
    const std::size_t triples = (builder.bin.size() + 2) / 3;
    builder.gltf["buffers"] = {
        {{"byteLength", builder.bin.size()},
         {"uri", "data:application/octet-stream;base64," + std::string(4 * triples, 'A')}}};
    return seedOf(builder.gltf.dump());
}

/// Returns a mesh with every attribute, a sparse accessor, morph targets and a skin.
GltfBuilder richMesh() {
    GltfBuilder builder = test::triangle();
    Json& attributes = builder.attributes();
    attributes["NORMAL"] = builder.addAccessor<float>({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
    attributes["TANGENT"] =
        builder.addAccessor<float>({1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, -1}, "VEC4");
    attributes["TEXCOORD_0"] = builder.addAccessor<float>({0, 0, 1, 0, 0, 1}, "VEC2");
    attributes["TEXCOORD_1"] = builder.addAccessor<std::uint16_t>({0, 0, 65535, 0, 0, 65535},
                                                                  "VEC2", {{"normalized", true}});
    attributes["COLOR_0"] = builder.addAccessor<std::uint8_t>(
        {255, 0, 0, 255, 0, 255, 0, 128, 0, 0, 255, 0}, "VEC4", {{"normalized", true}});
    attributes["JOINTS_0"] =
        builder.addAccessor<std::uint8_t>({0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0}, "VEC4");
    attributes["WEIGHTS_0"] =
        builder.addAccessor<float>({.5, .5, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
    builder.primitive()["indices"] = builder.addAccessor<std::uint16_t>({0, 1, 2}, "SCALAR");
    const int sparse_indices = builder.addView(test::toBytes<std::uint8_t>({1, 0, 0, 0}));
    const int sparse_values = builder.addView(test::toBytes<float>({0, 0, 2}));
    const int target = builder.addAccessor(
        {{"componentType", 5126},
         {"count", 3},
         {"type", "VEC3"},
         {"sparse",
          {{"count", 1},
           {"indices", {{"bufferView", sparse_indices}, {"componentType", 5121}}},
           {"values", {{"bufferView", sparse_values}}}}}});
    builder.primitive()["targets"] = {{{"POSITION", target}, {"NORMAL", target}}};
    builder.gltf["meshes"][0]["weights"] = {0.25};
    const std::vector<float> identity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    std::vector<float> two = identity;
    two.insert(two.end(), identity.begin(), identity.end());
    const int matrices = builder.addAccessor({{"bufferView", builder.addView(test::toBytes(two))},
                                              {"componentType", 5126},
                                              {"count", 2},
                                              {"type", "MAT4"}});
    builder.gltf["skins"] = {
        {{"joints", {1, 2}}, {"skeleton", 1}, {"inverseBindMatrices", matrices}}};
    builder.gltf["nodes"] = {{{"mesh", 0}, {"skin", 0}, {"weights", {0.5}}, {"children", {1, 3}}},
                             {{"translation", {0, 1, 0}}, {"children", {2}}},
                             {{"rotation", {0, 0, 0, 1}}, {"scale", {1, 2, 1}}},
                             {{"name", "eye"}, {"camera", 0}, {"matrix", identity}}};
    builder.gltf["cameras"] = {
        {{"type", "perspective"},
         {"perspective", {{"yfov", 0.7}, {"znear", 0.1}, {"zfar", 10}, {"aspectRatio", 1.5}}}},
        {{"type", "orthographic"},
         {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"znear", 0}, {"zfar", 9}}}}};
    return builder;
}

/// Returns a scene with animations of every interpolation mode.
GltfBuilder animated() {
    GltfBuilder builder = richMesh();
    const int times =
        builder.addAccessor<float>({0, .5, 1}, "SCALAR", {{"min", {0}}, {"max", {1}}});
    const int places = builder.addAccessor<float>({0, 0, 0, 1, 0, 0, 1, 1, 0}, "VEC3");
    const int turns = builder.addAccessor<float>({0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 1}, "VEC4");
    std::vector<float> cubic(27, 0.5F);
    const int sizes = builder.addAccessor<float>(cubic, "VEC3");
    const int weights =
        builder.addAccessor<std::uint8_t>({0, 128, 255}, "SCALAR", {{"normalized", true}});
    const auto sampler = [&](int output, const char* interpolation) {
        return Json{{"input", times}, {"output", output}, {"interpolation", interpolation}};
    };
    const auto channel = [](int index, int node, const char* path) {
        return Json{{"sampler", index}, {"target", {{"node", node}, {"path", path}}}};
    };
    builder.gltf["animations"] = {{{"name", "walk"},
                                   {"samplers",
                                    {sampler(places, "STEP"), sampler(turns, "LINEAR"),
                                     sampler(sizes, "CUBICSPLINE"), sampler(weights, "LINEAR")}},
                                   {"channels",
                                    {channel(0, 1, "translation"), channel(1, 2, "rotation"),
                                     channel(2, 2, "scale"), channel(3, 0, "weights")}}}};
    return builder;
}

/// Returns a scene whose materials have all extensions, and textures from a buffer view and a URI.
GltfBuilder material() {
    GltfBuilder builder = test::triangle();
    builder.attributes()["TEXCOORD_0"] = builder.addAccessor<float>({0, 0, 1, 0, 0, 1}, "VEC2");
    const Bytes png = test::png(2, 2, test::PngColor::kRgba, 8, Bytes(16, 200));
    const Json textured = {
        {"index", 0},
        {"texCoord", 0},
        {"extensions",
         {{"KHR_texture_transform", {{"offset", {0.1, 0}}, {"rotation", 1}, {"scale", {2, 2}}}}}}};
    Json normal = textured, occlusion = textured;
    normal["scale"] = 0.5;
    occlusion["strength"] = 0.5;
    builder.gltf["images"] = {{{"bufferView", builder.addView(png)}, {"mimeType", "image/png"}},
                              {{"uri", "data:image/png;base64,iVBORw0KGgo="}}};
    builder.gltf["samplers"] = {{{"magFilter", 9729}, {"minFilter", 9987}, {"wrapS", 33071}}};
    builder.gltf["textures"] = {{{"source", 0}, {"sampler", 0}}, {{"source", 1}}};
    const std::vector<std::string> used = {"KHR_texture_transform",
                                           "KHR_materials_transmission",
                                           "KHR_materials_volume",
                                           "KHR_materials_ior",
                                           "KHR_materials_emissive_strength",
                                           "KHR_materials_variants",
                                           "KHR_lights_punctual",
                                           "KHR_materials_unlit"};
    builder.gltf["extensionsUsed"] = used;
    builder.gltf["materials"] = {
        {{"name", "glass"},
         {"pbrMetallicRoughness",
          {{"baseColorFactor", {1, .5, .5, .5}},
           {"baseColorTexture", textured},
           {"metallicFactor", 0},
           {"roughnessFactor", .5},
           {"metallicRoughnessTexture", {{"index", 1}}}}},
         {"normalTexture", normal},
         {"occlusionTexture", occlusion},
         {"emissiveTexture", textured},
         {"emissiveFactor", {1, 1, 0}},
         {"alphaMode", "MASK"},
         {"alphaCutoff", .3},
         {"doubleSided", true},
         {"extensions",
          {{"KHR_materials_transmission", {{"transmissionFactor", 1}}},
           {"KHR_materials_volume",
            {{"thicknessFactor", 1}, {"attenuationDistance", 2}, {"attenuationColor", {1, .5, 1}}}},
           {"KHR_materials_ior", {{"ior", 1.4}}},
           {"KHR_materials_emissive_strength", {{"emissiveStrength", 3}}}}}},
        {{"alphaMode", "BLEND"}, {"extensions", {{"KHR_materials_unlit", Json::object()}}}}};
    builder.primitive()["material"] = 0;
    builder.primitive()["extensions"] = {
        {"KHR_materials_variants", {{"mappings", {{{"material", 1}, {"variants", {0}}}}}}}};
    builder.gltf["extensions"] = {{"KHR_materials_variants", {{"variants", {{{"name", "red"}}}}}},
                                  {"KHR_lights_punctual",
                                   {{"lights",
                                     {{{"type", "spot"},
                                       {"intensity", 5},
                                       {"spot", {{"outerConeAngle", .5}, {"innerConeAngle", .1}}}},
                                      {{"type", "point"}, {"range", 4}, {"color", {1, 1, .5}}},
                                      {{"type", "directional"}}}}}}};
    builder.gltf["nodes"].push_back({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
    builder.gltf["scenes"][0]["nodes"] = {0, 1};
    return builder;
}

GltfBuilder instances() {
    GltfBuilder builder = test::triangle();
    const int places = builder.addAccessor<float>({0, 0, 0, 1, 0, 0}, "VEC3");
    const int turns = builder.addAccessor<std::int16_t>({0, 0, 0, 32767, 0, 32767, 0, 0}, "VEC4",
                                                        {{"normalized", true}});
    builder.gltf["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
    builder.gltf["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
        {"TRANSLATION", places}, {"ROTATION", turns}, {"SCALE", places}};
    return builder;
}

/// Returns a strip of quads with three attributes, compressed with Draco.
SeedBytes dracoBytes(int method, int position_bits) {
    constexpr std::uint32_t kColumns = 4;
    draco::Mesh mesh;
    mesh.SetNumFaces(2 * (kColumns - 1));
    for (std::uint32_t x = 0; x + 1 < kColumns; ++x) {
        const draco::PointIndex a(2 * x), b(2 * x + 1), c(2 * x + 2), d(2 * x + 3);
        mesh.SetFace(draco::FaceIndex(2 * x), {a, b, c});
        mesh.SetFace(draco::FaceIndex(2 * x + 1), {c, b, d});
    }
    mesh.set_num_points(2 * kColumns);
    const auto add = [&](draco::GeometryAttribute::Type type, std::int8_t components,
                         draco::DataType data_type, auto value) {
        draco::GeometryAttribute attribute;
        attribute.Init(type, nullptr, components, data_type, false,
                       static_cast<std::int64_t>(sizeof value[0]) * components, 0);
        const int id = mesh.AddAttribute(attribute, true, mesh.num_points());
        for (std::uint32_t i = 0; i < mesh.num_points(); ++i) {
            for (std::size_t c = 0; c < value.size(); ++c)
                value[c] = static_cast<typename decltype(value)::value_type>((i >> c & 1U) * i);
            mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), value.data());
        }
    };
    add(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32, std::vector<float>(3));
    add(draco::GeometryAttribute::NORMAL, 3, draco::DT_FLOAT32, std::vector<float>(3));
    add(draco::GeometryAttribute::GENERIC, 4, draco::DT_UINT8, std::vector<std::uint8_t>(4));
    draco::ExpertEncoder encoder(mesh);
    encoder.SetEncodingMethod(method);
    if (position_bits > 0) {
        encoder.SetAttributeQuantization(0, position_bits);
        encoder.SetAttributeQuantization(1, 8);
    }
    draco::EncoderBuffer buffer;
    if (!encoder.EncodeToBuffer(&buffer).ok()) throw std::runtime_error("Draco cannot encode");
    return {buffer.data(), buffer.data() + buffer.size()};
}

GltfBuilder dracoScene(const SeedBytes& bytes) {
    GltfBuilder builder;
    const int view = builder.addView(bytes);
    const Json vertices = {{"componentType", 5126}, {"type", "VEC3"}, {"count", 8}};
    builder.gltf["accessors"] = {
        vertices, vertices, {{"componentType", 5125}, {"type", "SCALAR"}, {"count", 18}}};
    const Json ids = {{"POSITION", 0}, {"NORMAL", 1}};
    builder.gltf["meshes"] = {
        {{"primitives",
          {{{"indices", 2},
            {"attributes", ids},
            {"extensions",
             {{"KHR_draco_mesh_compression", {{"bufferView", view}, {"attributes", ids}}}}}}}}}};
    builder.gltf["nodes"] = {{{"mesh", 0}}};
    builder.gltf["extensionsRequired"] =
        builder.gltf["extensionsUsed"] = {"KHR_draco_mesh_compression"};
    return builder;
}

void addMeshoptSeed(Seeds& seeds, std::uint8_t mode, std::uint8_t filter, std::uint16_t stride,
                    std::uint16_t count, const Bytes& stream) {
    SeedBytes seed = {mode,
                      filter,
                      static_cast<std::uint8_t>(stride & 0xFFU),
                      static_cast<std::uint8_t>(stride >> 8U),
                      static_cast<std::uint8_t>(count & 0xFFU),
                      static_cast<std::uint8_t>(count >> 8U)};
    seed.insert(seed.end(), stream.begin(), stream.end());
    seeds["meshopt"].push_back(std::move(seed));
}

}  // namespace

void addSceneSeeds(Seeds& seeds) {
    for (const GltfBuilder& builder :
         {test::triangle(), richMesh(), animated(), material(), instances(), test::compressed()})
        seeds["gltf"].push_back(glbOf(builder));
    seeds["gltf"].push_back(gltfOf(animated()));
    for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING})
        for (const int bits : {0, 11}) {
            const SeedBytes bytes = dracoBytes(method, bits);
            SeedBytes seed = {3, 0, 5, 3, 1, 5, 3, 2, 1, 4};  // the requested attributes
            seed.insert(seed.end(), bytes.begin(), bytes.end());
            seeds["draco"].push_back(std::move(seed));
            if (bits > 0) seeds["gltf"].push_back(glbOf(dracoScene(bytes)));
        }
    const std::vector<unsigned int> indices = {0, 1, 2, 2, 1, 3, 4, 3, 5, 5, 6, 7};
    std::vector<std::uint8_t> values(64 * 8);
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<std::uint8_t>(i * i / 7);
    addMeshoptSeed(seeds, 1, 0, 4, 12, test::encodeTriangles(indices));
    addMeshoptSeed(seeds, 2, 0, 2, 12, test::encodeIndices(indices));
    for (std::uint8_t filter = 0; filter < 5; ++filter)
        addMeshoptSeed(seeds, 0, filter, 8, 64, test::encodeAttributes(values.data(), 64, 8));
    addMeshoptSeed(seeds, 0, 4, 4, 64, test::encodeAttributes(values.data(), 64, 4));
}

}  // namespace peeler::fuzz
