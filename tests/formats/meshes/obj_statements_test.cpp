// SPDX-License-Identifier: Apache-2.0
// Tests the table for OBJ and MTL in formats/README.md, "Supported content".
#include "formats/file/file_statements.h"
#include "formats/image/png_builder.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::test {
namespace {

constexpr const char* kObjShapes =
    "`v` (a fourth number: curve weight), `vt`, `vn`, `f`, `fo`, `l`, `p`, `o`, `g`, `usemtl`, "
    "`mtllib`; comments (after names, from ` # ` on), lines continued by a backslash";
constexpr const char* kObjColours =
    "colours behind `v`, to 1 or 255 (sRGB; multiply the material, or white); ZBrush's `#MRGB`, "
    "without masks";
constexpr const char* kObjPassedOver =
    "ignored: `s` with normals, `mg`, `lod`, `bevel`, `c_interp`, `d_interp`, `usemap` off";
constexpr const char* kObjOddVertices =
    "`s` without normals (flat, unless `--smooth-normals`), other numbers behind `v`, non-finite "
    "normals or texture coordinates, faces with these at only some corners, faces of under three "
    "corners, nothing to draw";
constexpr const char* kObjOtherLines =
    "`bevel`, `c_interp`, `d_interp`, `usemap`, `maplib`, `shadow_obj`, `trace_obj`, `call`, `csh` "
    "(never run), curves and surfaces (`cstype`, `curv`, `surf` …), other lines";
constexpr const char* kObjMaterials =
    "MTL: [these statements](#meshes), textures in PNG, JPEG, WebP, KTX2, BMP, TGA, TIFF; `-s`, "
    "`-o`, `-clamp`; `-bm` of normal maps";
constexpr const char* kObjNoEffect =
    "ignored: `Ka`, `Ks`, `Ni`, `illum`, `sharpness`, `map_Ka`, `map_aat`, a grey `Tf`; `-boost`, "
    "`-texres`, `-blendu`, `-blendv`, `-type`; `-t`, `-mm`, `-cc`, `-imfchan`, `-colorspace` "
    "without effect";
constexpr const char* kObjOtherMaterials =
    "`-t`, `-mm`, `-cc`, `-imfchan`, `-colorspace` with effect; `bump`, `map_bump`, `disp`, "
    "`decal`, `refl`, `map_Ks`, `map_Ns`, a coloured `Tf`, `d -halo`, `spectral`, `xyz`, all "
    "others";
constexpr const char* kObjOddMaterials =
    "missing materials and libraries; textures missing, found elsewhere, or without coordinates; "
    "contradictory `d` and `Tr`, full transparency, values out of range, two materials of one "
    "name, statements before `newmtl`";
constexpr const char* kObjBroken =
    "no OBJ line, non-finite positions, words for numbers, too few numbers, indices of nothing; in "
    "every format: UTF-16, a Git LFS pointer, a web page";

/// Returns an OBJ: `before`, a triangle with a normal and the material m of m.mtl, and `behind`.
std::string obj(const std::string& before, const std::string& behind = "") {
    return before +
           "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\n"
           "usemtl m\nf 1/1/1 2/2/1 3/3/1\n" +
           behind;
}

const std::string kName = "a.obj";

/// Returns a test case for an OBJ with a trivial material.
Statement ofObj(const std::string& says, const std::string& becomes, const std::string& bytes) {
    return {says, becomes, kName, bytes, {{"m.mtl", "newmtl m\nKd 1 0 0\n"}}};
}

/// Returns a test case for a statement in an MTL.
Statement ofMtl(const std::string& says, const std::string& becomes, const std::string& statement) {
    const Bytes picture = png(1, 1, PngColor::kRgb, 8, {1, 2, 3});
    return {says,
            becomes,
            kName,
            obj(""),
            {{"m.mtl", "newmtl m\n" + statement + "\n"},
             {"a.png", std::string(picture.begin(), picture.end())}}};
}

std::vector<Statement> statementsOfObj() {
    const std::string flat = "v 0 0 0\nv 1 0 0\nv 0 1 0\n", face = "f 1 2 3\n";
    return {
        ofObj(kObjShapes, "read", obj("")),
        ofObj(kObjShapes, "read", obj("v 0 0 0 1\n")),
        ofObj(kObjShapes, "read", obj("", "fo 1 2 3\nl 1 2 3\np 1\n")),
        ofObj(kObjShapes, "read", obj("o a\ng b c\n")),
        ofObj(kObjShapes, "read", obj("mtllib m.mtl\n")),
        ofObj(kObjShapes, "read", obj("# a\nv 1 2 3 # b\n")),
        ofObj(kObjShapes, "read", obj("", "f 1 \\\n2 3\n")),
        ofObj(kObjColours, "read", "v 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 0 1 0 1 1 1\n" + face),
        ofObj(kObjColours, "read", "v 0 0 0 255 1 1\nv 1 0 0 1 1 1\nv 0 1 0 1 1 1\n" + face),
        ofObj(kObjOddVertices, "warned", "v 0 0 0 1 1 1 1\n" + flat + face),
        ofObj(kObjOddVertices, "warned", "v 0 0 0 1.5 1 1\n" + flat + face),
        ofObj(kObjColours, "read", flat + "#MRGB ffff0000ff00ff00ff0000ff\n" + face),
        ofObj(kObjPassedOver, "read", obj("s 1\n")),
        ofObj(kObjPassedOver, "read", "s off\n" + flat + face),
        ofObj(kObjOddVertices, "warned", "s 1\n" + flat + face),
        ofObj(kObjPassedOver, "read",
              obj("mg 1 0.5\nlod 100\nbevel off\nc_interp off\nd_interp off\nusemap off\n")),
        ofObj(kObjOtherLines, "warned", obj("usemap wood\n")),
        ofObj(kObjOtherLines, "warned", obj("shadow_obj a.obj\n")),
        ofObj(kObjOtherLines, "warned", obj("call b.obj\n")),
        ofObj(kObjOtherLines, "warned", obj("cstype bezier\n")),
        ofObj(kObjOtherLines, "warned", obj("bzp 1 2 3\n")),
        ofObj(kObjOddVertices, "warned", obj("", "vn nan 0 0\n")),
        ofObj(kObjOddVertices, "warned", obj("", "f 1//1 2 3\n")),
        ofObj(kObjOddVertices, "warned", obj("", "f 1 2\n")),
        ofObj(kObjOddMaterials, "warned", obj("", "usemtl none\nf 1 2 3\n")),
        ofObj(kObjOddMaterials, "warned", "mtllib none.mtl\n" + flat + face),
        ofObj(kObjOtherLines, "warned", obj("hello world\n")),
        ofObj(kObjOddVertices, "warned", flat),
        ofObj(kObjBroken, "refused", "once upon a time\n"),
        ofObj(kObjBroken, "refused", std::string("\xFF\xFEv\0 \0", 6)),
        ofObj(kObjBroken, "refused",
              "version https://git-lfs.github.com/spec/v1\noid sha256:abc\nsize 123\n"),
        ofObj(kObjBroken, "refused", "<!DOCTYPE html>\n"),
        ofObj(kObjBroken, "refused", "v 0 0 inf\n" + flat + face),
        ofObj(kObjBroken, "refused", flat + "f 1 2 4\n"),
    };
}

std::vector<Statement> statementsOfMtl() {
    return {
        ofMtl(kObjMaterials, "read", "Kd 1 0.5 0\nKe 3 0 0\nNs 96 # rough\nd 0.5\nTr 0.5"),
        ofMtl(kObjMaterials, "read", "Pr 0.5\nPm 1\nPs 0\nPc 1\nPcr 0.5\naniso 0.5\nanisor 0.25"),
        ofMtl(kObjMaterials, "read",
              "map_Kd a.png\nmap_d a.png\nmap_Ke a.png\nmap_Pr a.png\nmap_Pm a.png\nnorm a.png"),
        ofMtl(kObjMaterials, "read", "map_Kd -s 2 2 2 -o 1 1 1 -clamp on a.png"),
        ofMtl(kObjNoEffect, "read",
              "Ka 1 1 1\nKs 1 1 1\nNi 1.5\nillum 2\nsharpness 60\nmap_Ka b.png\nmap_aat on"),
        ofMtl(kObjNoEffect, "read",
              "map_Kd -boost 1 -texres 512 -blendu on -blendv on -type sphere a.png"),
        ofMtl(kObjOtherMaterials, "warned", "map_Kd -t 1 1 1 a.png"),
        ofMtl(kObjOtherMaterials, "warned", "map_Kd -mm 0.5 1 a.png"),
        ofMtl(kObjNoEffect, "read",
              "map_Kd -t 0 0 0 -mm 0 1 -cc off -imfchan l -colorspace sRGB a.png"),
        ofMtl(kObjOddMaterials, "warned", "map_Kd C:\\Users\\me\\A.PNG"),
        ofMtl(kObjOddMaterials, "warned", "map_Kd b.png"),
        {kObjOddMaterials, "warned", kName,
         "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n",
         ofMtl("", "", "map_Kd a.png").beside},
        ofMtl(kObjOtherMaterials, "warned", "bump a.png"),
        ofMtl(kObjOtherMaterials, "warned", "map_Ns a.png"),
        ofMtl(kObjOtherMaterials, "warned", "Tf 0 1 0"),
        ofMtl(kObjNoEffect, "read", "Tf 1 1 1"),
        ofMtl(kObjOtherMaterials, "warned", "d -halo 0.5"),
        ofMtl(kObjOtherMaterials, "warned", "Kd spectral a.rfl"),
        ofMtl(kObjOddMaterials, "warned", "d 1\nTr 1"),
        ofMtl(kObjOddMaterials, "warned", "Tr 1"),
        ofMtl(kObjOddMaterials, "warned", "Kd 255 0 0"),
        ofMtl(kObjOddMaterials, "warned", "newmtl m\nKd 1 1 1"),
        ofMtl(kObjBroken, "refused", "Kd red"),
    };
}

TEST(Statements, OfAnObj) {
    std::vector<Statement> statements = statementsOfObj();
    for (Statement& statement : statementsOfMtl())
        statements.push_back(std::move(statement));
    expectStatements("OBJ and MTL", statements, [](const std::filesystem::path& file, bool strict) {
        SceneReadOptions options;
        options.strict = strict;
        return readSceneFile(file, options).warnings;
    });
}

}  // namespace
}  // namespace peeler::test
