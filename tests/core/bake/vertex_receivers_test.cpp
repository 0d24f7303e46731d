// SPDX-License-Identifier: Apache-2.0
// Tests vertex receivers: positions, normals, and values interpolated between them.
#include "core/bake/receivers.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>

#include "support/one_mesh.h"

namespace peeler {
namespace {

using test::oneMesh;

/// Returns the triangle (0,0,0) (1,0,0) (0,1,0), whose front faces +Z.
Primitive triangle() {
    Primitive primitive;
    primitive.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    return primitive;
}

struct PlacedVertices {
    explicit PlacedVertices(Scene from)
        : scene(std::move(from)), shown(scene, 0), vertices(shown) {}

    Scene scene;
    PosedScene shown;
    VertexReceivers vertices;
    const Receivers& receivers = vertices.receivers();
};

void expectVector(const glm::vec3& found, const glm::vec3& expected) {
    EXPECT_LT(glm::length(found - expected), 1e-6)
        << found.x << ' ' << found.y << ' ' << found.z << ", expected " << expected.x << ' '
        << expected.y << ' ' << expected.z;
}

TEST(VertexReceivers, StandWhereTheNodePutsThem) {
    const glm::dmat4 place = glm::rotate(glm::translate(glm::dmat4(1), glm::dvec3(5, 0, 0)),
                                         glm::radians(90.0), glm::dvec3(1, 0, 0));
    const PlacedVertices placed(oneMesh({triangle()}, place));
    ASSERT_EQ(placed.receivers.size(), 3U);
    expectVector(placed.receivers.positions[0], {5, 0, 0});
    expectVector(placed.receivers.positions[2], {5, 0, 1});
    for (const glm::vec3& normal : placed.receivers.normals)
        expectVector(normal, {0, -1, 0});
}

TEST(VertexReceivers, TakeTheVerticesOwnNormalsAndTurnThemAsSurfacesTurn) {
    Primitive primitive = triangle();
    primitive.normals.assign(3, glm::normalize(glm::vec3(1, 0, 1)));
    primitive.normals[1] = {0, 0, 0};  // the triangle's normal replaces a zero normal
    const PlacedVertices placed(
        oneMesh({primitive}, glm::scale(glm::dmat4(1), glm::dvec3(2, 1, 1))));
    // Stretching x by 2 turns the plane x + z = const into x/2 + z = const.
    expectVector(placed.receivers.normals[0], glm::normalize(glm::vec3(0.5F, 0, 1)));
    expectVector(placed.receivers.normals[1], {0, 0, 1});
}

TEST(VertexReceivers, StayOnTheFrontOfMirroredInstances) {
    // The front of a mirrored instance is the side that was counter-clockwise before mirroring, so
    // the receivers still face +Z.
    const glm::dmat4 mirror = glm::scale(glm::dmat4(1), glm::dvec3(-1, 1, 1));
    Primitive with_normals = triangle();
    with_normals.normals.assign(3, {0, 0, 1});
    for (const Primitive& primitive : {triangle(), with_normals}) {
        const PlacedVertices placed(oneMesh({primitive}, mirror));
        expectVector(placed.receivers.positions[1], {-1, 0, 0});
        for (const glm::vec3& normal : placed.receivers.normals)
            expectVector(normal, {0, 0, 1});
    }
}

TEST(VertexReceivers, WithoutNormalsTakeTheMeanOfTheirTrianglesByArea) {
    // Vertex 0 belongs to a triangle of area 1/2 that faces +Z and one of area 1 that faces +X.
    Primitive primitive = triangle();
    primitive.positions.insert(primitive.positions.end(), {{0, 2, 0}, {0, 0, 1}, {9, 9, 9}});
    primitive.indices = {0, 1, 2, 0, 3, 4};
    const PlacedVertices placed(oneMesh({primitive}));
    expectVector(placed.receivers.normals[0], glm::normalize(glm::vec3(2, 0, 1)));
    expectVector(placed.receivers.normals[1], {0, 0, 1});
    expectVector(placed.receivers.normals[3], {1, 0, 0});
    // A vertex without triangles has no normal and no rays.
    expectVector(placed.receivers.normals[5], {0, 0, 0});
}

TEST(VertexReceivers, FollowDeformedMeshes) {
    Primitive primitive = triangle();
    MorphTarget target;
    target.positions = {{0, 0, 0}, {-1, 0, 1}, {0, 0, 0}};  // moves the second corner to (0,0,1)
    primitive.targets = {target};
    Scene scene = oneMesh({primitive});
    scene.meshes[0].weights = {1};
    const PlacedVertices placed(scene);
    expectVector(placed.receivers.positions[1], {0, 0, 1});
    expectVector(placed.receivers.normals[0], {-1, 0, 0});
}

TEST(VertexReceivers, AreListedByInstanceAndPrimitive) {
    Scene scene = oneMesh({triangle()});
    Primitive lines = triangle();
    lines.topology = Topology::kLineStrip;
    scene.meshes[0].primitives = {lines, triangle()};
    scene.nodes[0].instances = {{glm::dmat4(1), glm::translate(glm::dmat4(1), {0, 0, 7})}};
    const PlacedVertices placed(scene);
    ASSERT_EQ(placed.vertices.ranges().size(), 4U);
    EXPECT_EQ(placed.vertices.range(0, 0).count, 0U);
    EXPECT_EQ(placed.vertices.range(1, 1).first, 3U);
    EXPECT_EQ(placed.receivers.size(), 6U);
    expectVector(placed.receivers.positions[3], {0, 0, 7});
}

TEST(VertexReceivers, InterpolateTheCornersOfAKey) {
    Scene scene = oneMesh({triangle()});
    Primitive strip = triangle();
    strip.topology = Topology::kTriangleStrip;
    strip.positions.push_back({1, 1, 0});
    scene.meshes[0].primitives = {triangle(), strip};
    const PlacedVertices placed(scene);
    const SurfaceLookup lookup = placed.vertices.lookup();
    std::vector<float> values;  // (n, 10 n, 1) for each vertex number n
    for (int i = 0; i < 7; ++i)
        values.insert(values.end(), {static_cast<float>(i), 10.0F * static_cast<float>(i), 1});
    expectVector(lookup(values, 1, {0.25F, 0.5F}), {1.25F, 12.5F, 1});
    // In GL, the second triangle of a strip has the corners 2, 1, 3, which are receivers 5, 4, 6.
    expectVector(lookup(values, 3, {0, 0}), {5, 50, 1});
    expectVector(lookup(values, 3, {1, 0}), {4, 40, 1});
    expectVector(lookup(values, 3, {0, 1}), {6, 60, 1});
}

}  // namespace
}  // namespace peeler
