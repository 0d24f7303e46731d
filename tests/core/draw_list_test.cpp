// SPDX-License-Identifier: Apache-2.0
// Draw order and keys: the same whether instances are drawn at once or one by one.
#include "core/draw_list.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "core/error.h"

namespace peeler {
namespace {

glm::dmat4 at(double x, double scale = 1) {
    return glm::scale(glm::translate(glm::dmat4(1), glm::dvec3(x, 0, 0)), glm::dvec3(scale, 1, 1));
}

/// A mesh of a strip of three triangles and one of two; a node that shows it at four places, the
/// third mirrored; a node that shows it once.
Scene grove() {
    Scene scene;
    scene.materials.resize(1);
    Mesh& tree = scene.meshes.emplace_back();
    tree.primitives.resize(2);
    tree.primitives[0].topology = Topology::kTriangleStrip;
    tree.primitives[0].positions.resize(5);
    tree.primitives[1].positions.resize(6);
    scene.nodes.resize(2);
    scene.nodes[0].mesh = scene.nodes[1].mesh = 0;
    scene.nodes[0].instances = {at(0), at(1), at(2, -1), at(3)};
    scene.scenes = {{"", {0, 1}}};
    return scene;
}

TEST(DrawList, DrawsTheInstancesOfANodeAtOnce) {
    const Scene scene = grove();
    const DrawList list(scene, contents(scene, 0));
    struct Expected {
        std::size_t instances;
        std::uint32_t first, step;
        bool mirrored;
    };
    // Five keys an instance. A mirrored instance winds the other way, so it is drawn apart.
    const Expected expected[] = {{2, 1, 5, false},  {2, 4, 5, false},  {1, 11, 5, true},
                                 {1, 14, 5, true},  {1, 16, 5, false}, {1, 19, 5, false},
                                 {1, 21, 5, false}, {1, 24, 5, false}};
    ASSERT_EQ(list.draws().size(), std::size(expected));
    for (std::size_t i = 0; i < std::size(expected); ++i) {
        const Draw& draw = list.draws()[i];
        EXPECT_EQ(draw.instances, expected[i].instances) << i;
        EXPECT_EQ(draw.first_primitive, expected[i].first) << i;
        EXPECT_EQ(draw.instance_keys, expected[i].step) << i;
        EXPECT_EQ(draw.mirrored, expected[i].mirrored) << i;
    }
    EXPECT_EQ(list.geometries().size(), 2U);  // shared by all
    EXPECT_EQ(list.worlds(list.draws()[1])[1], at(1));
    EXPECT_EQ(list.worlds(list.draws()[4])[0], at(3));
}

TEST(DrawList, NumbersSurfacesInDrawOrder) {
    const Scene scene = grove();
    const DrawList list(scene, contents(scene, 0));
    std::vector<std::uint32_t> surfaces;
    for (std::uint32_t key = 1; key <= 25; ++key)
        surfaces.push_back(list.surfaceOf(key));
    EXPECT_EQ(surfaces, (std::vector<std::uint32_t>{0, 0, 0, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4,
                                                    5, 5, 6, 6, 6, 7, 7, 8, 8, 8, 9, 9}));
}

TEST(DrawList, GivesDeformedMeshesGeometriesOfTheirOwn) {
    Scene scene = grove();
    for (Primitive& p : scene.meshes[0].primitives)
        p.targets.resize(1);
    const DrawList list(scene, contents(scene, 0));
    EXPECT_EQ(list.geometries().size(), 4U);  // one set for each node, whatever its instances
    EXPECT_EQ(list.draws()[0].instances, 2U);
}

TEST(DrawList, LeavesOutWhatAlphaRejectsButNotItsKeys) {
    Scene scene = grove();
    scene.materials.resize(2);
    scene.materials[0].alpha_mode = AlphaMode::kBlend;
    scene.materials[0].base_color.a = 0;
    scene.meshes[0].primitives[1].material = 1;
    const DrawList list(scene, contents(scene, 0));
    ASSERT_EQ(list.draws().size(), 4U);
    EXPECT_EQ(list.draws()[0].first_primitive, 4U);
}

TEST(DrawList, RefusesMorePrimitivesThanKeys) {
    Scene scene = grove();
    scene.meshes[0].primitives[1].positions.resize(300000);
    scene.nodes[0].instances->resize(50000, at(0));
    EXPECT_THROW(DrawList(scene, contents(scene, 0)), Error);
}

}  // namespace
}  // namespace peeler
