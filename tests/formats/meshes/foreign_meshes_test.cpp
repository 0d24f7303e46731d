// SPDX-License-Identifier: Apache-2.0
// Tests PLY, STL and OBJ files of other programs: either they are read correctly, or a warning
// names the problem.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/base/color.h"
#include "formats/gltf/gltf_builder.h"
#include "formats/image/bitmap_builder.h"
#include "formats/image/png_builder.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::test {
namespace {

namespace fs = std::filesystem;

constexpr char kTriangle[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n";
constexpr char kXyz[] = "property float x\nproperty float y\nproperty float z\n";

class ForeignMeshes : public testing::Test {
  protected:
    Scene read(const std::string& name, const std::string& text,
               const SceneReadOptions& options = {}) {
        writeFile(folder_ / name, text);
        return readSceneFile(folder_ / name, options);
    }
    Error refusal(const std::string& name, const std::string& text) {
        try {
            read(name, text);
        } catch (const Error& error) {
            return error;
        }
        ADD_FAILURE() << name << " was read";
        return {ErrorKind::kInternal, "", ""};
    }
    /// Returns the red of the first pixel of the base colour texture of the mesh's material; −1 if
    /// there is no texture.
    static int redOf(const Scene& scene) {
        const Primitive& mesh = scene.meshes.at(0).primitives.at(0);
        const TextureRef& texture =
            scene.materials.at(static_cast<std::size_t>(mesh.material)).base_color_texture;
        return texture ? scene.images.at(static_cast<std::size_t>(texture.image)).rgba[0] : -1;
    }
    void writeMaterial(const std::string& name, const std::string& texture) {
        writeFile(folder_ / name, "newmtl m\nmap_Kd " + texture + "\n");
    }

    ScratchDir folder_;
};

Bytes pictureOfRed(std::uint8_t red) {
    return png(1, 1, PngColor::kRgb, 8, {red, 0, 0});
}

// ---- names

TEST_F(ForeignMeshes, NamesOfObjAreReadAsProgramsWriteThem) {
    fs::create_directory(folder_ / "sub");
    writeFile(folder_ / "a b.png", pictureOfRed(10));
    writeFile(folder_ / "sub/c.png", pictureOfRed(20));
    writeFile(folder_ / "Photo #1.png", pictureOfRed(30));
    const struct {
        const char* library;  ///< the library's name in `mtllib`
        const char* file;     ///< the library's name on disk
        const char* texture;
        int red;
        bool warned;
    } cases[] = {
        {"m.mtl", "m.mtl", "a b.png", 10, false},
        {"\"my lib.mtl\"", "my lib.mtl", "\"a b.png\"", 10, false},
        {"my lib.mtl", "my lib.mtl", "sub\\c.png", 20, false},
        {"m.mtl # materials", "m.mtl", "a b.png # wood", 10, false},
        {"m.mtl", "m.mtl", "Photo #1.png", 30, false},
        {"none.mtl m.mtl", "m.mtl", "a b.png", 10, true},
        {"C:\\Users\\me\\proj\\m.mtl", "m.mtl", "C:\\Users\\me\\proj\\a b.png", 10, true},
        {"m.mtl", "m.mtl", "\"D:\\old\\sub\\c.png\"", 20, true},
        {"m.mtl", "m.mtl", "\\\\server\\share\\a b.png", 10, true},
        {"m.mtl", "m.mtl", "/home/me/sub/c.png", 20, true},
        {"m.mtl", "m.mtl", "../textures/a b.png", 10, true},
        {"m.mtl", "m.mtl", "A B.PNG", 10, true},
        {"M.MTL", "m.mtl", "SUB\\C.png", 20, true},
        {"sub/../m.mtl", "m.mtl", "sub/../a b.png", 10, false},
        {"sub/m.mtl", "sub/m.mtl", "c.png", 20, false},
        {"sub/m.mtl", "sub/m.mtl", "../a b.png", 10, false},
        {"sub/m.mtl", "sub/m.mtl", "E:\\c.png", 20, true},
        {"E:\\sub\\m.mtl", "sub/m.mtl", "c.png", 20, true},
        {"sub/m.mtl", "sub/m.mtl", "a b.png", 10, true},
    };
    for (const auto& [library, file, texture, red, warned] : cases) {
        SCOPED_TRACE(std::string(library) + ", " + texture);
        writeMaterial(file, texture);
        const Scene scene = read("a.obj", std::string("mtllib ") + library + "\n" + kTriangle +
                                              "usemtl m\nf 1/1 2/2 3/3\n");
        EXPECT_EQ(redOf(scene), red);
        EXPECT_EQ(!scene.warnings.empty(), warned)
            << (scene.warnings.empty() ? "" : scene.warnings[0]);
        EXPECT_GE(scene.files.size(), 2U) << "what the scene is made of";
        fs::remove(folder_ / file);
    }
}

TEST_F(ForeignMeshes, NamesInSeveralCasesOfLettersAreNotGuessed) {
    writeFile(folder_ / "a.png", pictureOfRed(10));
    writeFile(folder_ / "A.png", pictureOfRed(20));
    writeMaterial("m.mtl", "A.PNG");
    const std::string obj = std::string("mtllib m.mtl\n") + kTriangle + "usemtl m\nf 1/1 2/2 3/3\n";
    EXPECT_TRUE(contains(read("a.obj", obj).warnings.at(0), "does not exist"));
    writeMaterial("m.mtl", "a.png");
    EXPECT_EQ(redOf(read("a.obj", obj)), 10);
}

TEST_F(ForeignMeshes, NamesOfOtherFoldersAreReadWithLeave) {
    const ScratchDir other;
    writeFile(other / "a.png", pictureOfRed(20));
    writeFile(folder_ / "a.png", pictureOfRed(10));
    writeMaterial("m.mtl", (other / "a.png").string());
    const std::string obj = std::string("mtllib m.mtl\n") + kTriangle + "usemtl m\nf 1/1 2/2 3/3\n";
    EXPECT_EQ(redOf(read("a.obj", obj)), 10);
    SceneReadOptions options;
    options.allow_outside = true;
    const Scene scene = read("a.obj", obj, options);
    EXPECT_EQ(redOf(scene), 20);
    EXPECT_TRUE(scene.warnings.empty());
}

TEST_F(ForeignMeshes, NamesOfGltfLikewise) {
    fs::create_directory(folder_ / "textures");
    writeFile(folder_ / "textures/wood a.bin", triangle().bin);
    for (const char* uri :
         {"textures\\wood a.bin", "textures%5Cwood%20a.bin", "C:\\me\\textures\\wood a.bin",
          "file:///C:/me/textures/wood%20a.bin", "/me/textures/wood%20a.bin", "Textures/wood a.BIN",
          "../textures/wood a.bin"}) {
        GltfBuilder builder = triangle();
        builder.gltf["buffers"] = {{{"byteLength", builder.bin.size()}, {"uri", uri}}};
        const Scene scene = readSceneFile(builder.write(folder_));
        EXPECT_EQ(scene.meshes.at(0).primitives.at(0).positions.size(), 3U) << uri;
        EXPECT_EQ(scene.warnings.size(), 1U) << uri;
        EXPECT_EQ(scene.files, std::vector{fs::canonical(folder_.path()) / "textures/wood a.bin"});
        SceneReadOptions options;
        options.strict = true;
        EXPECT_THROW(readSceneFile(folder_ / "scene.gltf", options), Error) << uri;
    }
}

TEST_F(ForeignMeshes, NamesOfPlyLikewise) {
    writeFile(folder_ / "a.png", pictureOfRed(10));
    for (const char* name : {"C:\\me\\a.png", "\"a.png\"", "./a.png"}) {
        const Scene scene =
            read("a.ply", std::string("ply\nformat ascii 1.0\ncomment TextureFile ") + name +
                              "\nelement vertex 3\n" + kXyz +
                              "property float s\nproperty float t\nelement face 1\nproperty list "
                              "uchar int vertex_indices\nend_header\n0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 "
                              "1\n3 0 1 2\n");
        EXPECT_EQ(redOf(scene), 10) << name;
        EXPECT_EQ(scene.warnings.size(), name[0] == 'C' ? 1U : 0U) << name;
    }
}

// ---- OBJ and MTL

TEST_F(ForeignMeshes, CommentsOfAnObjStandBehindStatements) {
    writeFile(folder_ / "m.mtl",
              "newmtl Material #3 # the third\nKd 1 0 0 # red\nNs 10 #\nd 0.5# half\n");
    const Scene scene = read("a.obj",
                             "mtllib m.mtl\nv 0 0 0 # a\nv 1 0 0#b\nv 0 1 0 1 # c\nvt 0 # d\n"
                             "vn 0 0 1 # e\no Box #1 # f\ns 1 # g\nusemtl Material #3\n"
                             "f 1/1/1 2/1/1 3/1/1 # h\nl 1 2 # i\np 3 # j\n");
    EXPECT_TRUE(scene.warnings.empty()) << scene.warnings[0];
    ASSERT_EQ(scene.meshes.size(), 1U);
    EXPECT_EQ(scene.nodes.at(0).name, "Box #1");
    EXPECT_EQ(scene.meshes[0].primitives.size(), 3U);
    EXPECT_EQ(scene.materials.at(0).base_color, glm::vec4(1, 0, 0, 0.5F));
}

TEST_F(ForeignMeshes, DissolveGoesBeforeTransparency) {
    const struct {
        const char* statements;
        float alpha;
        const char* warning;  ///< part of the expected warning; null = none
    } cases[] = {
        {"d 1\nTr 1\n", 1, "contradict"},      {"Tr 1\nd 1\n", 1, "contradict"},
        {"d 0.25\nTr 0.75\n", 0.25F, nullptr}, {"d 1\nTr 0\n", 1, nullptr},
        {"Tr 0.25\n", 0.75F, nullptr},         {"Tr 1\n", 0, "fully transparent"},
        {"d 0\n", 0, "fully transparent"},     {"Tr 0\nd 0\n", 0, "contradict"},
    };
    for (const auto& [statements, alpha, warning] : cases) {
        SCOPED_TRACE(statements);
        writeFile(folder_ / "m.mtl", std::string("newmtl m\n") + statements);
        const Scene scene =
            read("a.obj", std::string("mtllib m.mtl\n") + kTriangle + "usemtl m\nf 1 2 3\n");
        EXPECT_EQ(scene.materials.at(0).base_color.a, alpha);
        if (warning)
            EXPECT_TRUE(contains(scene.warnings.at(0), warning));
        else
            EXPECT_TRUE(scene.warnings.empty());
    }
}

TEST_F(ForeignMeshes, UnusedMaterialsWarnOfNothing) {
    writeFile(folder_ / "m.mtl",
              "newmtl m\nKd 1 0 0\nnewmtl other\nTr 1\nbump a.png\nKd 2 0 0\nTf 0 1 0\n");
    EXPECT_TRUE(read("a.obj", std::string("mtllib m.mtl\n") + kTriangle + "usemtl m\nf 1 2 3\n")
                    .warnings.empty());
}

TEST_F(ForeignMeshes, ColorsOfVerticesAreNotMultipliedByGrey) {
    const Scene scene = read("a.obj",
                             "o coloured\nv 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 0 1 0 1 1 1\nf 1 2 3\n"
                             "o plain\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf 4 5 6\n");
    ASSERT_EQ(scene.meshes.size(), 2U);
    const auto materialOf = [&](std::size_t mesh) {
        const Primitive& primitive = scene.meshes[mesh].primitives.at(0);
        return scene.materials.at(static_cast<std::size_t>(primitive.material)).base_color;
    };
    EXPECT_EQ(materialOf(0), glm::vec4(1));
    EXPECT_EQ(scene.meshes[0].primitives[0].colors.at(0), glm::vec4(1));
    EXPECT_EQ(materialOf(1), glm::vec4(0.5F, 0.5F, 0.5F, 1));
    EXPECT_TRUE(scene.meshes[1].primitives[0].colors.empty());
    // Some programs write colours as bytes.
    const Scene bytes = read("b.obj", "v 0 0 0 255 0 51\nv 1 0 0 0 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n");
    EXPECT_EQ(bytes.meshes[0].primitives[0].colors.at(0), glm::vec4(1, 0, linearFromSrgb(0.2F), 1));
}

TEST_F(ForeignMeshes, ZBrushPaintsTheVerticesBeforeIt) {
    const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    const Scene scene =
        read("a.obj", vertices + vertices + "#MRGB ffff0000ff00ff00\n#MRGB ff0000ff\n" +
                          "f 1 2 3\nf 4 5 6\n");
    const std::vector<glm::vec4>& colors = scene.meshes.at(0).primitives.at(0).colors;
    ASSERT_EQ(colors.size(), 6U);
    EXPECT_EQ(colors[0], glm::vec4(1));
    EXPECT_EQ(colors[3], glm::vec4(1, 0, 0, 1));
    EXPECT_EQ(colors[4], glm::vec4(0, 1, 0, 1));
    EXPECT_EQ(colors[5], glm::vec4(0, 0, 1, 1));
    EXPECT_EQ(refusal("b.obj", vertices + "#MRGB red\n#MRGB notahexx\nf 1 2 3\n").where(),
              (folder_ / "b.obj").string() + ":5");
}

TEST_F(ForeignMeshes, FilesThatAreNoSceneSayWhatTheyAre) {
    const std::string pointer =
        "version https://git-lfs.github.com/spec/v1\noid sha256:abc\nsize 123\n";
    const std::string wide("\xFF\xFEv\0 \0", 6);
    for (const char* name : {"a.obj", "a.ply", "a.stl", "a.glb"}) {
        EXPECT_TRUE(contains(refusal(name, pointer).what(), "Git LFS")) << name;
        EXPECT_TRUE(contains(refusal(name, wide).what(), "UTF-16")) << name;
        EXPECT_TRUE(contains(refusal(name, "<!DOCTYPE html>\n").what(), "web page")) << name;
    }
    const Error error = refusal("a.obj", "# a\n\nOnce upon a time\n");
    EXPECT_TRUE(contains(error.what(), "no OBJ statements"));
    EXPECT_EQ(error.where(), (folder_ / "a.obj").string() + ":3");
}

TEST_F(ForeignMeshes, NormalsThatAreNotFiniteAreLeftOut) {
    const Scene obj = read("a.obj", std::string(kTriangle) +
                                        "vn 0 0 1\nvn nan nan nan\nf 1//1 2//1 3//1\n"
                                        "f 1//2 2//2 3//2\n");
    ASSERT_EQ(obj.meshes.at(0).primitives.size(), 2U);
    EXPECT_EQ(obj.meshes[0].primitives[0].normals.size(), 3U);
    EXPECT_TRUE(obj.meshes[0].primitives[1].normals.empty());
    EXPECT_EQ(obj.warnings.size(), 1U);
    const Scene ply =
        read("a.ply", std::string("ply\nformat ascii 1.0\nelement vertex 3\n") + kXyz +
                          "property float nx\nproperty float ny\nproperty float nz\n"
                          "element face 1\nproperty list uchar int vertex_indices\n"
                          "end_header\n0 0 0 0 0 1\n1 0 0 nan nan nan\n0 1 0 0 0 1\n"
                          "3 0 1 2\n");
    EXPECT_TRUE(ply.meshes.at(0).primitives.at(0).normals.empty());
    EXPECT_EQ(ply.meshes[0].primitives[0].indices.size(), 3U);
    EXPECT_TRUE(contains(ply.warnings.at(0), "normals are left out"));
}

// ---- PLY

/// Returns a square of four corners and two triangles. The faces have these additional properties.
std::string squarePly(const std::string& comments, const std::string& properties,
                      const std::string& faces) {
    return "ply\nformat ascii 1.0\n" + comments + "element vertex 4\n" + kXyz +
           "element face 2\nproperty list uchar int vertex_indices\n" + properties +
           "end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n" + faces;
}

TEST_F(ForeignMeshes, FacesOfAPlyChooseAmongItsTextures) {
    writeFile(folder_ / "a.png", pictureOfRed(10));
    writeFile(folder_ / "b.png", pictureOfRed(20));
    const std::string properties = "property list uchar float texcoord\nproperty int texnumber\n";
    const std::string textures = "comment TextureFile a.png\ncomment TextureFile b.png\n";
    const auto red = [](const Scene& scene, std::size_t primitive) {
        Scene one = scene;
        std::swap(one.meshes[0].primitives[0], one.meshes[0].primitives[primitive]);
        return redOf(one);
    };
    const Scene scene = read("a.ply", squarePly(textures, properties,
                                                "3 0 1 2 6 0 0 1 0 1 1 1\n"
                                                "3 0 2 3 6 0 0 1 1 0 1 0\n"));
    EXPECT_TRUE(scene.warnings.empty());
    ASSERT_EQ(scene.meshes.at(0).primitives.size(), 2U) << "in the file's order";
    EXPECT_EQ(red(scene, 0), 20);
    EXPECT_EQ(red(scene, 1), 10);
    EXPECT_EQ(scene.meshes[0].primitives[1].positions.at(2), glm::vec3(0, 1, 0));
    EXPECT_EQ(scene.meshes[0].primitives[1].texcoords[0].at(2), glm::vec2(0, 0));
    // One face has no texture; the other face's texture is missing.
    const Scene none = read("b.ply", squarePly(textures, properties,
                                               "3 0 1 2 6 0 0 1 0 1 1 -1\n"
                                               "3 0 2 3 6 0 0 1 1 0 1 1\n"));
    EXPECT_EQ(red(none, 0), -1);
    EXPECT_EQ(red(none, 1), 20);
    EXPECT_TRUE(none.warnings.empty());
    EXPECT_TRUE(contains(read("c.ply", squarePly(textures, properties,
                                                 "3 0 1 2 6 0 0 1 0 1 1 0\n"
                                                 "3 0 2 3 6 0 0 1 1 0 1 2\n"))
                             .warnings.at(0),
                         "texnumber 2 of 2"));
}

TEST_F(ForeignMeshes, ColorsOfAPlyAreOfTheirOwnRange) {
    const auto color = [&](const char* type, const char* numbers) {
        const std::string t = type;
        const Scene scene = read("a.ply", std::string("ply\nformat ascii 1.0\nelement vertex 1\n") +
                                              kXyz + "property " + t + " red\nproperty " + t +
                                              " green\nproperty " + t + " blue\nproperty " + t +
                                              " alpha\nend_header\n0 0 0 " + numbers + "\n");
        EXPECT_TRUE(scene.warnings.empty()) << type << numbers;
        return scene.meshes.at(0).primitives.at(0).colors.at(0);
    };
    const float fifth = linearFromSrgb(0.2F);
    const glm::vec4 expected(1, fifth, 0, 0.2F);
    EXPECT_EQ(color("uchar", "255 51 0 51"), expected);
    EXPECT_EQ(color("int", "255 51 0 51"), expected);
    EXPECT_EQ(color("uint", "255 51 0 51"), expected);
    EXPECT_EQ(color("short", "255 51 0 51"), expected);
    EXPECT_EQ(color("float", "255 51 0 51"), expected);
    EXPECT_EQ(color("double", "255 51 0 0.2"), expected) << "alpha to 1";
    EXPECT_EQ(color("ushort", "65535 13107 0 13107"), expected);
    EXPECT_EQ(color("float", "1 0.2 0 0.2"), expected);
    EXPECT_EQ(color("uchar", "1 0 0 255").r, linearFromSrgb(1 / 255.0F)) << "bytes are bytes";
    EXPECT_EQ(color("int", "1 0 0 255").r, linearFromSrgb(1 / 255.0F));
}

TEST_F(ForeignMeshes, FacesOfAPlyHaveColors) {
    const Scene scene =
        read("a.ply", squarePly("",
                                "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                                "property uchar alpha\n",
                                "3 0 1 2 255 0 0 255\n3 0 2 3 0 255 0 51\n"));
    EXPECT_TRUE(scene.warnings.empty());
    const Primitive& mesh = scene.meshes.at(0).primitives.at(0);
    ASSERT_EQ(mesh.positions.size(), 6U);
    for (std::size_t i = 0; i < 6; ++i)
        EXPECT_EQ(mesh.colors.at(mesh.indices[i]),
                  i < 3 ? glm::vec4(1, 0, 0, 1) : glm::vec4(0, 1, 0, 0.2F));
    const Material& material = scene.materials.at(static_cast<std::size_t>(mesh.material));
    EXPECT_EQ(material.base_color, glm::vec4(1));
    EXPECT_EQ(material.alpha_mode, AlphaMode::kBlend);
    // Faces of the same colour share their corners.
    EXPECT_EQ(
        read("b.ply", squarePly("", "property int red\nproperty int green\nproperty int blue\n",
                                "3 0 1 2 255 0 0\n3 0 2 3 255 0 0\n"))
            .meshes[0]
            .primitives[0]
            .positions.size(),
        4U);
}

TEST_F(ForeignMeshes, VerticesOfAPlyWithoutTrianglesArePoints) {
    for (const char* properties : {"", "property int texnumber\n"}) {
        const Scene scene =
            read("a.ply", squarePly("", properties, *properties ? "2 0 1 0\n0 0\n" : "2 0 1\n0\n"));
        EXPECT_EQ(scene.meshes.at(0).primitives.at(0).topology, Topology::kPoints);
        EXPECT_EQ(scene.meshes[0].primitives[0].positions.size(), 4U);
    }
}

TEST_F(ForeignMeshes, ElementsOfAPlyByAnotherNameAreNamed) {
    const Error error =
        refusal("a.ply", std::string("ply\nformat ascii 1.0\nelement vertices 1\n") + kXyz +
                             "element face 0\nproperty list uchar int "
                             "vertex_indices\nend_header\n0 0 0\n");
    EXPECT_TRUE(contains(error.what(), "its elements are: vertices, face")) << error.what();
}

TEST_F(ForeignMeshes, PropertiesOfGaussianSplatsAreNamed) {
    const Scene scene =
        read("a.ply", std::string("ply\nformat ascii 1.0\nelement vertex 1\n") + kXyz +
                          "property float f_dc_0\nproperty float opacity\nproperty float scale_0\n"
                          "end_header\n0 0 0 1 2 3\n");
    EXPECT_TRUE(contains(scene.warnings.at(0), "f_dc_0, opacity, scale_0"));
}

// ---- STL

TEST_F(ForeignMeshes, TextOfAnStlIsFree) {
    const std::string facet =
        "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet ";
    const auto triangles = [&](const std::string& text) {
        const Scene scene = read("a.stl", text);
        return scene.meshes.at(0).primitives.at(0).indices.size() / 3;
    };
    const std::string one = "solid a b\n" + facet + facet + "\nendsolid a b\n";
    EXPECT_EQ(triangles(one), 2U);
    EXPECT_EQ(triangles("solid x\n" + one + "endsolid x\n"), 2U);
    EXPECT_EQ(triangles("solid a b " + facet + facet + "endsolid a b"), 2U);
    EXPECT_EQ(triangles("solid a " + facet + "endsolid a solid b " + facet + "endsolid b"), 2U);
    EXPECT_EQ(triangles("\n\n  SOLID\n\n\n" + facet + "ENDSOLID"), 1U);
    std::string lines = one;
    std::ranges::replace(lines, '\n', '\r');
    EXPECT_EQ(triangles(lines), 2U);
    EXPECT_EQ(readSceneFile(folder_ / "a.stl").nodes.at(0).name, "a b");
    EXPECT_EQ(triangles("solid a\n" + facet), 1U) << "no endsolid";
    EXPECT_TRUE(contains(readSceneFile(folder_ / "a.stl").warnings.at(0), "may be cut off"));
}

TEST_F(ForeignMeshes, TextOfAnStlIsNotTakenForBinary) {
    const Error error = refusal("a.stl", "solid a\n" + std::string(200, 'x') + "\n");
    EXPECT_TRUE(contains(error.what(), "does not belong here")) << error.what();
    EXPECT_EQ(error.where(), (folder_ / "a.stl").string() + ":2");
}

// ---- textures

TEST_F(ForeignMeshes, TexturesAreBmpAndTgaToo) {
    writeFile(folder_ / "a.bmp", bmp(1, 1, 24, 0, {}, {0, 0, 10, 0}));
    writeFile(folder_ / "a.tga", tga(2, 1, 1, 24, 0, {0, 0, 20}));
    for (const auto& [name, red] : {std::pair("a.bmp", 10), std::pair("a.tga", 20)}) {
        writeMaterial("m.mtl", name);
        const Scene scene =
            read("a.obj", std::string("mtllib m.mtl\n") + kTriangle + "usemtl m\nf 1/1 2/2 3/3\n");
        EXPECT_EQ(redOf(scene), red);
        EXPECT_TRUE(scene.warnings.empty());
    }
}

}  // namespace
}  // namespace peeler::test
