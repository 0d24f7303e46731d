// SPDX-License-Identifier: Apache-2.0
// Tests glTF files with added baked values: all other data must be kept.
#include "formats/gltf/baked_gltf.h"

#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <nlohmann/json.hpp>

#include "formats/exr/texture_files.h"
#include "formats/file/read_warnings.h"
#include "formats/gltf/gltf_builder.h"
#include "formats/gltf/gltf_container.h"
#include "formats/gltf/gltf_reader.h"
#include "formats/gltf/meshopt_gltf.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

struct Glb {
    explicit Glb(const fs::path& path) {
        const std::string text = bytesOf(path);
        bytes.assign(text.begin(), text.end());
        ReadWarnings warnings(false, {});
        const GltfContainer container = splitGltfContainer(bytes, path.string(), warnings);
        EXPECT_TRUE(warnings.sentences().empty());
        json_text = container.json;
        json = nlohmann::ordered_json::parse(container.json);
        binary = container.binary.value_or(std::span<const std::uint8_t>());
    }

    std::span<const std::uint8_t> view(std::size_t index) const {
        const auto& view = json["bufferViews"][index];
        EXPECT_EQ(view["buffer"], 0);
        return binary.subspan(view.value("byteOffset", std::size_t{0}),
                              view["byteLength"].get<std::size_t>());
    }

    Bytes bytes;
    std::string json_text;
    nlohmann::ordered_json json;
    std::span<const std::uint8_t> binary;
};

/// Returns baked data for the triangle at a node: grey levels as colours, and ten times the grey
/// levels as values.
BakedPrimitive values(int node, std::uint16_t grey = 1000) {
    BakedPrimitive result;
    result.node = node;
    result.source = {0, 0, 3};
    for (int i = 0; i < 3; ++i) {
        const auto level = static_cast<std::uint16_t>(grey + i);
        result.colors.push_back({level, level, level, 65535});
        result.values.push_back(static_cast<float>(10 * level));
    }
    return result;
}

/// Writes a copy of the source with these values added, as a .glb in the source's folder. Returns
/// the path of the copy.
fs::path bake(const fs::path& source, const std::vector<BakedPrimitive>& primitives) {
    GlbWriter package(source, GltfOptions{});
    addVertexValues(package, "_AO", primitives);
    EXPECT_TRUE(package.warnings().empty());
    const fs::path path = source.parent_path() / "baked.glb";
    package.write(path.string());
    return path;
}

tinygltf::Model readByTinygltf(const fs::path& path) {
    tinygltf::TinyGLTF reader;
    reader.SetImageLoader([](tinygltf::Image*, int, std::string*, std::string*, int, int,
                             const unsigned char*, int, void*) { return true; },
                          nullptr);
    tinygltf::Model model;
    std::string problems, remarks;
    EXPECT_TRUE(reader.LoadBinaryFromFile(&model, &problems, &remarks, path.string()));
    EXPECT_EQ(problems, "");
    EXPECT_EQ(remarks, "");
    return model;
}

TEST(BakedGltf, HasColoursThatNoTargetDisplaces) {
    // The values are baked for a pose in which the targets displace the colours.
    const ScratchDir folder;
    GltfBuilder builder = triangle();
    const int black = builder.addAccessor<float>(std::vector<float>(9), "VEC3");
    const int white = builder.addAccessor<float>(std::vector<float>(9, 1), "VEC3");
    builder.attributes()["COLOR_0"] = black;
    builder.primitive()["targets"] = {{{"COLOR_0", white}, {"POSITION", white}}};
    builder.gltf["meshes"][0]["weights"] = {1};
    const Scene scene = readGltf(bake(builder.write(folder, "scene.glb"), {values(0)}));
    EXPECT_TRUE(scene.warnings.empty());
    const MorphTarget& target = scene.meshes[0].primitives[0].targets.at(0);
    EXPECT_EQ(target.colors, std::vector<glm::vec4>(3, glm::vec4(0)));
    EXPECT_EQ(target.positions, std::vector<glm::vec3>(3, glm::vec3(1)));
}

TEST(BakedGltf, HoldsColoursAndValuesOfVertices) {
    const ScratchDir folder;
    const fs::path baked = bake(triangle().write(folder, "scene.glb"), {values(0)});
    const Scene scene = readGltf(baked);
    const Primitive& primitive = scene.meshes[0].primitives[0];
    ASSERT_EQ(primitive.colors.size(), 3U);
    for (int i = 0; i < 3; ++i) {
        const float grey = static_cast<float>(1000 + i) / 65535;
        EXPECT_EQ(primitive.colors[static_cast<std::size_t>(i)], glm::vec4(grey, grey, grey, 1));
    }
    EXPECT_EQ(primitive.positions, (std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));

    const tinygltf::Model model = readByTinygltf(baked);
    const auto& accessor = model.accessors[static_cast<std::size_t>(
        model.meshes[0].primitives[0].attributes.at("_AO"))];
    EXPECT_EQ(accessor.componentType, 5126);
    EXPECT_EQ(accessor.type, TINYGLTF_TYPE_SCALAR);
    ASSERT_EQ(accessor.count, 3U);
    const auto& view = model.bufferViews[static_cast<std::size_t>(accessor.bufferView)];
    EXPECT_EQ(view.byteOffset % 4, 0U);
    float last = 0;
    std::memcpy(&last, model.buffers[0].data.data() + view.byteOffset + 8, 4);
    EXPECT_EQ(last, 10020.0F);
}

TEST(BakedGltf, KeepsWhatItDoesNotKnow) {
    GltfBuilder builder = triangle();
    builder.gltf["extensionsUsed"] = {"VENDOR_odd"};
    builder.gltf["extensions"]["VENDOR_odd"] = {{"z", 1}, {"a", {1.5, "text", nullptr}}};
    builder.gltf["extras"] = {{"shot", "sc010"}};
    builder.gltf["nodes"][0]["extras"] = {{"rig", true}};
    builder.primitive()["extras"] = {{"part", 7}};
    builder.attributes()["_OLD"] = builder.addAccessor<float>({1, 2, 3}, "SCALAR");
    builder.gltf["cameras"] = {
        {{"type", "perspective"}, {"perspective", {{"yfov", 0.5}, {"znear", 0.1}}}}};
    const ScratchDir folder;
    const fs::path source = builder.write(folder, "scene.glb");
    const Glb glb(bake(source, {values(0)}));
    Json expected = builder.gltf;
    expected["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = 2;
    expected["meshes"][0]["primitives"][0]["attributes"]["_AO"] = 3;
    Json found = Json::parse(glb.json_text);
    for (const char* grown : {"accessors", "bufferViews"}) {
        Json first(found[grown].begin(),
                   found[grown].begin() + static_cast<std::ptrdiff_t>(expected[grown].size()));
        EXPECT_EQ(first, expected[grown]) << grown;
        expected.erase(grown);
        found.erase(grown);
    }
    found.erase("buffers");
    EXPECT_EQ(found, expected);
    EXPECT_EQ(std::vector(glb.binary.begin(),
                          glb.binary.begin() + static_cast<std::ptrdiff_t>(builder.bin.size())),
              builder.bin);
}

TEST(BakedGltf, TakesInBuffersAndImagesFromEverywhere) {
    // Positions are in a data URI, other data is in a file; one image is in a file, the other in a
    // data URI.
    const ValueTexture dot{"", 1, 3, {1, 0, 0}};
    const Bytes png = encodePng(dot, 8);
    GltfBuilder builder = triangle();
    const Json first_view = builder.gltf["bufferViews"][0];
    builder.gltf["buffers"] = {
        {{"uri", "data:application/octet-stream;base64,AAAA"}, {"byteLength", 3}},
        {{"uri", "some%20corners.bin"}, {"byteLength", builder.bin.size()}, {"name", "corners"}}};
    builder.gltf["bufferViews"][0]["buffer"] = 1;
    builder.gltf["images"] = {{{"uri", "dot.png"}, {"name", "dot"}}, {{"uri", "dot.png"}}};
    builder.gltf["textures"] = {{{"source", 0}}};
    builder.gltf["materials"] = {
        {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
    builder.primitive()["material"] = 0;
    builder.attributes()["TEXCOORD_0"] =
        builder.addAccessor(Json{{"componentType", 5126}, {"count", 3}, {"type", "VEC2"}});
    const ScratchDir folder;
    const fs::path source = folder / "scene.gltf";
    writeFile(folder / "some corners.bin", builder.bin);
    writeFile(folder / "dot.png", png);
    writeFile(source, builder.gltf.dump());
    const fs::path baked = bake(source, {values(0)});
    const Glb glb(baked);
    EXPECT_EQ(glb.json_text.find("\"uri\""), std::string::npos);
    EXPECT_EQ(glb.json["buffers"].size(), 1U);
    EXPECT_EQ(glb.json["bufferViews"][0]["byteOffset"], 4);  // after 3 bytes of data, aligned to 4
    const auto image = glb.view(glb.json["images"][0]["bufferView"].get<std::size_t>());
    EXPECT_EQ(Bytes(image.begin(), image.end()), png);
    EXPECT_EQ(glb.json["images"][0]["mimeType"], "image/png");
    EXPECT_EQ(glb.json["images"][1]["bufferView"], glb.json["images"][0]["bufferView"]);
    EXPECT_EQ(glb.json["images"][0]["name"], "dot");

    fs::rename(baked, folder / "alone.glb");
    fs::remove(folder / "some corners.bin");
    fs::remove(folder / "dot.png");
    const Scene scene = readGltf(folder / "alone.glb");
    EXPECT_TRUE(scene.warnings.empty());
    EXPECT_EQ(scene.meshes[0].primitives[0].positions[1], glm::vec3(1, 0, 0));
    ASSERT_EQ(scene.images.size(), 1U);
    EXPECT_EQ(scene.images[0].rgba, (std::vector<std::uint8_t>{255, 0, 0, 255}));
    readByTinygltf(folder / "alone.glb");
}

TEST(BakedGltf, SaysWhichImagesStayOutside) {
    GltfBuilder builder = triangle();
    builder.gltf["images"] = {{{"uri", "missing.png"}}, {{"uri", "notes.txt"}}};
    const ScratchDir folder;
    writeFile(folder / "notes.txt", std::string("not a picture"));
    GlbWriter package(builder.write(folder), GltfOptions{});
    ASSERT_EQ(package.warnings().size(), 2U);
    EXPECT_TRUE(contains(package.warnings()[0], "/images/0"));
    EXPECT_TRUE(contains(package.warnings()[1], "/images/1"));
    EXPECT_EQ(package.gltf()["images"][1]["uri"], "notes.txt");
}

TEST(BakedGltf, StaysInTheScenesFolder) {
    GltfBuilder builder = triangle();
    builder.gltf["buffers"] = {{{"uri", "../outside.bin"}, {"byteLength", builder.bin.size()}}};
    const ScratchDir folder;
    writeFile(folder / "scene.gltf", builder.gltf.dump());
    try {
        const GlbWriter package(folder / "scene.gltf", GltfOptions{});
        FAIL() << "it reads other folders";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_EQ(error.where(), "/buffers/0/uri");
    }
}

TEST(BakedGltf, CopiesMeshesThatNodesShowDifferently) {
    GltfBuilder builder = triangle();
    for (int i = 1; i < 4; ++i)
        builder.gltf["nodes"].push_back({{"mesh", 0}, {"name", "node " + std::to_string(i)}});
    const ScratchDir folder;
    const fs::path source = builder.write(folder);
    const Glb glb(bake(source, {values(0), values(1, 2000), values(2)}));
    ASSERT_EQ(glb.json["meshes"].size(), 3U);
    const auto mesh_of = [&](std::size_t node) {
        return glb.json["nodes"][node]["mesh"].get<std::size_t>();
    };
    EXPECT_EQ(mesh_of(3), 0U);
    EXPECT_EQ(mesh_of(0), mesh_of(2));
    EXPECT_NE(mesh_of(0), mesh_of(1));
    const auto attributes = [&](std::size_t node) {
        return glb.json["meshes"][mesh_of(node)]["primitives"][0]["attributes"];
    };
    EXPECT_EQ(attributes(3).size(), 1U);
    EXPECT_EQ(attributes(0)["POSITION"], attributes(1)["POSITION"]);
    EXPECT_NE(attributes(0)["COLOR_0"], attributes(1)["COLOR_0"]);
    EXPECT_EQ(glb.json["accessors"].size(), 1U + 4U);

    // If all nodes have the same values, the mesh is not copied.
    const Glb same(bake(source, {values(0), values(1), values(2), values(3)}));
    EXPECT_EQ(same.json["meshes"].size(), 1U);
    EXPECT_EQ(same.json["accessors"].size(), 1U + 2U);
}

TEST(BakedGltf, NumbersVerticesAsTheFileDoes) {
    // The file has six vertices. The first primitive is skipped; the second draws only the second
    // triangle.
    GltfBuilder builder = triangle();
    builder.gltf["accessors"].clear();
    builder.gltf["bufferViews"].clear();
    const int position =
        builder.addAccessor<float>({9, 9, 9, 9, 9, 9, 9, 9, 9, 0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
    const int indices = builder.addAccessor<std::uint16_t>({3, 4, 5}, "SCALAR");
    builder.gltf["meshes"][0]["primitives"] = {
        {{"attributes", {{"_NONE", position}}}},
        {{"attributes", {{"POSITION", position}}}, {"indices", indices}}};
    const ScratchDir folder;
    const fs::path source = builder.write(folder);
    const PrimitiveSource place = readGltf(source).meshes[0].primitives[0].source;
    EXPECT_EQ(place.primitive, 1U);
    EXPECT_EQ(place.first_vertex, 3U);
    EXPECT_EQ(place.vertices, 6U);
    BakedPrimitive baked = values(0);
    baked.source = place;
    const Primitive primitive = readGltf(bake(source, {baked})).meshes[0].primitives[0];
    ASSERT_EQ(primitive.colors.size(), 3U);
    EXPECT_EQ(primitive.colors[2].r, 1002.0F / 65535);
}

TEST(BakedGltf, GivesMaterialsOcclusionTextures) {
    GltfBuilder builder = triangle();
    const int uv = builder.addAccessor<float>({0, 0, 1, 0, 0, 1}, "VEC2");
    builder.attributes()["TEXCOORD_0"] = builder.attributes()["TEXCOORD_1"] = uv;
    builder.gltf["meshes"][0]["primitives"].push_back(builder.primitive());
    builder.gltf["meshes"][0]["primitives"][1]["material"] = 0;
    builder.gltf["materials"] = {{{"name", "paint"}, {"doubleSided", true}}};
    const ScratchDir folder;
    GlbWriter package(builder.write(folder), GltfOptions{});
    addOcclusionTextures(package, 1,
                         {{0, encodePng({"", 2, 1, {0, 0.2F, 0.4F, 1}}, 8)},
                          {-1, encodePng({"", 1, 1, {0.6F}}, 8)}});
    package.write((folder / "baked.glb").string());
    readByTinygltf(folder / "baked.glb");
    const Scene scene = readGltf(folder / "baked.glb");
    // The file has two materials; the reader adds the default material.
    ASSERT_EQ(scene.materials.size(), 3U);
    const Material& paint = scene.materials[0];
    EXPECT_TRUE(paint.double_sided);
    EXPECT_EQ(paint.occlusion_texture.texcoord, 1);
    ASSERT_GE(paint.occlusion_texture.image, 0);
    const Image& image = scene.images[static_cast<std::size_t>(paint.occlusion_texture.image)];
    for (std::size_t i = 0; i < 4; ++i)
        EXPECT_EQ(int{image.rgba[4 * i]}, (std::array{0, 51, 102, 255})[i]);
    EXPECT_EQ(scene.meshes[0].primitives[0].material, 1);
    EXPECT_EQ(scene.meshes[0].primitives[1].material, 0);
    EXPECT_EQ(scene.materials[1].base_color, glm::vec4(1));
}

TEST(BakedGltf, LeavesMaterialsToPrimitivesWithoutThoseUvs) {
    // Primitives 0 and 1 have material 0, and material 1 in a variant; 2 and 3 have no material.
    // Only 0 and 2 have UVs.
    GltfBuilder builder = triangle();
    const Json bare = builder.primitive();
    const int uv = builder.addAccessor<float>({0, 0, 1, 0, 0, 1}, "VEC2");
    Json mapped = bare;
    mapped["attributes"]["TEXCOORD_0"] = uv;
    Json& primitives = builder.gltf["meshes"][0]["primitives"];
    primitives = {mapped, bare, mapped, bare};
    for (const std::size_t i : {0U, 1U}) {
        primitives[i]["material"] = 0;
        primitives[i]["extensions"]["KHR_materials_variants"]["mappings"] = {
            {{"material", 1}, {"variants", {0}}}};
    }
    builder.gltf["extensionsUsed"] = {"KHR_materials_variants"};
    builder.gltf["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "worn"}}};
    builder.gltf["materials"] = {{{"name", "paint"}}, {{"name", "rust"}}};
    const ScratchDir folder;
    GlbWriter package(builder.write(folder), GltfOptions{});
    const Bytes png = encodePng({"", 1, 1, {0.6F}}, 8);
    addOcclusionTextures(package, 0, {{0, png}, {1, png}, {-1, png}});
    package.write((folder / "baked.glb").string());
    const Glb glb(folder / "baked.glb");
    const auto& materials = glb.json["materials"];
    ASSERT_EQ(materials.size(), 5U);
    const auto& found = glb.json["meshes"][0]["primitives"];
    const auto material = [&](std::size_t primitive) {
        return materials[found[primitive]["material"].get<std::size_t>()];
    };
    EXPECT_EQ(material(0)["name"], "paint");
    EXPECT_TRUE(material(0).contains("occlusionTexture"));
    EXPECT_EQ(material(1)["name"], "paint");
    EXPECT_FALSE(material(1).contains("occlusionTexture"));
    EXPECT_TRUE(material(2).contains("occlusionTexture"));
    EXPECT_FALSE(found[3].contains("material"));
    const auto worn = [&](std::size_t primitive) {
        const auto& mappings = found[primitive]["extensions"]["KHR_materials_variants"]["mappings"];
        return materials[mappings[0]["material"].get<std::size_t>()];
    };
    EXPECT_EQ(worn(0)["name"], "rust");
    EXPECT_TRUE(worn(0).contains("occlusionTexture"));
    EXPECT_EQ(worn(1)["name"], "rust");
    EXPECT_FALSE(worn(1).contains("occlusionTexture"));
    readByTinygltf(folder / "baked.glb");
}

TEST(BakedGltf, OpensWithASceneAndAVariant) {
    GltfBuilder builder = triangle();
    builder.gltf["scenes"].push_back({{"nodes", {0}}});
    builder.gltf["extensionsUsed"] = {"KHR_materials_variants"};
    builder.gltf["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "a"}},
                                                                        {{"name", "b"}}};
    builder.gltf["materials"] = {Json::object(), Json::object()};
    builder.gltf["meshes"][0]["primitives"].push_back(builder.primitive());
    builder.primitive()["material"] = 0;
    builder.primitive()["extensions"]["KHR_materials_variants"]["mappings"] = {
        {{"material", 0}, {"variants", {0}}}, {{"material", 1}, {"variants", {1}}}};
    const ScratchDir folder;
    GlbWriter package(builder.write(folder), GltfOptions{});
    setDefaultScene(package, 1);
    setVariant(package, 1);
    EXPECT_EQ(package.gltf()["scene"], 1);
    const auto& primitives = package.gltf()["meshes"][0]["primitives"];
    EXPECT_EQ(primitives[0]["material"], 1);
    EXPECT_FALSE(primitives[1].contains("material"));
}

TEST(BakedGltf, MovesCompressedViewsButNotThePlaceOfTheirData) {
    GltfBuilder builder = compressed();
    Json& buffers = builder.gltf["buffers"];
    const Json placeholder = buffers[1];
    buffers = {{{"uri", "data:;base64,AAAA"}, {"byteLength", 3}},
               placeholder,
               {{"uri", "packed.bin"}, {"byteLength", builder.bin.size()}}};
    for (Json& view : builder.gltf["bufferViews"])
        view["extensions"]["EXT_meshopt_compression"]["buffer"] = 2;
    const ScratchDir folder;
    writeFile(folder / "packed.bin", builder.bin);
    writeFile(folder / "scene.gltf", builder.gltf.dump());
    const fs::path baked = bake(folder / "scene.gltf", {values(0)});
    const Glb glb(baked);
    ASSERT_EQ(glb.json["buffers"].size(), 2U);
    EXPECT_EQ(Json::parse(glb.json["buffers"][1].dump()), placeholder);
    const auto& view = glb.json["bufferViews"][1];
    EXPECT_EQ(view["buffer"], 1);
    EXPECT_EQ(view["byteOffset"], 48);
    const auto& packed = view["extensions"]["EXT_meshopt_compression"];
    EXPECT_EQ(packed["buffer"], 0);
    EXPECT_EQ(
        packed["byteOffset"],
        4 + builder.gltf["bufferViews"][1]["extensions"]["EXT_meshopt_compression"]["byteOffset"]
                .get<int>());
    const Primitive primitive = readGltf(baked).meshes[0].primitives[0];
    EXPECT_EQ(primitive.positions, (std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(primitive.indices, (std::vector<std::uint32_t>{0, 1, 2}));
    EXPECT_EQ(primitive.colors.size(), 3U);
}

TEST(BakedGltf, StandsBesideDracosAttributes) {
    // The Draco data is never decoded here; only the JSON matters.
    GltfBuilder builder = triangle();
    const Json promise = {{"componentType", 5126}, {"count", 2}, {"type", "VEC3"}};
    for (const char* name : {"POSITION", "COLOR_0"})
        builder.attributes()[name] = builder.addAccessor(promise);
    builder.primitive()["extensions"]["KHR_draco_mesh_compression"] = {
        {"bufferView", 0}, {"attributes", {{"POSITION", 0}, {"COLOR_0", 1}, {"_UNUSED", 2}}}};
    builder.gltf["extensionsUsed"] = {"KHR_draco_mesh_compression"};
    const ScratchDir folder;
    const Glb glb(bake(builder.write(folder), {values(0)}));
    const auto& primitive = glb.json["meshes"][0]["primitives"][0];
    const auto& draco = primitive["extensions"]["KHR_draco_mesh_compression"];
    EXPECT_EQ(draco["attributes"].dump(), R"({"POSITION":0,"_UNUSED":2})");
    const auto count_of = [&](const char* name) {
        return glb.json["accessors"][primitive["attributes"][name].get<std::size_t>()]["count"];
    };
    for (const char* name : {"POSITION", "COLOR_0", "_AO"})
        // The decoded count; the file's accessors declare 2.
        EXPECT_EQ(count_of(name), 3) << name;
}

TEST(BakedGltf, KeepsTheOrderOfMembers) {
    const ScratchDir folder;
    writeFile(folder / "scene.gltf",
              R"({"zeta": 1, "scenes": [{"nodes": [0]}], "nodes": [{"name": "n", "mesh": 0}],
                  "buffers": [{"uri": "data:;base64,AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA",
                               "byteLength": 36}],
                  "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
                  "bufferViews": [{"buffer": 0, "byteLength": 36}],
                  "accessors": [{"type": "VEC3", "count": 3, "componentType": 5126,
                                 "bufferView": 0}], "asset": {"version": "2.0"}})");
    const Glb glb(bake(folder / "scene.gltf", {values(0)}));
    std::vector<std::string> names;
    for (const auto& [name, member] : glb.json.items())
        names.push_back(name);
    EXPECT_EQ(names, (std::vector<std::string>{"zeta", "scenes", "nodes", "buffers", "meshes",
                                               "bufferViews", "accessors", "asset"}));
}

TEST(BakedGltf, NoticesThatTheFileIsAnother) {
    const ScratchDir folder;
    GlbWriter package(triangle().write(folder), GltfOptions{});
    BakedPrimitive beyond = values(0);
    beyond.source.primitive = 5;
    try {
        addVertexValues(package, "_AO", {beyond});
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
    }
}

}  // namespace
}  // namespace peeler::test
