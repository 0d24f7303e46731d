// SPDX-License-Identifier: Apache-2.0
// Tests the table for STL in formats/README.md, "Supported content".
#include "formats/file/file_statements.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::test {
namespace {

constexpr const char* kStlTriangles =
    "triangles, binary or text, in one or several solids; ignored: facet normals, binary header, "
    "layout, capitals, repeated `solid` or `endsolid`";
constexpr const char* kStlIgnored =
    "several names, no `endsolid`, bytes behind the last triangle; colours: attributes (VisCAM, "
    "SolidView, Materialise), `COLOR=`, `color`";
constexpr const char* kStlBroken =
    "non-finite coordinates, facets without exactly three corners, other words, truncation";

/// A binary STL of one triangle whose third corner is at height `y`.
std::string binaryStl(float y, std::uint16_t attribute, const std::string& behind = "",
                      const std::string& header = "") {
    std::string bytes = header;
    bytes.resize(80, ' ');
    const auto add = [&](const auto& value) {
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    };
    add(std::uint32_t{1});
    for (const float number : {0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, y, 0.F})
        add(number);
    add(attribute);
    return bytes + behind;
}

std::string facet(const std::string& corner = "0 1 0",
                  const std::string& normal = "facet normal 0 0 1") {
    return normal + "\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex " + corner +
           "\nendloop\nendfacet\n";
}

std::string textStl(const std::string& facets) {
    return "solid a\n" + facets + "endsolid a\n";
}

std::string oneLine(std::string text) {
    std::ranges::replace(text, '\n', ' ');
    return text;
}

TEST(Statements, OfAnStl) {
    const std::string name = "a.stl";
    const std::vector<Statement> statements = {
        {kStlTriangles, "read", name, binaryStl(1, 0)},
        {kStlTriangles, "read", name, textStl(facet())},
        {kStlTriangles, "read", name, textStl(facet("0 1 0", "facet normal -nan(ind) x"))},
        {kStlTriangles, "read", name, binaryStl(1, 0, "", "solid made by hand")},
        {kStlTriangles, "read", name, oneLine(textStl(facet()))},
        {kStlTriangles, "read", name, "solid a\n" + textStl(facet()) + "endsolid a\n"},
        {kStlIgnored, "warned", name, textStl(facet()) + "solid b\nendsolid b\n"},
        {kStlIgnored, "warned", name, binaryStl(1, 0x7C00)},
        {kStlIgnored, "warned", name, binaryStl(1, 0, "", "COLOR=abcd,MATERIAL=0123456789ab")},
        {kStlIgnored, "warned", name, textStl("color 1 0 0\n" + facet())},
        {kStlIgnored, "warned", name, "solid a\n" + facet()},
        {kStlIgnored, "warned", name, binaryStl(1, 0, "more")},
        {kStlBroken, "refused", name, binaryStl(INFINITY, 0)},
        {kStlBroken, "refused", name, textStl(facet("0 nan 0"))},
        {kStlBroken, "refused", name, textStl(facet("0 1 0\nvertex 1 1 0"))},
        {kStlBroken, "refused", name, binaryStl(1, 0).substr(0, 100)},
        {kStlBroken, "refused", name, "solid a\n" + facet().substr(0, 50)},
        {kStlBroken, "refused", name, textStl("facets follow\n" + facet())},
    };
    expectStatements("STL", statements, [](const std::filesystem::path& file, bool strict) {
        SceneReadOptions options;
        options.strict = strict;
        return readSceneFile(file, options).warnings;
    });
}

}  // namespace
}  // namespace peeler::test
