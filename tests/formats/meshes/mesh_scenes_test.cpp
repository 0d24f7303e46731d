// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "core/base/color.h"
#include "formats/gltf/gltf_builder.h"
#include "formats/image/png_builder.h"
#include "formats/meshes/mesh_parts.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::test {
namespace {

using Triangle = PolygonCutter::Triangle;

// ---- polygons

/// Returns the outline, moved to the oblique plane z = x + 2 y.
std::vector<glm::vec3> tilted(const std::vector<glm::vec2>& outline) {
    std::vector<glm::vec3> corners;
    for (const glm::vec2& p : outline)
        corners.emplace_back(p.x, p.y, p.x + 2 * p.y);
    return corners;
}

double areaOf(const std::vector<glm::vec3>& corners, const Triangle& t) {
    const auto at = [&](std::size_t i) { return glm::dvec3(corners[t[i]]); };
    return glm::cross(at(1) - at(0), at(2) - at(0)).z / 2;
}

/// Triangulates the polygon. Expects triangles of the polygon's orientation and total area.
std::vector<Triangle> expectCut(const std::vector<glm::vec2>& outline, double area) {
    const std::vector<glm::vec3> corners = tilted(outline);
    PolygonCutter cutter;
    const auto found = cutter.cut(corners);
    std::vector<Triangle> triangles(found.begin(), found.end());
    EXPECT_EQ(triangles.size(), outline.size() - 2);
    double sum = 0;
    for (const Triangle& triangle : triangles) {
        EXPECT_GE(areaOf(corners, triangle) * (area > 0 ? 1 : -1), 0);
        sum += areaOf(corners, triangle);
    }
    EXPECT_NEAR(sum, area, 1e-5 * std::abs(area));
    return triangles;
}

TEST(Polygons, ConvexOnesAreFans) {
    EXPECT_EQ(expectCut({{0, 0}, {1, 0}, {1, 1}, {0, 1}}, 1),
              (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
    EXPECT_EQ(expectCut({{0, 0}, {0, 1}, {1, 1}, {1, 0}}, -1),
              (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(Polygons, ConcaveOnesAreCovered) {
    expectCut({{0, 0}, {4, 0}, {1, 1}, {0, 4}}, 4);                                  // an arrowhead
    expectCut({{0, 0}, {3, 0}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}}, 7);  // a U
    std::vector<glm::vec2> star, comb;
    for (int i = 0; i < 14; ++i) {
        const double angle = std::numbers::pi * i / 7, radius = i % 2 == 0 ? 2 : 0.5;
        star.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
    expectCut(star, 7 * 2 * 0.5 * std::sin(std::numbers::pi / 7));
    for (int i = 0; i < 100; ++i)
        comb.emplace_back(i, i % 2 == 0 ? 0 : 5);
    comb.emplace_back(99, 6);
    comb.emplace_back(0, 6);
    expectCut(comb, 99 * 6 - 99 * 2.5);
}

TEST(Polygons, WithCornersOnALineRepeatedOnesAndBridges) {
    expectCut({{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}, 4);
    expectCut({{0, 0}, {1, 0}, {1, 0}, {1, 1}, {0, 1}}, 1);
    // A bridge joins the hole to a corner of the square.
    expectCut({{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 1}, {1, 3}, {3, 3}, {3, 1}, {1, 1}}, 12);
}

TEST(Polygons, OfNoAreaHaveTheirNumberToo) {
    PolygonCutter cutter;
    const std::vector<glm::vec3> line = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}};
    EXPECT_EQ(cutter.cut(line).size(), 3U);
    EXPECT_EQ(cutter.cut(std::vector<glm::vec3>(6, glm::vec3(1))).size(), 4U);
    EXPECT_EQ(cutter.cut(std::span(line).first(2)).size(), 0U);
    EXPECT_EQ(cutter.cut({}).size(), 0U);
}

// ---- files

class MeshScenes : public testing::Test {
  protected:
    Scene read(const std::string& name, const std::string& text,
               const SceneReadOptions& options = {}) {
        writeFile(folder_ / name, text);
        return readSceneFile(folder_ / name, options);
    }
    ScratchDir folder_;
};

TEST_F(MeshScenes, OfAPlyWithAllThatVerticesHave) {
    const Scene scene = read(
        "a.ply",
        "ply\r\nformat ascii 1.0\r\nelement vertex 4\r\nproperty float nx\r\nproperty float "
        "ny\r\nproperty float nz\r\nproperty double x\r\nproperty float y\r\nproperty float "
        "z\r\nproperty uchar red\r\nproperty uchar green\r\nproperty uchar blue\r\nproperty "
        "uchar alpha\r\nproperty float s\r\nproperty float t\r\nelement strange "
        "1\r\nproperty list int double q\r\nelement face 2\r\nproperty uchar flags\r\nproperty "
        "list ushort uint vertex_index\r\nend_header\r\n"
        "0 0 1 0 0 0 255 0 128 255 0 0\r\n0 0 1 1 0 0 0 0 0 255 1 0.25\r\n"
        "0 0 1 1 1 0 0 0 0 51 1 1\r\n0 0 1 0 1 0 0 0 0 255 0 1\r\n"
        "2 1 2\r\n7 4 0 1 2 3\r\n7 3 2 1 0");
    ASSERT_EQ(scene.meshes.size(), 1U);
    const Primitive& mesh = scene.meshes[0].primitives.at(0);
    EXPECT_EQ(mesh.indices, (std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3, 2, 1, 0}));
    EXPECT_EQ(mesh.positions[2], glm::vec3(1, 1, 0));
    EXPECT_EQ(mesh.normals[0], glm::vec3(0, 0, 1));
    EXPECT_EQ(mesh.texcoords[0][1], glm::vec2(1, 0.75F));
    EXPECT_EQ(mesh.colors[0].r, 1);
    EXPECT_EQ(mesh.colors[0].b, linearFromSrgb(128 / 255.0F));
    EXPECT_EQ(mesh.colors[2].a, 51 / 255.0F);
    const Material& material = scene.materials[static_cast<std::size_t>(mesh.material)];
    EXPECT_EQ(material.alpha_mode, AlphaMode::kBlend);
    EXPECT_EQ(material.base_color, glm::vec4(1));
    EXPECT_TRUE(material.double_sided);
    ASSERT_EQ(scene.warnings.size(), 1U);
    EXPECT_TRUE(contains(scene.warnings[0], "strange"));
}

TEST_F(MeshScenes, OfAPlyWithTextureCoordinatesAtCorners) {
    const Scene scene = read(
        "a.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
        "float z\nelement face 2\nproperty list uchar int vertex_indices\nproperty list uchar "
        "float texcoord\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0 1 0 0 1\n"
        "3 0 1 2 6 0 0 1 0 1 1\n");
    const Primitive& mesh = scene.meshes[0].primitives[0];
    EXPECT_EQ(mesh.indices, (std::vector<std::uint32_t>{0, 1, 2, 0, 1, 3}));
    EXPECT_EQ(mesh.texcoords[0][2], glm::vec2(0, 0));
    EXPECT_EQ(mesh.texcoords[0][3], glm::vec2(1, 0));
    EXPECT_EQ(mesh.positions[3], mesh.positions[2]);
}

TEST_F(MeshScenes, OfStripsOfAPly) {
    const Scene scene = read(
        "a.ply",
        "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty "
        "float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 2 0\n8 0 1 2 3 -1 2 3 4\n");
    EXPECT_EQ(scene.meshes[0].primitives[0].indices,
              (std::vector<std::uint32_t>{0, 1, 2, 2, 1, 3, 2, 3, 4}));
}

TEST_F(MeshScenes, OfAPlyWhoseLinesEndByCarriageReturnsAlone) {
    // The first byte of data is a line feed. The reader must not treat it as part of the header's
    // last line end.
    const float coordinates[] = {std::bit_cast<float>(0x3F80000AU), 0, 0, 0, 1, 0, 0, 0, 1};
    const std::string data(reinterpret_cast<const char*>(coordinates), sizeof coordinates);
    const std::string face("\x03\0\0\0\0\1\0\0\0\2\0\0\0", 13);
    std::string header =
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float "
        "y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
    std::ranges::replace(header, '\n', '\r');
    const Scene scene = read("a.ply", header + data + face);
    const Primitive& mesh = scene.meshes.at(0).primitives.at(0);
    EXPECT_EQ(mesh.indices, (std::vector<std::uint32_t>{0, 1, 2}));
    EXPECT_EQ(mesh.positions[0], glm::vec3(coordinates[0], 0, 0));
    EXPECT_EQ(mesh.positions[2], glm::vec3(0, 0, 1));
}

TEST_F(MeshScenes, OfASoupHaveAVertexForEqualBitsAlone) {
    const Scene scene =
        read("a.stl",
             "solid a part\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 "
             "0\nvertex 0 1 0\nendloop\nendfacet\nfacet normal 0 0 1\nouter "
             "loop\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 "
             "1e-30\nendloop\nendfacet\nendsolid a part\n");
    const Primitive& mesh = scene.meshes[0].primitives[0];
    EXPECT_EQ(mesh.indices, (std::vector<std::uint32_t>{0, 1, 2, 1, 3, 4}));
    EXPECT_EQ(scene.nodes[0].name, "a part");
    EXPECT_EQ(scene.materials.size(), 2U);
    EXPECT_TRUE(scene.materials[0].double_sided);
}

TEST_F(MeshScenes, OfAnObjKeepTheOrderOfItsFaces) {
    const Scene scene = read("a.obj",
                             "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0.25\nusemtl x\nf 1 2 3\n"
                             "usemtl y\nf 1/1 3/1 4/-1\nusemtl x\nf -4 \\\n-3 -2 -1\n");
    ASSERT_EQ(scene.meshes.size(), 1U);
    const std::vector<Primitive>& parts = scene.meshes[0].primitives;
    // A new part begins where the material changes, and where faces begin or cease to have texture
    // coordinates.
    ASSERT_EQ(parts.size(), 3U);
    EXPECT_EQ(parts[0].indices.size(), 3U);
    EXPECT_EQ(parts[1].texcoords[0][0], glm::vec2(0, 0.75F));
    EXPECT_EQ(parts[2].indices.size(), 6U);
}

TEST_F(MeshScenes, OfAnObjHaveTheMaterialsOfItsMtl) {
    writeFile(folder_ / "m.mtl",
              "# materials\nnewmtl shiny red\n Kd 0.5 0 0\n d 0.25\n Ns 96\n Ke 3 0 0\nnewmtl "
              "pbr\nKd 1\nPr 0.5\nPm 0.75\nTr 0.5\n");
    const Scene scene = read("a.obj",
                             "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl shiny red\nf 1 2 3\n"
                             "usemtl pbr\nf 1 2 3\n");
    ASSERT_EQ(scene.materials.size(), 3U);
    const Material& red = scene.materials[0];
    EXPECT_EQ(red.base_color, glm::vec4(0.5F, 0, 0, 0.25F));
    EXPECT_FLOAT_EQ(red.roughness, std::pow(2.0F / 98, 0.25F));
    EXPECT_EQ(red.metallic, 0);
    EXPECT_EQ(red.emissive, glm::vec3(3, 0, 0));
    EXPECT_EQ(red.alpha_mode, AlphaMode::kBlend);
    const Material& pbr = scene.materials[1];
    EXPECT_EQ(pbr.base_color, glm::vec4(1, 1, 1, 0.5F));
    EXPECT_EQ(pbr.roughness, 0.5F);
    EXPECT_EQ(pbr.metallic, 0.75F);
    EXPECT_TRUE(scene.warnings.empty());
    ASSERT_EQ(scene.files.size(), 1U);
    EXPECT_EQ(scene.files[0].filename(), "m.mtl");
}

TEST_F(MeshScenes, OfAnObjHaveTheTexturesOfItsMtl) {
    writeFile(folder_ / "two colours.png", png(2, 1, PngColor::kRgb, 8, {10, 20, 30, 40, 50, 60}));
    writeFile(folder_ / "grey.png", png(1, 2, PngColor::kRgb, 8, {200, 1, 2, 100, 3, 4}));
    writeFile(folder_ / "m.mtl",
              "newmtl m\nKd 0 0 0\nmap_Kd -s 2 3 -o 0.5 0.25 -clamp on two colours.png\n"
              "map_d grey.png\nmap_Pr grey.png\nmap_Ke gone.png\nnorm -bm 0.5 two colours.png\n");
    const Scene scene = read("a.obj",
                             "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
                             "usemtl m\nf 1/1 2/2 3/3\n");
    const Material& material = scene.materials.at(0);
    EXPECT_EQ(material.base_color, glm::vec4(1)) << "black beside a texture";
    EXPECT_EQ(material.alpha_mode, AlphaMode::kBlend);
    const auto imageOf = [&](const TextureRef& texture) -> const Image& {
        return scene.images.at(static_cast<std::size_t>(texture.image));
    };
    // The colours are from one texture and alpha is from the other, at the larger of the two sizes.
    const TextureRef& colors = material.base_color_texture;
    EXPECT_EQ(imageOf(colors).width, 2);
    EXPECT_EQ(imageOf(colors).height, 2);
    EXPECT_EQ(imageOf(colors).rgba,
              (Bytes{10, 20, 30, 200, 40, 50, 60, 200, 10, 20, 30, 100, 40, 50, 60, 100}));
    EXPECT_EQ(colors.sampler.wrap_s, 33071);
    // MTL maps (u, v) to (2 u + 0.5, 3 v + 0.25). OBJ counts V from the bottom, glTF from the top.
    EXPECT_EQ(colors.transform[0][0], 2);
    EXPECT_EQ(colors.transform[1][1], 3);
    EXPECT_EQ(colors.transform[2][0], 0.5F);
    EXPECT_EQ(colors.transform[2][1], 1 - 3 - 0.25F);
    EXPECT_EQ(material.roughness, 1) << "the map alone";
    EXPECT_EQ(material.metallic, 0);
    EXPECT_EQ(imageOf(material.metallic_roughness_texture).rgba,
              (Bytes{255, 200, 255, 255, 255, 100, 255, 255}));
    EXPECT_EQ(material.normal_scale, 0.5F);
    EXPECT_EQ(imageOf(material.normal_texture).rgba, (Bytes{10, 20, 30, 255, 40, 50, 60, 255}));
    EXPECT_FALSE(material.emissive_texture);
    ASSERT_EQ(scene.warnings.size(), 1U);
    EXPECT_TRUE(contains(scene.warnings[0], "\"gone.png\" is left out")) << scene.warnings[0];
}

TEST_F(MeshScenes, AreTurnedAndScaledByTheirNodes) {
    SceneReadOptions options;
    options.up = Axis::kZ;
    options.metres_per_unit = 0.5;
    const Scene scene = read("a.obj", "v 1 2 3\nv 0 0 0\nv 1 0 0\nf 1 2 3\n", options);
    const glm::dvec4 corner(glm::dvec3(scene.meshes[0].primitives[0].positions[0]), 1);
    EXPECT_EQ(glm::dvec3(scene.nodes[0].local * corner), glm::dvec3(0.5, 1.5, -1));
    options.up = Axis::kX;
    const Scene other = read("a.obj", "v 1 2 3\nv 0 0 0\nv 1 0 0\nf 1 2 3\n", options);
    EXPECT_EQ(glm::dvec3(other.nodes[0].local * corner), glm::dvec3(-1, 0.5, 1.5));
}

/// At 80 degrees no edge of a box is smooth; at 100 degrees all are.
TEST_F(MeshScenes, AreSmoothWithinAnAngle) {
    const std::string box =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
        "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 4 1 5 8\n";
    SceneReadOptions options;
    options.smooth_normals = 80;
    const Primitive sharp = read("a.obj", box, options).meshes[0].primitives[0];
    EXPECT_EQ(sharp.positions.size(), 24U);
    for (const glm::vec3& normal : sharp.normals)
        EXPECT_EQ(std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z), 1);
    options.smooth_normals = 100;
    const Primitive round = read("a.obj", box, options).meshes[0].primitives[0];
    ASSERT_EQ(round.positions.size(), 8U);
    for (std::size_t i = 0; i < 8; ++i) {
        const glm::vec3 outwards = glm::normalize(round.positions[i] - glm::vec3(0.5F));
        EXPECT_NEAR(glm::dot(round.normals[i], outwards), 1, 1e-6);
    }
}

TEST_F(MeshScenes, KeepToTheirFolderAndTheirLimits) {
    ScratchDir outside;
    writeFile(outside / "m.mtl", "newmtl m\nKd 1 0 0\n");
    const std::string obj = "mtllib " + (outside / "m.mtl").string() +
                            "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n";
    EXPECT_TRUE(contains(read("a.obj", obj).warnings.at(0), "absolute path"));
    SceneReadOptions options;
    options.strict = true;
    EXPECT_THROW(read("a.obj", obj, options), Error);
    options.allow_outside = true;
    EXPECT_EQ(read("a.obj", obj, options).materials.at(0).base_color, glm::vec4(1, 0, 0, 1));
    options.max_geometry_bytes = 1000;
    EXPECT_THROW(read("a.obj", obj, options), Error);
}

}  // namespace
}  // namespace peeler::test
