// SPDX-License-Identifier: Apache-2.0
// Mesh seeds: PLY, STL and OBJ files of every kind.
#include "formats/arrays/tensor_file.h"
#include "formats/cameras/camera_files.h"
#include "fuzz/seeds.h"

namespace peeler::fuzz {
namespace {

using test::PackedNumbers;

constexpr const char* kPlyVertices =
    "property float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar "
    "green\nproperty uchar blue\nproperty uchar alpha\n";

std::string binaryPly() {
    PackedNumbers data;
    for (const float corner : {0.0F, 1.0F, 2.0F, 3.0F}) {
        data.add(corner).add(corner * corner).add(0.5F);
        data.add<std::uint32_t>(0x80FF4020);
    }
    data.add<std::uint8_t>(4).add<std::int32_t>(0).add<std::int32_t>(1).add<std::int32_t>(2);
    data.add<std::int32_t>(3).add<std::uint8_t>(8);
    for (int i = 0; i < 8; ++i)
        data.add(0.125F);
    return std::string("ply\nformat binary_little_endian 1.0\ncomment TextureFile scene.mtl\n") +
           "element vertex 4\n" + kPlyVertices +
           "element face 1\nproperty list uchar int vertex_indices\nproperty list uchar float "
           "texcoord\nend_header\n" +
           data.text;
}

std::string binaryStl() {
    PackedNumbers file;
    file.text = std::string(80, ' ');
    file.add<std::uint32_t>(2);
    for (int facet = 0; facet < 2; ++facet) {
        for (int i = 0; i < 12; ++i)
            file.add(static_cast<float>((i * 7 + facet) % 5));
        file.add<std::uint16_t>(0x8123);
    }
    return file.text;
}

std::string arrayScene() {
    test::TensorFile file;
    file.texts = {{"alpha_mode", "BLEND"}, {"base_color", "[1, 1, 1, 0.5]"}, {"mode", "triangles"},
                  {"name", "a"},           {"double_sided", "true"},         {"more", "b"}};
    file.set<float>("vertices", "F32", {3, 3}, {0, 0, 0, 1, 0, 0, 0, 1, 0});
    file.set<std::int64_t>("faces", "I64", {1, 3}, {0, 1, 2});
    file.set<float>("uv", "F32", {3, 2}, {0, 0, 1, 0, 0, 1});
    file.set<std::uint8_t>("texture", "U8", {1, 2, 3}, {1, 2, 3, 4, 5, 6});
    file.set<std::uint8_t>("colors", "U8", {3, 3}, std::vector<std::uint8_t>(9, 200));
    return file.bytes();
}

}  // namespace

void addMeshSeeds(Seeds& seeds) {
    const std::string ply = std::string("ply\nformat ascii 1.0\nelement vertex 5\n") + kPlyVertices;
    const std::string corners =
        "0 0 0 1 2 3 4\n2 0 0 5 6 7 8\n2 2 0 9 9 9 9\n1 1 0 0 0 0 0\n0 2 0 1 1 1 1\n";
    for (const std::string& seed : {
             arrayScene(),
             binaryPly(),
             ply + "element face 2\nproperty list uchar int vertex_indices\nend_header\n" +
                 corners + "5 0 1 2 3 4\n3 0 1 2\n",
             ply + "element tristrips 1\nproperty list int int vertex_indices\nend_header\n" +
                 corners + "7 0 1 2 3 -1 4 2\n",
             ply + "comment TextureFile a.png\ncomment TextureFile b.png\nelement face 2\n" +
                 "property list uchar int vertex_indices\nproperty list uchar float texcoord\n" +
                 "property int texnumber\nend_header\n" + corners +
                 "3 0 1 2 6 0 0 1 0 1 1 1\n3 0 2 3 6 0 0 1 1 0 1 0\n",
             std::string(
                 "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float "
                 "y\nproperty float z\nelement face 1\nproperty list uchar int "
                 "vertex_indices\nproperty int red\nproperty int green\nproperty int "
                 "blue\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255 0 0\n"),
             std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\n#MRGB ffff0000ff00ff00ff0000ff\nvn nan 0 0\n"
                         "s 1\nf 1//1 2//1 3//1 # a\nbevel on\n"),
             ply + "element edge 1\nproperty int a\nend_header\n" + corners + "1\n",
             binaryStl(),
             std::string("solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                         "vertex 0 1 0\nendloop\nendfacet\nendsolid s\n"),
             std::string(
                 "mtllib scene.mtl\nnewmtl m\nKd 1 0 0\nd 0.5\nNs 10\nPr 0.5\nmap_Kd -s 2 2 "
                 "a.png\nv 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0\nv 0.6 0.4 0\nv 0 1 0\nvt 0 0\nvn 0 "
                 "0 1\no a\nusemtl m\nf 1/1/1 2/1/1 3/1/1\ng b\nf -5 -4 -3 -2 -1\nl 1 2 "
                 "3\np 1 2\ns 1\nf 1 2 \\\n3\n"),
         })
        seeds["meshes"].push_back(seedOf(seed));
}

}  // namespace peeler::fuzz
