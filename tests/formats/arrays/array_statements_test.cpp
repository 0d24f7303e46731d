// SPDX-License-Identifier: Apache-2.0
// Tests the tables for scenes and layers as arrays in formats/README.md, "Supported content".
#include <functional>
#include <nlohmann/json.hpp>

#include "formats/arrays/tensor_file.h"
#include "formats/file/file_statements.h"
#include "formats/layered/opened_picture.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::test {
namespace {

constexpr const char* kArrayMaterial =
    "`base_color`, `metallic`, `roughness`, `double_sided`, as in glTF; `alpha_mode`: OPAQUE, "
    "MASK, BLEND; `mode`: triangles, lines, points; `name`, `arrays_version`, `format`";
constexpr const char* kArrayOtherContent = "other arrays and texts, nothing to draw";
constexpr const char* kArrayBrokenScene =
    "no `vertices`, other shapes, types or words, non-finite or out-of-range numbers, indices of "
    "no vertex, a texture without `uv`, arrays that overlap, have gaps or end early";
constexpr const char* kArrayPicture = "[all texts and arrays of pictures](#pictures-as-arrays)";
constexpr const char* kArrayBrokenLayers =
    "other shapes or types, windows missing or of other sizes, lists unsorted or incomplete, "
    "infinite or NaN Z, invalid texts";

/// Returns the arrays of a triangle, after applying `change`.
TensorFile scene(const std::function<void(TensorFile&)>& change = [](TensorFile&) {}) {
    TensorFile file;
    file.set<float>("vertices", "F32", {3, 3}, {0, 0, 0, 1, 0, 0, 0, 1, 0});
    change(file);
    return file;
}

/// Returns layers of 2 × 1 pixels, with 1 and 2 fragments.
TensorFile layers(const std::function<void(TensorFile&)>& change = [](TensorFile&) {}) {
    TensorFile file;
    file.texts = {{"displayWindow", "[2, 1]"}, {"dataWindow", "[0, 0, 2, 1]"}};
    file.set<std::int32_t>("splits", "I32", {3}, {0, 1, 3});
    file.set<float>("z", "F32", {3}, {1, 2, 3});
    file.set<float>("rgba", "F32", {3, 4}, std::vector<float>(12, 0.5F));
    change(file);
    return file;
}

TEST(Statements, OfScenesAsArrays) {
    const std::string name = "a.safetensors";
    const auto given = [&](const char* says, const char* becomes, auto&& change) {
        return Statement{says, becomes, name, scene(change).bytes()};
    };
    const auto text = [](const char* key, const char* value) {
        return [=](TensorFile& file) { file.texts[key] = value; };
    };
    const std::string whole = scene().bytes();
    const std::vector<Statement> statements = {
        {"`vertices` (n, 3), floats or integers of 32 or 64 bits, world space", "read", name,
         whole},
        given("`faces` (m, 3), integers; (m, 2): lines, (m, 1): points; default: vertices in order",
              "read",
              [](TensorFile& f) {
                  f.set<std::int64_t>("faces", "I64", {1, 3}, {2, 1, 0});
              }),
        given("`normals` (n, 3); `uv` (n, 2), V from the top", "read",
              [](TensorFile& f) {
                  f.set<float>("normals", "F32", {3, 3}, {0, 0, 1, 0, 0, 1, 0, 0, 1});
                  f.set<float>("uv", "F32", {3, 2}, {0, 0, 1, 0, 0, 1});
              }),
        given("`colors` (n, 3) or (n, 4), linear: floats 0 to 1, uint8, uint16", "read",
              [](TensorFile& f) {
                  f.set<std::uint8_t>("colors", "U8", {3, 3}, std::vector<std::uint8_t>(9, 255));
              }),
        given("`texture` (h, w, 3) or (h, w, 4), uint8, sRGB, straight alpha", "read",
              [](TensorFile& f) {
                  f.set<float>("uv", "F32", {3, 2}, {0, 0, 1, 0, 0, 1});
                  f.set<std::uint8_t>("texture", "U8", {1, 1, 4}, {1, 2, 3, 4});
              }),
        given(kArrayMaterial, "read",
              [](TensorFile& f) {
                  f.texts = {{"base_color", "[1, 0.5, 0, 1]"},
                             {"metallic", "1"},
                             {"roughness", "0.25"},
                             {"double_sided", "true"}};
              }),
        given(kArrayMaterial, "read",
              [](TensorFile& f) {
                  f.texts = {{"alpha_mode", "MASK"}, {"mode", "points"}, {"name", "a"}};
              }),
        given(kArrayMaterial, "read",
              [](TensorFile& f) {
                  f.texts["format"] = "pt";
                  f.set<std::int64_t>("arrays_version", "I64", {}, {2});
              }),
        given(kArrayOtherContent, "warned", text("author", "me")),
        given(kArrayOtherContent, "warned",
              [](TensorFile& f) { f.set<float>("weights", "F32", {1}, {1}); }),
        given(kArrayOtherContent, "warned",
              [](TensorFile& f) {
                  f.set<std::int64_t>("faces", "I64", {0, 3}, {});
              }),
        given(kArrayBrokenScene, "refused",
              [](TensorFile& f) {
                  f.arrays.clear();
                  f.set<float>("vertex", "F32", {1, 3}, {1, 2, 3});
              }),
        given(kArrayBrokenScene, "refused",
              [](TensorFile& f) {
                  f.set<float>("faces", "F32", {1, 3}, {0, 1, 2});
              }),
        given(kArrayBrokenScene, "refused",
              [](TensorFile& f) {
                  f.set<float>("normals", "F32", {1, 3}, {0, 1, 2});
              }),
        given(kArrayBrokenScene, "refused", text("metallic", "2")),
        given(kArrayBrokenScene, "refused",
              [](TensorFile& f) {
                  f.set<float>("vertices", "F32", {1, 3}, {0, NAN, 0});
              }),
        given(kArrayBrokenScene, "refused",
              [](TensorFile& f) {
                  f.set<std::int64_t>("faces", "I64", {1, 3}, {0, 1, 3});
              }),
        given(kArrayBrokenScene, "refused", text("mode", "quads")),
        given(kArrayBrokenScene, "refused",
              [](TensorFile& f) {
                  f.set<std::uint8_t>("texture", "U8", {1, 1, 3}, {1, 2, 3});
              }),
        {kArrayBrokenScene, "refused", name, whole.substr(0, whole.size() - 1)},
        {kArrayBrokenScene, "refused", name, whole + "x"},
    };
    expectStatements("Scenes as arrays", statements,
                     [](const std::filesystem::path& file, bool strict) {
                         SceneReadOptions options;
                         options.strict = strict;
                         return readSceneFile(file, options).warnings;
                     });
}

TEST(Statements, OfLayersAsArrays) {
    const std::string name = "a.safetensors";
    const auto given = [&](const char* says, const char* becomes, auto&& change) {
        return Statement{says, becomes, name, layers(change).bytes()};
    };
    const auto text = [](const char* key, const char* value) {
        return [=](TensorFile& file) { file.texts[key] = value; };
    };
    const auto splits = [&](const std::vector<std::int32_t>& numbers) {
        return given(kArrayBrokenLayers, "refused",
                     [=](TensorFile& f) { f.set<std::int32_t>("splits", "I32", {3}, numbers); });
    };
    const std::vector<Statement> statements = {
        {kArrayPicture, "read", name, layers().bytes()},
        given(kArrayPicture, "read",
              [](TensorFile& f) {
                  f.set<float>("opacity", "F32", {3, 3}, std::vector<float>(9, 0.5F));
              }),
        given(kArrayPicture, "read",
              [](TensorFile& f) {
                  f.texts["peeler:channels"] = R"({"id": ["id.object", "id.material"]})";
                  f.set<std::uint32_t>("id", "U32", {3, 2}, {1, 2, 3, 4, 5, 6});
              }),
        {kArrayPicture, "read", name, layers().bytes()},
        given(kArrayPicture, "read",
              [](TensorFile& f) {
                  f.texts["peeler:ids"] = R"({"objects": ["a"], "materials": []})";
                  f.texts["peeler:carried"] = R"([["note", "string", "6869"]])";
                  f.texts["comments"] = "made by hand";
              }),
        given("other arrays", "warned", [](TensorFile& f) { f.set<float>("k", "F32", {1}, {1}); }),
        given(kArrayBrokenLayers, "refused",
              [](TensorFile& f) {
                  f.set<double>("z", "F64", {3}, {1, 2, 3});
              }),
        given(kArrayBrokenLayers, "refused",
              [](TensorFile& f) {
                  f.set<float>("rgba", "F32", {4, 3}, std::vector<float>(12));
              }),
        given(kArrayBrokenLayers, "refused", [](TensorFile& f) { f.texts.erase("dataWindow"); }),
        given(kArrayBrokenLayers, "refused", text("dataWindow", "[0, 0, 3, 1]")),
        given(kArrayBrokenLayers, "refused", text("dataWindow", "[0, 0, 1e9, 1]")),
        given(kArrayBrokenLayers, "refused", text("displayWindow", "[0, 1]")),
        splits({0, 2, 1}),
        splits({0, 1, 4}),
        splits({0, 1, 2}),
        splits({1, 2, 3}),
        splits({-1, 1, 3}),
        given(kArrayBrokenLayers, "refused",
              [](TensorFile& f) {
                  f.set<float>("z", "F32", {3}, {1, 2, INFINITY});
              }),
        given(kArrayBrokenLayers, "refused",
              [](TensorFile& f) {
                  f.set<float>("z", "F32", {3}, {NAN, 2, 3});
              }),
        given(kArrayBrokenLayers, "refused", text("dataWindow", "no JSON")),
        given(kArrayBrokenLayers, "refused", text("peeler:arrays", "composite")),
        given(kArrayBrokenLayers, "refused", text("peeler:cameraJson", "{}")),
        given(kArrayBrokenLayers, "refused",
              text("peeler:ids", R"({"objects": ["a"], "materials": [], "parents": [0, 0]})")),
        given(kArrayBrokenLayers, "refused", text("peeler:carried", R"([["a", "float", "00"]])")),
        given(kArrayBrokenLayers, "refused",
              text("peeler:carried", R"([["peeler:frame", "string", "00"]])")),
        given(kArrayBrokenLayers, "refused", text("peeler:carried", R"([["a", "string", "0g"]])")),
        given(kArrayBrokenLayers, "refused",
              [](TensorFile& f) {
                  f.texts["peeler:channels"] = R"({"back": ["A"]})";
                  f.set<float>("back", "F32", {3}, {4, 5, 6});
              }),
    };
    expectStatements("Layers as arrays", statements,
                     [](const std::filesystem::path& file, bool strict) {
                         const auto input = openLayered(file.string(), {.strict = strict});
                         LayeredImage image;
                         input->read(input->info().plan.view.crop, image);
                         return input->takeWarnings();
                     });
}

}  // namespace
}  // namespace peeler::test
