// SPDX-License-Identifier: Apache-2.0
// Tests scenes from 3MF packages: units, places, names and colours.
#include <gtest/gtest.h>

#include "core/scene/posed_scene.h"
#include "formats/gltf/gltf_builder.h"
#include "formats/meshes/scene_reader.h"
#include "formats/meshes/threemf_package.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

class ThreeMfScenes : public testing::Test {
  protected:
    Scene read(const std::string& model, std::map<std::string, std::string> more = {}) {
        writeFile(folder_ / "a.3mf", threeMfOf(model, std::move(more)));
        return readSceneFile(folder_ / "a.3mf");
    }
    static void expectBox(const Scene& scene, const glm::dvec3& min, const glm::dvec3& max) {
        const Bounds bounds = PosedScene(scene).bounds().value();
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_NEAR(bounds.min[axis], min[axis], 1e-12) << axis;
            EXPECT_NEAR(bounds.max[axis], max[axis], 1e-12) << axis;
        }
    }

    ScratchDir folder_;
};

TEST_F(ThreeMfScenes, UnitsAreLengthsInMetresAndZIsUp) {
    const std::pair<const char*, double> units[] = {{"micron", 1e-6},     {"millimeter", 1e-3},
                                                    {"centimeter", 1e-2}, {"inch", 0.0254},
                                                    {"foot", 0.3048},     {"meter", 1}};
    for (const auto& [unit, metres] : units) {
        const Scene scene =
            read(threeMfModel(threeMfObject(threeMfBox(1, 2, 3)), "<item objectid=\"1\"/>", unit));
        expectBox(scene, {0, 0, -2 * metres}, {metres, 3 * metres, 0});
        EXPECT_TRUE(scene.warnings.empty()) << unit;
    }
}

TEST_F(ThreeMfScenes, BuildItemsAndNestedComponentsAreNodesOfSharedMeshes) {
    const Scene scene = read(threeMfModel(
        threeMfObject(threeMfBox(1, 1, 1), 1, "name=\"cube\"") +
            threeMfObject(
                "<components><component objectid=\"1\" transform=\"-2 0 0 0 1 0 0 0 1 0 0 "
                "0\"/></components>",
                2, "partnumber=\"P2\"") +
            threeMfObject(
                "<components><component objectid=\"2\" transform=\"0 1 0 -1 0 0 0 0 1 0 0 "
                "5\"/><component objectid=\"1\"/></components>",
                3),
        "<item objectid=\"3\" transform=\"1 0 0 0 1 0 0 0 1 10 0 0\"/><item objectid=\"1\"/>",
        "meter"));
    ASSERT_EQ(scene.nodes.size(), 5U);
    const char* const names[] = {"object 3", "P2", "cube", "cube", "cube"};
    for (std::size_t i = 0; i < 5; ++i)
        EXPECT_EQ(scene.nodes[i].name, names[i]);
    EXPECT_EQ(scene.nodes[0].children, (std::vector<int>{1, 3}));
    EXPECT_EQ(scene.scenes.front().roots, (std::vector<int>{0, 4}));
    EXPECT_EQ(scene.meshes.size(), 1U);
    // The nested cube: x to [−2, 0], then turned to y in [−2, 0] and x in [−1, 0], z in [5, 6].
    const auto meshes = PosedScene(scene).meshes();
    ASSERT_EQ(meshes.size(), 3U);
    const glm::dvec3 far = glm::dvec3(meshes[0].world * glm::dvec4(1, 1, 1, 1));
    EXPECT_EQ(far, glm::dvec3(9, 6, 2));
    EXPECT_LT(glm::determinant(meshes[0].world), 0) << "mirrored";
    expectBox(scene, {0, 0, -1}, {11, 6, 2});
}

TEST_F(ThreeMfScenes, ColoursOfMaterialsAndCornersAreLinear) {
    const std::string groups =
        "<basematerials id=\"5\"><base name=\"red\" displaycolor=\"#FF0000\"/>"
        "<base name=\"green\" displaycolor=\"#00FF0080\"/></basematerials>"
        "<m:colorgroup id=\"7\"><m:color color=\"#0000FF\"/><m:color color=\"#BC0000FF\"/>"
        "</m:colorgroup>";
    const Scene scene =
        read(threeMfModel(groups +
                              threeMfObject(threeMfBox(1, 1, 1, "pid=\"5\" p1=\"1\"",
                                                       "pid=\"7\" p1=\"0\" p2=\"1\" p3=\"0\"")) +
                              threeMfObject(threeMfBox(1, 1, 1), 2, "pid=\"5\" pindex=\"0\"") +
                              threeMfObject(threeMfBox(1, 1, 1), 3),
                          "<item objectid=\"1\"/><item objectid=\"2\"/><item objectid=\"3\"/>"));
    EXPECT_TRUE(scene.warnings.empty());
    const auto materialOf = [&](std::size_t mesh, std::size_t primitive) -> const Material& {
        const int index = scene.meshes.at(mesh).primitives.at(primitive).material;
        return scene.materials.at(static_cast<std::size_t>(index));
    };
    ASSERT_EQ(scene.meshes.at(0).primitives.size(), 2U);
    EXPECT_EQ(materialOf(0, 0).name, "green");
    EXPECT_EQ(materialOf(0, 0).base_color, glm::vec4(0, 1, 0, 128 / 255.F));
    EXPECT_EQ(materialOf(0, 0).alpha_mode, AlphaMode::kBlend);
    const Primitive& corners = scene.meshes[0].primitives[1];
    EXPECT_EQ(corners.indices.size(), 33U);
    EXPECT_EQ(corners.colors.at(corners.indices[0]), glm::vec4(0, 0, 1, 1));
    EXPECT_NEAR(corners.colors.at(corners.indices[1]).r, 0.502886, 1e-6);
    EXPECT_EQ(materialOf(0, 1).base_color, glm::vec4(1));
    EXPECT_EQ(materialOf(1, 0).base_color, glm::vec4(1, 0, 0, 1));
    EXPECT_EQ(materialOf(1, 0).alpha_mode, AlphaMode::kOpaque);
    EXPECT_EQ(materialOf(2, 0).name, "neutral");
}

TEST_F(ThreeMfScenes, ModelsInSeveralFilesAreRead) {
    const std::string production =
        "xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\"";
    const Scene scene = read(
        threeMfModel(threeMfObject("<components><component objectid=\"1\" p:path=\"/3D/part.model\""
                                   "/></components>",
                                   2),
                     "<item objectid=\"2\"/>", "millimeter",
                     production + " requiredextensions=\"p\""),
        {{"3D/part.model", threeMfModel(threeMfObject(threeMfBox(1, 2, 3), 1, "name=\"part\""), "",
                                        "millimeter", production)},
         {"3D/_rels/3dmodel.model.rels",
          "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">"
          "<Relationship Id=\"r1\" Target=\"/3D/part.model\" Type=\"http://schemas.microsoft.com/"
          "3dmanufacturing/2013/01/3dmodel\"/></Relationships>"}});
    expectBox(scene, {0, 0, -0.002}, {0.001, 0.003, 0});
    EXPECT_EQ(scene.nodes.at(1).name, "part");
    EXPECT_TRUE(scene.warnings.empty());
}

TEST_F(ThreeMfScenes, AxesAndUnitsOfOptionsAreIgnoredWithAWarning) {
    writeFile(folder_ / "a.3mf", threeMfOf(threeMfModel(threeMfObject(threeMfBox(1, 1, 1)))));
    SceneReadOptions options;
    options.smooth_normals = 180;
    const Scene smooth = readSceneFile(folder_ / "a.3mf", options);
    EXPECT_TRUE(smooth.warnings.empty());
    EXPECT_FALSE(smooth.meshes.at(0).primitives.at(0).normals.empty());
    options.up = Axis::kX;
    options.metres_per_unit = 1;
    const Scene scene = readSceneFile(folder_ / "a.3mf", options);
    ASSERT_EQ(scene.warnings.size(), 1U);
    expectBox(scene, {0, 0, -0.001}, {0.001, 0.001, 0});
    EXPECT_FALSE(assumedOf(folder_ / "a.3mf", options));
}

}  // namespace
}  // namespace peeler::test
