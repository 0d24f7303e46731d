// SPDX-License-Identifier: Apache-2.0
// Handling of every statement of an STL (formats/README.md).
#include "formats/file/file_statements.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::test {
namespace {

/// Returns a binary STL of one triangle with its third corner at height `y`.
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

/// Returns the text in one line.
std::string oneLine(std::string text) {
    std::ranges::replace(text, '\n', ' ');
    return text;
}

TEST(Statements, OfAnStl) {
    const std::string triangles = "triangles, binary or text", name = "a.stl";
    const std::vector<Statement> statements = {
        {triangles, "read", name, binaryStl(1, 0)},
        {triangles, "read", name, textStl(facet())},
        {"normals of facets", "read", name, textStl(facet("0 1 0", "facet normal -nan(ind) x"))},
        {"the header of a binary file", "read", name, binaryStl(1, 0, "", "solid made by hand")},
        {"white space, ends of lines and capitals", "read", name, oneLine(textStl(facet()))},
        {"a `solid` or `endsolid` line twice", "read", name,
         "solid a\n" + textStl(facet()) + "endsolid a\n"},
        {"solids of several names", "warned", name, textStl(facet()) + "solid b\nendsolid b\n"},
        {"colours in the attributes of triangles (VisCAM, SolidView, Materialise)", "warned", name,
         binaryStl(1, 0x7C00)},
        {"`COLOR=` in the header (Materialise)", "warned", name,
         binaryStl(1, 0, "", "COLOR=abcd,MATERIAL=0123456789ab")},
        {"`color` in a text", "warned", name, textStl("color 1 0 0\n" + facet())},
        {"no `endsolid`", "warned", name, "solid a\n" + facet()},
        {"bytes behind the last triangle", "warned", name, binaryStl(1, 0, "more")},
        {"coordinates that are not finite", "refused", name, binaryStl(INFINITY, 0)},
        {"coordinates that are not finite", "refused", name, textStl(facet("0 nan 0"))},
        {"facets of more or fewer than three corners", "refused", name,
         textStl(facet("0 1 0\nvertex 1 1 0"))},
        {"an end within a triangle", "refused", name, binaryStl(1, 0).substr(0, 100)},
        {"an end within a triangle", "refused", name, "solid a\n" + facet().substr(0, 50)},
        {"other words", "refused", name, textStl("facets follow\n" + facet())},
    };
    expectStatements("STL", statements, [](const std::filesystem::path& file, bool strict) {
        SceneReadOptions options;
        options.strict = strict;
        return readSceneFile(file, options).warnings;
    });
}

}  // namespace
}  // namespace peeler::test
