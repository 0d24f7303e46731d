// SPDX-License-Identifier: Apache-2.0
// Tests the table for 3MF in formats/README.md, "Supported content".
#include "formats/file/file_statements.h"
#include "formats/meshes/scene_reader.h"
#include "formats/meshes/threemf_package.h"

namespace peeler::test {
namespace {

// Items of lists in formats/README.md.
constexpr const char* kThreeMfShapes =
    "meshes, components, build items, their transforms, units, names (else part numbers); models "
    "in several files (production extension)";
constexpr const char* kThreeMfColors =
    "base materials (display colours, sRGB) and colour groups, of objects and triangles; a missing "
    "colour is white";
constexpr const char* kThreeMfIgnored =
    "ignored: objects outside the build, metadata, thumbnails, print tickets, elements and "
    "attributes of other namespaces";
constexpr const char* kThreeMfLostContent =
    "textures, beam lattices, slices, composite materials, multiple properties, missing materials";
constexpr const char* kThreeMfLostObjects =
    "objects of type `support`, `solidsupport`, `other` (left out), other units (millimetres), "
    "other elements of the core namespace, nothing to draw";
constexpr const char* kThreeMfPackages =
    "encryption, extensions that are required but not listed here, damaged ZIP or XML, ZIP without "
    "a `.model`";
constexpr const char* kThreeMfNumbers =
    "triangles with equal corners or indices of no vertex, references to objects that do not come "
    "before, non-finite coordinates and transforms";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
}

TEST(Statements, OfA3mf) {
    const std::string name = "a.3mf", item = "<item objectid=\"1\"/>";
    const std::string box = threeMfBox(1, 1, 1), object = threeMfObject(box);
    const std::string base =
        "<basematerials id=\"5\"><base name=\"red\" displaycolor=\"#F00000\"/>"
        "</basematerials>";
    const std::string colors = "<m:colorgroup id=\"7\"><m:color color=\"#00FF00\"/></m:colorgroup>";
    const auto of = [](const std::string& resources) { return threeMfOf(threeMfModel(resources)); };
    const auto typed = [&](const char* type) {
        return of(threeMfObject(box, 1, "type=\"" + std::string(type) + "\""));
    };
    const std::string slices =
        "<s:slicestack id=\"8\" zbottom=\"0\"><s:slice ztop=\"1\"><s:vertices><s:vertex x=\"0\" "
        "y=\"0\"/><s:vertex x=\"1\" y=\"0\"/><s:vertex x=\"0\" y=\"1\"/></s:vertices><s:polygon "
        "startv=\"0\"><s:segment v2=\"1\"/><s:segment v2=\"2\"/><s:segment v2=\"0\"/></s:polygon>"
        "</s:slice></s:slicestack>";
    const std::string beams =
        "<b:beamlattice minlength=\"0.1\" radius=\"0.1\"><b:beams><b:beam v1=\"0\" v2=\"7\"/>"
        "</b:beams></b:beamlattice></mesh>";
    const std::vector<Statement> statements = {
        {kThreeMfShapes, "read", name, of(threeMfObject(box, 1, "name=\"a\" partnumber=\"b\""))},
        {kThreeMfShapes, "read", name, typed("surface")},
        {kThreeMfColors, "read", name, of(base + threeMfObject(box, 1, "pid=\"5\" pindex=\"0\""))},
        {kThreeMfColors, "read", name,
         of(colors + threeMfObject(threeMfBox(1, 1, 1, "pid=\"7\" p1=\"3\"")))},
        {kThreeMfIgnored, "read", name, of(object + threeMfObject(box, 2))},
        {kThreeMfIgnored, "read", name,
         threeMfOf(replaced(threeMfModel(object), "<resources>",
                            "<metadata name=\"Maker\">x</metadata><resources>"))},
        {kThreeMfLostContent, "warned", name,
         of("<m:compositematerials id=\"9\" matid=\"5\" matindices=\"0\"><m:composite "
            "values=\"1\"/></m:compositematerials>" +
            object)},
        {kThreeMfLostContent, "warned", name,
         of("<m:multiproperties id=\"9\" pids=\"5\"><m:multi pindices=\"0\"/></m:multiproperties>" +
            object)},
        {kThreeMfLostContent, "warned", name,
         of(base + threeMfObject(box, 1, "pid=\"5\" pindex=\"4\""))},
        {kThreeMfLostContent, "warned", name,
         of(slices + threeMfObject(box, 1, "s:slicestackid=\"8\""))},
        {kThreeMfLostContent, "warned", name, of(threeMfObject(replaced(box, "</mesh>", beams)))},
        {kThreeMfLostContent, "warned", name,
         of("<m:texture2d id=\"3\" path=\"/3D/t.png\" contenttype=\"image/png\"/><m:texture2dgroup "
            "id=\"4\" texid=\"3\"><m:tex2coord u=\"0\" v=\"0\"/></m:texture2dgroup>" +
            threeMfObject(threeMfBox(1, 1, 1, "pid=\"4\" p1=\"0\"")))},
        {kThreeMfLostObjects, "warned", name, typed("support")},
        {kThreeMfLostObjects, "warned", name, typed("solidsupport")},
        {kThreeMfLostObjects, "warned", name, typed("other")},
        {kThreeMfLostObjects, "warned", name, threeMfOf(threeMfModel(object, item, "parsec"))},
        {kThreeMfLostObjects, "warned", name, of("<thing/>" + object)},
        {kThreeMfLostObjects, "warned", name, threeMfOf(threeMfModel(object, ""))},
        {kThreeMfPackages, "refused", name, threeMfOf(threeMfModel(object), {}, 1)},
        {kThreeMfPackages, "refused", name,
         threeMfOf(threeMfModel(object), {{"Secure/keystore.xml", "<keystore/>"}})},
        {kThreeMfPackages, "refused", name,
         threeMfOf(threeMfModel(object, item, "inch",
                                "xmlns:q=\"http://x.org\" requiredextensions=\"q\""))},
        {kThreeMfPackages, "refused", name, of(object).substr(0, 900)},
        {kThreeMfPackages, "refused", name, threeMfOf("<model><resources>")},
        {kThreeMfPackages, "refused", name, storedZip({{"a.stl", "solid"}})},
        {kThreeMfNumbers, "refused", name, of(replaced(object, "v2=\"2\"", "v2=\"0\""))},
        {kThreeMfNumbers, "refused", name, of(replaced(object, "v2=\"2\"", "v2=\"8\""))},
        {kThreeMfNumbers, "refused", name, of(replaced(object, "x=\"1\"", "x=\"inf\""))},
        {kThreeMfNumbers, "refused", name,
         of("<object id=\"1\"><components><component objectid=\"2\"/></components></object>" +
            threeMfObject(box, 2))},
        {kThreeMfNumbers, "refused", name,
         threeMfOf(threeMfModel(object,
                                "<item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 nan 0 "
                                "0\"/>"))},
    };
    expectStatements("3MF", statements, [](const std::filesystem::path& file, bool strict) {
        SceneReadOptions options;
        options.strict = strict;
        return readSceneFile(file, options).warnings;
    });
}

}  // namespace
}  // namespace peeler::test
