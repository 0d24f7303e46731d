// SPDX-License-Identifier: Apache-2.0
// Handling of every statement of a PLY (formats/README.md).
#include "formats/file/file_statements.h"
#include "formats/image/png_builder.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::test {
namespace {

/// A PLY of a triangle: vertex properties after x, y, z and their values, the same for faces,
/// elements after them, comments before them.
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
    const std::string name = "a.ply", points = "vertices without faces are points";
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
        {"text, binary of either byte order, any end of line", "read", name,
         ply({.comment = "format binary_big_endian 1.0\nformat ascii 1.0\n"})},
        {"`comment`, `obj_info`", "read", name, ply({.comment = "comment a\nobj_info b\n"})},
        {"polygons: `face` with `vertex_indices` or `vertex_index`", "read", name, ply({})},
        {"strips: `tristrips`", "read", name,
         ply({.more = "element tristrips 1\nproperty list int int vertex_indices\n",
              .data = "3 0 1 2\n"})},
        {points, "read", name, cloud("", "0 0 0")},
        {"normals `nx ny nz`", "read", name,
         ply({.vertex = "property float nx\nproperty float ny\nproperty float nz\n",
              .vertex_data = "0 0 1"})},
        {"normals that are not finite", "warned", name,
         ply({.vertex = "property float nx\nproperty float ny\nproperty float nz\n",
              .vertex_data = "0 nan 1"})},
        {"colours `red green blue alpha`, `r g b a`, `diffuse_red` …", "read", name,
         ply({.vertex = kRgb, .vertex_data = "255 0 0"})},
        {"colours of any type, to 1, 255 or 65,535", "read", name,
         ply({.vertex = integers("int"), .vertex_data = "255 0 0"})},
        {"colours of any type, to 1, 255 or 65,535", "read", name,
         ply({.vertex = integers("ushort"), .vertex_data = "65535 0 0"})},
        {"colours of any type, to 1, 255 or 65,535", "read", name,
         ply({.vertex = integers("float"), .vertex_data = "255 0 0"})},
        {"other numbers of colours", "warned", name,
         ply({.vertex = integers("float"), .vertex_data = "1.5 0 0"})},
        {"texture coordinates `s t`, `u v`, `texture_u texture_v`", "read", name,
         ply({.vertex = "property float s\nproperty float t\n", .vertex_data = "0 1"})},
        {"colours and texture coordinates that are not finite", "warned", name,
         ply({.vertex = "property float s\nproperty float t\n", .vertex_data = "0 inf"})},
        {"some components of a set alone", "warned", name,
         ply({.vertex = "property float nx\n", .vertex_data = "0"})},
        {"Gaussian splats", "warned", name,
         cloud("property float f_dc_0\nproperty float opacity\nproperty float scale_0\nproperty "
               "float rot_0\n",
               "0 0 0 1 1 1 1")},
        {"other properties of vertices and faces", "read", name,
         ply({.vertex = "property float quality\n",
              .vertex_data = "7",
              .face = "property int flags\n",
              .face_data = "1"})},
        {"colours of faces", "read", name, ply({.face = kRgb, .face_data = "255 0 0"})},
        {"colours of faces and of vertices", "warned", name,
         ply({.vertex = kRgb, .vertex_data = "255 0 0", .face = kRgb, .face_data = "255 0 0"})},
        {"texture coordinates of corners: `texcoord`", "read", name,
         ply({.face = kUvs, .face_data = "6 0 0 1 0 0 1"})},
        {"faces without texture coordinates among such", "warned", name,
         ply({.face = kUvs, .face_data = "0"})},
        {"`comment TextureFile`", "read", name,
         ply({.face = kUvs, .face_data = "6 0 0 1 0 0 1", .comment = kTexture}), beside},
        {"a texture that cannot be had", "warned", name,
         ply({.face = kUvs, .face_data = "6 0 0 1 0 0 1", .comment = kTexture})},
        {"a texture without texture coordinates", "warned", name, ply({.comment = kTexture}),
         beside},
        {"several textures, and `texnumber` of faces", "read", name,
         ply({.face = std::string(kUvs) + "property int texnumber\n",
              .face_data = "6 0 0 1 0 0 1 1",
              .comment = std::string(kTexture) + "comment TextureFile b.png\n"}),
         beside},
        {"a `texnumber` of no texture", "warned", name,
         ply({.face = std::string(kUvs) + "property int texnumber\n",
              .face_data = "6 0 0 1 0 0 1 2",
              .comment = kTexture}),
         beside},
        {"several textures without `texnumber`", "warned", name,
         ply({.face = kUvs,
              .face_data = "6 0 0 1 0 0 1",
              .comment = std::string(kTexture) + "comment TextureFile b.png\n"}),
         beside},
        {"other elements: `edge`, `material`, `camera`, `range_grid` …", "warned", name,
         ply({.more = "element edge 1\nproperty int vertex1\nproperty int vertex2\n",
              .data = "0 1\n"})},
        {"faces of fewer than three corners", "warned", name,
         ply({.more = "element tristrips 0\nproperty list int int vertex_indices\nelement face "
                      "1\nproperty list uchar int vertex_indices\n",
              .data = "2 0 1\n"})},
        {"bytes behind the last element", "warned", name, ply({.data = "more\n"})},
        {"no faces and no vertices", "warned", name,
         "ply\nformat ascii 1.0\nelement vertex 0\n" + xyz + "end_header\n"},
        {"positions that are not finite", "refused", name, cloud("", "0 nan 0")},
        {"no element `vertex`, or vertices without x, y and z", "refused", name,
         "ply\nformat ascii 1.0\nelement vertices 1\n" + xyz + "end_header\n0 0 0\n"},
        {"no element `vertex`, or vertices without x, y and z", "refused", name,
         "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n"},
        {"faces before vertices, or without a list of corners", "refused", name,
         ply({.more = "element tristrips 1\nproperty int q\n", .data = "1\n"})},
        {"indices of no vertex", "refused", name,
         ply({.more = "element tristrips 1\nproperty list int int vertex_indices\n",
              .data = "3 0 1 3\n"})},
        {"unknown types and lines of the header", "refused", name,
         ply({.vertex = "property long q\n", .vertex_data = "1"})},
        {"an end within the data", "refused", name, ply({}).substr(0, ply({}).size() - 4)},
    };
    expectStatements("PLY", statements, [](const std::filesystem::path& file, bool strict) {
        SceneReadOptions options;
        options.strict = strict;
        return readSceneFile(file, options).warnings;
    });
}

}  // namespace
}  // namespace peeler::test
