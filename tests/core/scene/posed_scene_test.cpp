// SPDX-License-Identifier: Apache-2.0
// Tests the traversal of the node hierarchy: order, world matrices, bounds, depth.
#include "core/scene/posed_scene.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include <peeler/error.h>

namespace peeler {
namespace {

glm::dmat4 translation(double x, double y, double z) {
    return glm::translate(glm::dmat4(1), glm::dvec3(x, y, z));
}

Node node(const glm::dmat4& local, std::vector<int> children, int mesh = -1, int camera = -1) {
    Node result;
    result.local = local;
    result.children = std::move(children);
    result.mesh = mesh;
    result.camera = camera;
    return result;
}

Mesh meshOf(std::vector<glm::vec3> positions) {
    Mesh mesh;
    mesh.primitives.emplace_back().positions = std::move(positions);
    return mesh;
}

TEST(PosedScene, ListsDepthFirstInTheFilesOrder) {
    Scene scene;
    scene.meshes.resize(5);
    scene.scenes = {{"", {4, 0}}};
    scene.nodes = {node(glm::dmat4(1), {1, 3}, 0), node(glm::dmat4(1), {2}, 1),
                   node(glm::dmat4(1), {}, 2), node(glm::dmat4(1), {}, 3),
                   node(glm::dmat4(1), {}, 4)};
    const PosedScene shown(scene, 0);
    std::vector<int> order;
    for (const MeshInstance& instance : shown.meshes())
        order.push_back(instance.mesh);
    EXPECT_EQ(order, (std::vector<int>{4, 0, 1, 2, 3}));
    EXPECT_EQ(shown.meshes()[0].node, 4);
}

TEST(PosedScene, MultipliesParentTimesChild) {
    Scene scene;
    scene.meshes.resize(5);
    scene.scenes = {{"", {0}}};
    const glm::dmat4 doubled = glm::scale(glm::dmat4(1), glm::dvec3(2));
    scene.nodes = {node(doubled, {1}), node(translation(1, 2, 3), {}, 0, 0)};
    const PosedScene shown(scene, 0);
    ASSERT_EQ(shown.meshes().size(), 1U);
    EXPECT_EQ(glm::dvec3(shown.meshes()[0].world[3]), glm::dvec3(2, 4, 6));
    ASSERT_EQ(shown.cameras().size(), 1U);
    EXPECT_EQ(shown.cameras()[0].world, doubled * translation(1, 2, 3));
}

TEST(PosedScene, ShowsOnlyTheSceneAskedFor) {
    Scene scene;
    scene.meshes.resize(5);
    scene.scenes = {{"", {0}}, {"", {1}}, {"", {}}};
    scene.nodes = {node(glm::dmat4(1), {}, 0), node(glm::dmat4(1), {}, 1)};
    EXPECT_EQ(PosedScene(scene, 1).meshes().at(0).mesh, 1);
    EXPECT_TRUE(PosedScene(scene, 2).meshes().empty());
    EXPECT_THROW(PosedScene(scene, 3), Error);
    EXPECT_THROW(PosedScene(scene, -1), Error);
}

TEST(PosedScene, CopiesShareWhatTheyHold) {
    Scene scene;
    scene.meshes = {meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})};
    scene.materials.resize(1);
    scene.nodes = {node(translation(1, 2, 3), {}, 0)};
    scene.scenes = {{"", {0}}};
    const PosedScene shown(scene), copy = shown;
    EXPECT_EQ(&copy.drawList(), &shown.drawList());
    EXPECT_EQ(copy.drawList().draws().size(), 1U);
    EXPECT_EQ(&copy.meshes(), &shown.meshes());
}

TEST(PosedScene, TakesChainsOfAnyDepth) {
    Scene scene;
    scene.meshes.resize(5);
    const int depth = 300000;
    scene.scenes = {{"", {0}}};
    for (int i = 0; i < depth; ++i)
        scene.nodes.push_back(node(translation(1, 0, 0),
                                   i + 1 < depth ? std::vector{i + 1} : std::vector<int>{},
                                   i + 1 < depth ? -1 : 0));
    const PosedScene shown(scene, 0);
    ASSERT_EQ(shown.meshes().size(), 1U);
    EXPECT_EQ(shown.meshes()[0].world[3].x, depth);
}

TEST(SceneBounds, EncloseEveryInstanceInWorldSpace) {
    Scene scene;
    scene.scenes = {{"", {0, 1}}};
    scene.meshes = {meshOf({{-1, 0, 0}, {1, 2, 3}})};
    scene.nodes = {
        node(translation(10, 0, 0), {}, 0),
        node(glm::rotate(glm::dmat4(1), glm::radians(180.0), glm::dvec3(0, 0, 1)), {}, 0)};
    const auto box = PosedScene(scene, 0).bounds();
    ASSERT_TRUE(box);
    EXPECT_NEAR(box->min.x, -1, 1e-12);
    EXPECT_NEAR(box->min.y, -2, 1e-12);
    EXPECT_NEAR(box->max.x, 11, 1e-12);
    EXPECT_NEAR(box->max.z, 3, 1e-12);
}

TEST(SceneBounds, AreNothingWithoutVertices) {
    Scene scene;
    scene.scenes = {{"", {0}}};
    scene.meshes = {meshOf({})};
    scene.nodes = {node(glm::dmat4(1), {}, 0)};
    EXPECT_FALSE(PosedScene(scene, 0).bounds());
}

}  // namespace
}  // namespace peeler
