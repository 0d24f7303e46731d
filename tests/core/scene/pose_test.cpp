// SPDX-License-Identifier: Apache-2.0
// Tests the poses of nodes over time, and vertices under skins and morph targets.
#include "core/scene/posed_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

namespace peeler {
namespace {

constexpr double kQuarterTurn = std::numbers::pi / 2;

Node nodeAt(const glm::dvec3& translation, std::vector<int> children = {}) {
    Node node;
    node.trs = Trs{.translation = translation};
    node.local = node.trs->matrix();
    node.children = std::move(children);
    return node;
}

/// Returns an animation with one channel, from `first` at 0 to `second` at 1 second.
Animation moving(int node, AnimatedProperty property, std::vector<float> first,
                 const std::vector<float>& second) {
    Animation animation;
    first.insert(first.end(), second.begin(), second.end());
    animation.keyframes = {{Interpolation::kLinear, {0, 1}, std::move(first)}};
    animation.channels = {{0, node, property}};
    return animation;
}

void expectNear(const glm::dvec3& a, const glm::dvec3& b, double tolerance = 1e-6) {
    EXPECT_LE(glm::length(a - b), tolerance)
        << a.x << ' ' << a.y << ' ' << a.z << " instead of " << b.x << ' ' << b.y << ' ' << b.z;
}

TEST(Pose, ChangesOnePropertyAndLeavesTheOthers) {
    Scene scene;
    Node node;
    node.trs = Trs{{1, 2, 3}, glm::angleAxis(kQuarterTurn, glm::dvec3(0, 0, 1)), {2, 2, 2}};
    node.local = node.trs->matrix();
    scene.nodes = {node};
    scene.animations = {moving(0, AnimatedProperty::kTranslation, {0, 0, 0}, {8, 0, 4}),
                        moving(0, AnimatedProperty::kScale, {1, 1, 1}, {5, 5, 5})};
    const int first[] = {0}, both[] = {0, 1};
    EXPECT_EQ(restPose(scene).locals[0], node.local);
    EXPECT_EQ(poseAt(scene, {}, 0.5).locals[0], node.local);
    // The node's X axis maps to the world's Y axis, with a scale of 2.
    const glm::dmat4 moved = poseAt(scene, first, 0.5).locals[0];
    expectNear(glm::dvec3(moved * glm::dvec4(1, 0, 0, 1)), {4, 2, 2}, 1e-12);
    const glm::dmat4 grown = poseAt(scene, both, 0.5).locals[0];
    expectNear(glm::dvec3(grown * glm::dvec4(1, 0, 0, 1)), {4, 3, 2}, 1e-12);
}

TEST(Pose, TheLaterAnimationCounts) {
    Scene scene;
    scene.nodes = {nodeAt({0, 0, 0})};
    scene.animations = {moving(0, AnimatedProperty::kTranslation, {1, 0, 0}, {1, 0, 0}),
                        moving(0, AnimatedProperty::kTranslation, {2, 0, 0}, {2, 0, 0})};
    const int forth[] = {0, 1}, back[] = {1, 0};
    EXPECT_EQ(poseAt(scene, forth, 0).locals[0][3].x, 2);
    EXPECT_EQ(poseAt(scene, back, 0).locals[0][3].x, 1);
}

TEST(Trs, IsTranslationTimesRotationTimesScale) {
    // A rotation by half a turn, as a quaternion whose length is not 1.
    const Trs trs{{1, 2, 3}, glm::dquat(0, 0, 0, 2), {4, 5, 6}};
    expectNear(glm::dvec3(trs.matrix() * glm::dvec4(1, 1, 1, 1)), {1 - 4, 2 - 5, 3 + 6}, 1e-12);
    const Trs none{{0, 0, 0}, glm::dquat(0, 0, 0, 0), {1, 1, 1}};
    EXPECT_EQ(none.matrix(), glm::dmat4(1));
}

/// A strip of vertices along Y from 0 to 2 with normals +X, moved by two bones: one at the origin,
/// and its child at (0, 1, 0). Vertices below y = 1 follow the first bone, vertices above follow
/// the second, and the vertex at 1 follows both.
struct Arm {
    Scene scene;

    explicit Arm(const glm::dmat4& place = glm::dmat4(1)) {
        Primitive strip;
        JointSet set;
        for (int i = 0; i <= 20; ++i) {
            const float y = static_cast<float>(i) / 10;
            strip.positions.emplace_back(0.5F, y, 0);
            strip.normals.emplace_back(1, 0, 0);
            strip.tangents.emplace_back(0, 1, 0, 1);
            const float second = y > 1 ? 1.0F : y == 1 ? 0.5F : 0.0F;
            set.joints.emplace_back(0, 1, 0, 0);
            set.weights.emplace_back(1 - second, second, 0, 0);
        }
        strip.joint_sets = {set};
        scene.meshes.emplace_back().primitives = {strip};
        Skin skin;
        skin.joints = {1, 2};
        skin.inverse_bind = {glm::dmat4(1), glm::translate(glm::dmat4(1), glm::dvec3(0, -1, 0))};
        scene.skins = {skin};
        // The mesh's node is far away, which must not affect a skinned mesh.
        Node mesh = nodeAt({1e6, -7, 3});
        mesh.mesh = mesh.skin = 0;
        Node root = nodeAt({0, 0, 0}, {2});
        root.local = place;
        root.trs.reset();
        scene.nodes = {mesh, root, nodeAt({0, 1, 0})};
        scene.scenes = {{"", {0, 1}}};
        // The second bone turns by a right angle about Z, which rotates +Y to −X.
        const float h = std::sqrt(0.5F);
        scene.animations = {moving(2, AnimatedProperty::kRotation, {0, 0, 0, 1}, {0, 0, h, h})};
    }

    PosedScene at(double time) const {
        const int all[] = {0};
        return PosedScene(scene, 0, poseAt(scene, all, time));
    }
};

glm::dvec3 worldPosition(const PosedScene& shown, std::size_t vertex) {
    const MeshInstance& instance = shown.meshes().at(0);
    const glm::dvec3 position(shown.positions(instance, 0).at(vertex));
    return glm::dvec3(instance.world * glm::dvec4(position, 1));
}

TEST(Skin, AtRestShowsTheMeshWhereItsBonesAre) {
    const Arm arm;
    const PosedScene shown = arm.at(0);
    for (std::size_t i = 0; i <= 20; ++i)
        expectNear(worldPosition(shown, i), {0.5, static_cast<double>(i) / 10, 0});
}

TEST(Skin, BendsByARightAngle) {
    const Arm arm;
    const PosedScene shown = arm.at(1);
    const DeformedVertices& bent = shown.deformed().at(0).at(0);
    for (std::size_t i = 0; i < 10; ++i) {
        expectNear(worldPosition(shown, i), {0.5, static_cast<double>(i) / 10, 0});
        expectNear(bent.normals[i], {1, 0, 0});
        expectNear(bent.tangents[i], {0, 1, 0});
    }
    // The rotation about (0, 1) moves the vertex (0.5, 1 + a) to (−a, 1.5).
    for (std::size_t i = 11; i <= 20; ++i) {
        const double along = static_cast<double>(i) / 10 - 1;
        expectNear(worldPosition(shown, i), {-along, 1.5, 0});
        expectNear(bent.normals[i], {0, 1, 0});
        expectNear(bent.tangents[i], {-1, 0, 0});
    }
    // The vertex at 1 follows both bones equally: it is at the mean of (0.5, 1) and (0, 1.5).
    expectNear(worldPosition(shown, 10), {0.25, 1.25, 0});
    expectNear(bent.normals[10], {std::sqrt(0.5), std::sqrt(0.5), 0});
}

TEST(Skin, KeepsItsPrecisionFarFromTheOrigin) {
    const glm::dvec3 far(1e7, -2e7, 3e7);  // in single precision, positions would be off by 2
    const Arm arm(glm::translate(glm::dmat4(1), far));
    const PosedScene shown = arm.at(1);
    expectNear(worldPosition(shown, 20), far + glm::dvec3(-1, 1.5, 0), 1e-5);
}

TEST(Skin, TurnsNormalsWithTheInverseTransposeAndMirrors) {
    const glm::dmat4 squashed = glm::scale(glm::dmat4(1), glm::dvec3(-0.5, 1, 1));
    Arm arm(squashed);
    for (auto& normal : arm.scene.meshes[0].primitives[0].normals)
        normal = glm::normalize(glm::vec3(1, 1, 0));
    const PosedScene shown = arm.at(0);
    EXPECT_TRUE(shown.meshes()[0].mirrored);
    expectNear(worldPosition(shown, 3), {-0.25, 0.3, 0});
    expectNear(shown.deformed()[0][0].normals[3], glm::normalize(glm::dvec3(-2, 1, 0)));
    EXPECT_FALSE(Arm().at(0).meshes()[0].mirrored);
}

TEST(Skin, IsMirroredByTheJointsThatMoveIt) {
    // The first joint is mirrored, the second is not. The first check uses both joints, the second
    // check only the second joint.
    Arm arm;
    arm.scene.skins[0].inverse_bind[0] = glm::scale(glm::dmat4(1), glm::dvec3(-1, 1, 1));
    Primitive& strip = arm.scene.meshes[0].primitives[0];
    EXPECT_TRUE(arm.at(0).meshes()[0].mirrored);
    for (auto& weights : strip.joint_sets[0].weights)
        weights = {0, 1, 0, 0};
    EXPECT_FALSE(arm.at(0).meshes()[0].mirrored);
    // Without joints, the node's transform determines `mirrored`.
    strip.joint_sets.clear();
    EXPECT_FALSE(arm.at(0).meshes()[0].mirrored);
    arm.scene.nodes[0].local = glm::scale(glm::dmat4(1), glm::dvec3(1, 1, -1));
    EXPECT_TRUE(arm.at(0).meshes()[0].mirrored);
}

TEST(Skin, TakesAllJointSetsAndScalesWeights) {
    Arm arm;
    Primitive& strip = arm.scene.meshes[0].primitives[0];
    // The two joint sets together give the same relative weights: a third of each weight is in the
    // first set, two thirds in the second. The sum of the weights is 30 instead of 1.
    JointSet second = strip.joint_sets[0];
    for (auto& weights : strip.joint_sets[0].weights)
        weights *= 10;
    for (std::size_t i = 0; i < second.weights.size(); ++i) {
        second.weights[i] = 20.0F * glm::vec4(0, 0, second.weights[i].y, second.weights[i].x);
        // The first two joints have weight 0, so joint 7 need not exist.
        second.joints[i] = {7, 7, 1, 0};
    }
    strip.joint_sets.push_back(second);
    const Arm plain;
    for (const std::size_t i : {3U, 10U, 17U})
        expectNear(worldPosition(arm.at(0.7), i), worldPosition(plain.at(0.7), i));
}

TEST(Skin, MovesPrimitivesWithoutJointsWithTheirNode) {
    Arm arm;
    arm.scene.meshes[0].primitives[0].joint_sets.clear();
    arm.scene.nodes[0].local = glm::translate(glm::dmat4(1), glm::dvec3(0, 0, 9));
    expectNear(worldPosition(arm.at(1), 20), {0.5, 2, 9});
}

Scene morphing() {
    Scene scene;
    Primitive p;
    p.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    p.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
    p.tangents = {{1, 0, 0, -1}, {1, 0, 0, -1}, {1, 0, 0, -1}};
    p.targets = {{{{0, 0, 1}, {0, 0, 2}, {0, 0, 4}}, {}, {}},
                 {{{8, 0, 0}, {0, 0, 0}, {0, 0, 0}},
                  {{0, 1, -1}, {0, 0, 0}, {0, 0, 0}},
                  {{0, 0, 2}, {0, 0, 0}, {0, 0, 0}}}};
    scene.meshes.emplace_back().primitives = {p};
    scene.nodes.emplace_back().mesh = 0;
    scene.scenes = {{"", {0}}};
    return scene;
}

TEST(MorphTargets, AddTheirWeightedDisplacements) {
    Scene scene = morphing();
    scene.meshes[0].weights = {0.5, 0.25};
    const PosedScene shown(scene, 0);
    const DeformedVertices& v = shown.deformed().at(0).at(0);
    EXPECT_EQ(v.positions, (std::vector<glm::vec3>{{2, 0, 0.5F}, {1, 0, 1}, {0, 1, 2}}));
    EXPECT_EQ(v.normals[0], glm::vec3(0, 0.25F, 0.75F));
    EXPECT_EQ(v.normals[1], glm::vec3(0, 0, 1));
    EXPECT_EQ(v.tangents[0], glm::vec4(1, 0, 0.5F, -1));  // the handedness is unchanged
}

TEST(MorphTargets, TakeWeightsOfTheAnimationBeforeTheNodesAndTheMeshs) {
    Scene scene = morphing();
    const auto height = [&](const PosedScene& shown) {
        return shown.deformed().at(0).at(0).positions[0].z;
    };
    EXPECT_EQ(height(PosedScene(scene, 0)), 0);  // the default weight is 0
    scene.meshes[0].weights = {0.5, 0};
    EXPECT_EQ(height(PosedScene(scene, 0)), 0.5F);
    scene.nodes[0].weights = {{0.25, 0}};
    EXPECT_EQ(height(PosedScene(scene, 0)), 0.25F);
    scene.animations = {moving(0, AnimatedProperty::kWeights, {0, 0}, {2, 0})};
    const int all[] = {0};
    EXPECT_EQ(height(PosedScene(scene, 0, poseAt(scene, all, 0.5))), 1);
}

TEST(MorphTargets, ActBeforeTheSkin) {
    Arm arm;
    Primitive& strip = arm.scene.meshes[0].primitives[0];
    strip.targets = {{std::vector<glm::vec3>(strip.positions.size(), {0.5F, 0, 0}), {}, {}}};
    arm.scene.meshes[0].weights = {1};
    // The target moves the vertex from (0.5, 2) to (1, 2). Then the skin rotates it by a right
    // angle about (0, 1).
    expectNear(worldPosition(arm.at(1), 20), {-1, 2, 0});
}

TEST(Visibility, HidesMeshesAndLightsBelowButNoCameras) {
    Scene scene;
    scene.nodes.resize(3);
    for (Node& node : scene.nodes)
        node.mesh = node.light = node.camera = 0;
    scene.nodes[0].children = {1};
    scene.nodes[0].visible = false;
    scene.scenes = {{"", {0, 2}}};
    scene.meshes.resize(1);
    const PosedScene shown(scene, 0);
    ASSERT_EQ(shown.meshes().size(), 1U);
    EXPECT_EQ(shown.meshes()[0].node, 2);
    EXPECT_EQ(shown.lights().size(), 1U);
    EXPECT_EQ(shown.cameras().size(), 3U);
}

}  // namespace
}  // namespace peeler
