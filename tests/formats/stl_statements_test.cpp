// SPDX-License-Identifier: Apache-2.0
// What becomes of everything that an STL can say (formats/README.md).
#include "formats/file_statements.h"
#include "formats/meshes/scene_reader.h"

namespace peeler::test {
namespace {

/// A binary STL of one triangle whose third corner is at height `y`.
std::string binary(float y, std::uint16_t attribute, const std::string& behind = "") {
    std::string bytes(80, ' ');
    const auto add = [&](const auto& value) {
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    };
    add(std::uint32_t{1});
    for (const float number : {0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, y, 0.F})
        add(number);
    add(attribute);
    return bytes + behind;
}

std::string text(const std::string& facet, const std::string& corner = "0 1 0") {
    return "solid a\n" + facet + "\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex " + corner +
           "\nendloop\nendfacet\nendsolid a\n";
}

TEST(Statements, OfAnStl) {
    const std::vector<Statement> statements = {
        {"triangles, binary or text", "read", "a.stl", binary(1, 0)},
        {"triangles, binary or text", "read", "a.stl", text("facet normal 0 0 1")},
        {"colours in the attributes of triangles", "warned", "a.stl", binary(1, 0x7C00)},
        {"bytes behind the last triangle", "warned", "a.stl", binary(1, 0, "more")},
        {"coordinates that are not finite", "refused", "a.stl", binary(INFINITY, 0)},
        {"coordinates that are not finite", "refused", "a.stl",
         text("facet normal 0 0 1", "0 nan 0")},
    };
    expectStatements("STL", statements, [](const std::filesystem::path& file, bool strict) {
        SceneReadOptions options;
        options.strict = strict;
        return readSceneFile(file, options).warnings;
    });
}

}  // namespace
}  // namespace peeler::test
