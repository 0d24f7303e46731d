// SPDX-License-Identifier: Apache-2.0
// Tests the table for PLY in formats/README.md, "Supported content".
#include "formats/file/file_statements.h"
#include "formats/image/png_builder.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::test {
namespace {

constexpr const char* kPlyShapes =
    "text or binary, any byte order and line ends; `face` with `vertex_indices` or "
    "`vertex_index`, `tristrips`; vertices alone (points)";
constexpr const char* kPlySurfaces =
    "normals `nx ny nz`; texture coordinates `s t`, `u v`, `texture_u texture_v`, per corner "
    "`texcoord`; `comment TextureFile`; per face `texnumber` (−1: none)";
constexpr const char* kPlyColours =
    "colours of vertices or faces: `red green blue alpha`, `r g b a`, `diffuse_red` …; sRGB, "
    "multiplied by a texture; white is 255 for bytes, else the least of 1, 255 and 65,535 that "
    "fits";
constexpr const char* kPlyPassedOver =
    "ignored: other comments, `obj_info`, other properties of vertices and faces";
constexpr const char* kPlyOddNumbers =
    "other colour values, colours of both faces and vertices, non-finite numbers except positions, "
    "incomplete sets (`nx` alone, some properties of splats)";
constexpr const char* kPlyLostTextures =
    "missing textures, unknown `texnumber`, several textures without it, textures or faces without "
    "coordinates";
constexpr const char* kPlyLeftOut =
    "other elements (`edge`, `material`, `camera`, `range_grid` …), faces of under three corners, "
    "bytes behind the end, nothing to draw";
constexpr const char* kPlyBroken =
    "non-finite positions, no `vertex` with x, y, z, faces before vertices or without corners, "
    "indices of no vertex, unknown types or header lines, truncation";

/// A PLY of a triangle. `vertex` declares properties after x, y, z, and `vertex_data` has their
/// values. `face` and `face_data` do the same for faces. `more` and `data` are elements after the
/// faces. `comment` precedes the elements.
struct PlyText {
    std::string vertex{}, vertex_data{}, face{}, face_data{}, more{}, data{}, comment{};

    std::string text() const {
        return "ply\nformat ascii 1.0\n" + comment +
               "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n" + vertex +
               "element face 1\nproperty list uchar int vertex_indices\n" + face + more +
               "end_header\n0 0 0 " + vertex_data + "\n1 0 0 " + vertex_data + "\n0 1 0 " +
               vertex_data + "\n3 0 1 2 " + face_data + "\n" + data;
    }
};

std::string asString(const Bytes& bytes) {
    return {bytes.begin(), bytes.end()};
}

constexpr char kRgb[] = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
constexpr char kUvs[] = "property list uchar float texcoord\n";
constexpr char kTexture[] = "comment TextureFile a.png\n";

TEST(Statements, OfAPly) {
    const std::string name = "a.ply";
    const std::map<std::string, std::string> beside = {
        {"a.png", asString(png(1, 1, PngColor::kRgb, 8, {1, 2, 3}))},
        {"b.png", asString(png(1, 1, PngColor::kRgb, 8, {4, 5, 6}))}};
    const auto ply = [](const PlyText& text) { return text.text(); };
    const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
    const auto cloud = [&](const std::string& properties, const std::string& data) {
        return "ply\nformat ascii 1.0\nelement vertex 1\n" + xyz + properties + "end_header\n" +
               data + "\n";
    };
    const auto integers = [](const std::string& type) {
        return "property " + type + " red\nproperty " + type + " green\nproperty " + type +
               " blue\n";
    };
    const std::vector<Statement> statements = {
        {kPlyShapes, "read", name,
         ply({.comment = "format binary_big_endian 1.0\nformat ascii 1.0\n"})},
        {kPlyPassedOver, "read", name, ply({.comment = "comment a\nobj_info b\n"})},
        {kPlyShapes, "read", name, ply({})},
        {kPlyShapes, "read", name,
         ply({.more = "element tristrips 1\nproperty list int int vertex_indices\n",
              .data = "3 0 1 2\n"})},
        {kPlyShapes, "read", name, cloud("", "0 0 0")},
        {kPlySurfaces, "read", name,
         ply({.vertex = "property float nx\nproperty float ny\nproperty float nz\n",
              .vertex_data = "0 0 1"})},
        {kPlyOddNumbers, "warned", name,
         ply({.vertex = "property float nx\nproperty float ny\nproperty float nz\n",
              .vertex_data = "0 nan 1"})},
        {kPlyColours, "read", name, ply({.vertex = kRgb, .vertex_data = "255 0 0"})},
        {kPlyColours, "read", name, ply({.vertex = integers("int"), .vertex_data = "255 0 0"})},
        {kPlyColours, "read", name,
         ply({.vertex = integers("ushort"), .vertex_data = "65535 0 0"})},
        {kPlyColours, "read", name, ply({.vertex = integers("float"), .vertex_data = "255 0 0"})},
        {kPlyOddNumbers, "warned", name,
         ply({.vertex = integers("float"), .vertex_data = "1.5 0 0"})},
        {kPlySurfaces, "read", name,
         ply({.vertex = "property float s\nproperty float t\n", .vertex_data = "0 1"})},
        {kPlyOddNumbers, "warned", name,
         ply({.vertex = "property float s\nproperty float t\n", .vertex_data = "0 inf"})},
        {kPlyOddNumbers, "warned", name,
         ply({.vertex = "property float nx\n", .vertex_data = "0"})},
        {kPlyOddNumbers, "warned", name,
         cloud("property float f_dc_0\nproperty float opacity\n", "0 0 0 1 1")},
        {kPlyPassedOver, "read", name,
         ply({.vertex = "property float quality\n",
              .vertex_data = "7",
              .face = "property int flags\n",
              .face_data = "1"})},
        {kPlyColours, "read", name, ply({.face = kRgb, .face_data = "255 0 0"})},
        {kPlyOddNumbers, "warned", name,
         ply({.vertex = kRgb, .vertex_data = "255 0 0", .face = kRgb, .face_data = "255 0 0"})},
        {kPlySurfaces, "read", name, ply({.face = kUvs, .face_data = "6 0 0 1 0 0 1"})},
        {kPlyLostTextures, "warned", name, ply({.face = kUvs, .face_data = "0"})},
        {kPlySurfaces, "read", name,
         ply({.face = kUvs, .face_data = "6 0 0 1 0 0 1", .comment = kTexture}), beside},
        {kPlyLostTextures, "warned", name,
         ply({.face = kUvs, .face_data = "6 0 0 1 0 0 1", .comment = kTexture})},
        {kPlyLostTextures, "warned", name, ply({.comment = kTexture}), beside},
        {kPlySurfaces, "read", name,
         ply({.face = std::string(kUvs) + "property int texnumber\n",
              .face_data = "6 0 0 1 0 0 1 1",
              .comment = std::string(kTexture) + "comment TextureFile b.png\n"}),
         beside},
        {kPlyLostTextures, "warned", name,
         ply({.face = std::string(kUvs) + "property int texnumber\n",
              .face_data = "6 0 0 1 0 0 1 2",
              .comment = kTexture}),
         beside},
        {kPlyLostTextures, "warned", name,
         ply({.face = kUvs,
              .face_data = "6 0 0 1 0 0 1",
              .comment = std::string(kTexture) + "comment TextureFile b.png\n"}),
         beside},
        {kPlyLeftOut, "warned", name,
         ply({.more = "element edge 1\nproperty int vertex1\nproperty int vertex2\n",
              .data = "0 1\n"})},
        {kPlyLeftOut, "warned", name,
         ply({.more = "element tristrips 0\nproperty list int int vertex_indices\nelement face "
                      "1\nproperty list uchar int vertex_indices\n",
              .data = "2 0 1\n"})},
        {kPlyLeftOut, "warned", name, ply({.data = "more\n"})},
        {kPlyLeftOut, "warned", name,
         "ply\nformat ascii 1.0\nelement vertex 0\n" + xyz + "end_header\n"},
        {kPlyBroken, "refused", name, cloud("", "0 nan 0")},
        {kPlyBroken, "refused", name,
         "ply\nformat ascii 1.0\nelement vertices 1\n" + xyz + "end_header\n0 0 0\n"},
        {kPlyBroken, "refused", name,
         "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n"},
        {kPlyBroken, "refused", name,
         ply({.more = "element tristrips 1\nproperty int q\n", .data = "1\n"})},
        {kPlyBroken, "refused", name,
         ply({.more = "element tristrips 1\nproperty list int int vertex_indices\n",
              .data = "3 0 1 3\n"})},
        {kPlyBroken, "refused", name, ply({.vertex = "property long q\n", .vertex_data = "1"})},
        {kPlyBroken, "refused", name, ply({}).substr(0, ply({}).size() - 4)},
    };
    expectStatements("PLY", statements, [](const std::filesystem::path& file, bool strict) {
        SceneReadOptions options;
        options.strict = strict;
        return readSceneFile(file, options).warnings;
    });
}

}  // namespace
}  // namespace peeler::test
