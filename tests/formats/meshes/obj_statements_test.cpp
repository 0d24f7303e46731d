// SPDX-License-Identifier: Apache-2.0
// Handling of every statement of an OBJ and its MTL (formats/README.md).
#include "formats/file/file_statements.h"
#include "formats/image/png_builder.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::test {
namespace {

/// Returns a triangle with a normal and the material m of m.mtl, between other statements.
std::string obj(const std::string& before, const std::string& behind = "") {
    return before +
           "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\n"
           "usemtl m\nf 1/1/1 2/2/1 3/3/1\n" +
           behind;
}

const std::string kName = "a.obj";

/// Returns a statement in an OBJ, with a trivial material.
Statement ofObj(const std::string& says, const std::string& becomes, const std::string& bytes) {
    return {says, becomes, kName, bytes, {{"m.mtl", "newmtl m\nKd 1 0 0\n"}}};
}

/// Returns a statement in the material of an OBJ.
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
        ofObj("`v`, `vt`, `vn`", "read", obj("")),
        ofObj("`v`, `vt`, `vn`", "read", obj("v 0 0 0 1\n")),
        ofObj("`f` (`fo`), `l`, `p`", "read", obj("", "fo 1 2 3\nl 1 2 3\np 1\n")),
        ofObj("`o`, `g`", "read", obj("o a\ng b c\n")),
        ofObj("`usemtl`, `mtllib`", "read", obj("mtllib m.mtl\n")),
        ofObj("comments, behind statements, too", "read", obj("# a\nv 1 2 3 # b\n")),
        ofObj("lines that go on behind a backslash", "read", obj("", "f 1 \\\n2 3\n")),
        ofObj("colours behind the coordinates of `v`, to 1 or 255", "read",
              "v 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 0 1 0 1 1 1\n" + face),
        ofObj("colours behind the coordinates of `v`, to 1 or 255", "read",
              "v 0 0 0 255 1 1\nv 1 0 0 1 1 1\nv 0 1 0 1 1 1\n" + face),
        ofObj("other numbers behind them", "warned", "v 0 0 0 1 1 1 1\n" + flat + face),
        ofObj("other numbers behind them", "warned", "v 0 0 0 1.5 1 1\n" + flat + face),
        ofObj("ZBrush's colours `#MRGB`", "read", flat + "#MRGB ffff0000ff00ff00ff0000ff\n" + face),
        ofObj("smoothing groups `s`, of faces with normals", "read", obj("s 1\n")),
        ofObj("smoothing groups `s`, of faces with normals", "read", "s off\n" + flat + face),
        ofObj("smoothing groups of faces without normals", "warned", "s 1\n" + flat + face),
        ofObj("`mg`, `lod`; `bevel off`, `c_interp off`, `d_interp off`, `usemap off`", "read",
              obj("mg 1 0.5\nlod 100\nbevel off\nc_interp off\nd_interp off\nusemap off\n")),
        ofObj("`bevel`, `c_interp`, `d_interp`, `usemap`, `maplib`, `shadow_obj`, `trace_obj`",
              "warned", obj("usemap wood\n")),
        ofObj("`bevel`, `c_interp`, `d_interp`, `usemap`, `maplib`, `shadow_obj`, `trace_obj`",
              "warned", obj("shadow_obj a.obj\n")),
        ofObj("`call`, `csh`", "warned", obj("call b.obj\n")),
        ofObj("curves and surfaces: `cstype`, `curv`, `surf` …", "warned", obj("cstype bezier\n")),
        ofObj("curves and surfaces: `cstype`, `curv`, `surf` …", "warned", obj("bzp 1 2 3\n")),
        ofObj("normals and texture coordinates that are not finite", "warned",
              obj("", "vn nan 0 0\n")),
        ofObj("faces of which some corners have normals or texture coordinates", "warned",
              obj("", "f 1//1 2 3\n")),
        ofObj("faces of fewer than three corners", "warned", obj("", "f 1 2\n")),
        ofObj("a material that is not there, or libraries of materials", "warned",
              obj("", "usemtl none\nf 1 2 3\n")),
        ofObj("a material that is not there, or libraries of materials", "warned",
              "mtllib none.mtl\n" + flat + face),
        ofObj("other lines among those of an OBJ", "warned", obj("hello world\n")),
        ofObj("nothing to draw", "warned", flat),
        ofObj("no line of an OBJ", "refused", "once upon a time\n"),
        ofObj("text in UTF-16, a pointer of Git LFS, a web page", "refused",
              std::string("\xFF\xFEv\0 \0", 6)),
        ofObj("text in UTF-16, a pointer of Git LFS, a web page", "refused",
              "version https://git-lfs.github.com/spec/v1\noid sha256:abc\nsize 123\n"),
        ofObj("text in UTF-16, a pointer of Git LFS, a web page", "refused", "<!DOCTYPE html>\n"),
        ofObj("positions that are not finite", "refused", "v 0 0 inf\n" + flat + face),
        ofObj("words for numbers, too few of them, indices of nothing", "refused",
              flat + "f 1 2 4\n"),
    };
}

std::vector<Statement> statementsOfMtl() {
    return {
        ofMtl("`Kd`, `Ke`, `Ns`, `d`, `Tr`", "read",
              "Kd 1 0.5 0\nKe 3 0 0\nNs 96 # rough\nd 0.5\nTr 0.5"),
        ofMtl("`Pr`, `Pm`, `Ps`, `Pc`, `Pcr`, `aniso`, `anisor`", "read",
              "Pr 0.5\nPm 1\nPs 0\nPc 1\nPcr 0.5\naniso 0.5\nanisor 0.25"),
        ofMtl("`map_Kd`, `map_d`, `map_Ke`, `map_Pr`, `map_Pm`, `norm`, `map_norm`", "read",
              "map_Kd a.png\nmap_d a.png\nmap_Ke a.png\nmap_Pr a.png\nmap_Pm a.png\nnorm a.png"),
        ofMtl("options of maps: `-s`, `-o`, `-clamp`, `-bm`", "read",
              "map_Kd -s 2 2 2 -o 1 1 1 -clamp on a.png"),
        ofMtl("`Ka`, `Ks`, `Ni`, `illum`, `sharpness`, `map_Ka`, `map_aat`", "read",
              "Ka 1 1 1\nKs 1 1 1\nNi 1.5\nillum 2\nsharpness 60\nmap_Ka b.png\nmap_aat on"),
        ofMtl("options of maps: `-boost`, `-texres`, `-blendu`, `-blendv`, `-type`", "read",
              "map_Kd -boost 1 -texres 512 -blendu on -blendv on -type sphere a.png"),
        ofMtl("options of maps: `-t`, `-mm`, `-cc`, `-imfchan`, `-colorspace`", "warned",
              "map_Kd -t 1 1 1 a.png"),
        ofMtl("options of maps: `-t`, `-mm`, `-cc`, `-imfchan`, `-colorspace`", "warned",
              "map_Kd -mm 0.5 1 a.png"),
        ofMtl("the same where they change nothing", "read",
              "map_Kd -t 0 0 0 -mm 0 1 -cc off -imfchan l -colorspace sRGB a.png"),
        ofMtl("names of other folders or drives, or in other letters", "warned",
              "map_Kd C:\\Users\\me\\A.PNG"),
        ofMtl("a texture that cannot be had", "warned", "map_Kd b.png"),
        {"textures of faces without texture coordinates", "warned", kName,
         "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n",
         ofMtl("", "", "map_Kd a.png").beside},
        ofMtl("`bump`, `map_bump`, `disp`, `decal`, `refl`, `map_Ks`, `map_Ns`, and all others",
              "warned", "bump a.png"),
        ofMtl("`bump`, `map_bump`, `disp`, `decal`, `refl`, `map_Ks`, `map_Ns`, and all others",
              "warned", "map_Ns a.png"),
        ofMtl("a coloured filter `Tf`", "warned", "Tf 0 1 0"),
        ofMtl("a grey filter `Tf`", "read", "Tf 1 1 1"),
        ofMtl("`d -halo`, `spectral`, `xyz`", "warned", "d -halo 0.5"),
        ofMtl("`d -halo`, `spectral`, `xyz`", "warned", "Kd spectral a.rfl"),
        ofMtl("`d` and `Tr` that contradict each other", "warned", "d 1\nTr 1"),
        ofMtl("a material that is wholly transparent", "warned", "Tr 1"),
        ofMtl("numbers out of range", "warned", "Kd 255 0 0"),
        ofMtl("a material twice, or statements before `newmtl`", "warned", "newmtl m\nKd 1 1 1"),
        ofMtl("words for numbers", "refused", "Kd red"),
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
