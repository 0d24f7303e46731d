// SPDX-License-Identifier: Apache-2.0
// Tests the corners of points, lines and triangles in every topology.
#include "core/scene/elements.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <vector>

namespace peeler {
namespace {

using Vertices = std::vector<std::size_t>;

std::vector<Vertices> all(const Primitive& primitive, std::uint32_t count) {
    std::vector<Vertices> result;
    for (std::uint32_t e = 0; e < count; ++e) {
        const Corners corners = cornersOf(primitive, e);
        result.emplace_back(corners.vertex.begin(), corners.vertex.begin() + corners.count);
    }
    return result;
}

Primitive made(Topology topology, std::size_t vertices) {
    Primitive primitive;
    primitive.topology = topology;
    primitive.positions.resize(vertices);
    return primitive;
}

TEST(PrimitiveCorners, AreThoseThatGlDraws) {
    using List = std::vector<Vertices>;
    EXPECT_EQ(all(made(Topology::kPoints, 3), 3), (List{{0}, {1}, {2}}));
    EXPECT_EQ(all(made(Topology::kLines, 4), 2), (List{{0, 1}, {2, 3}}));
    EXPECT_EQ(all(made(Topology::kLineStrip, 3), 2), (List{{0, 1}, {1, 2}}));
    EXPECT_EQ(all(made(Topology::kLineLoop, 3), 3), (List{{0, 1}, {1, 2}, {2, 0}}));
    EXPECT_EQ(all(made(Topology::kTriangles, 6), 2), (List{{0, 1, 2}, {3, 4, 5}}));
    EXPECT_EQ(all(made(Topology::kTriangleStrip, 5), 3), (List{{0, 1, 2}, {2, 1, 3}, {2, 3, 4}}));
    EXPECT_EQ(all(made(Topology::kTriangleFan, 5), 3), (List{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST(PrimitiveCorners, GoThroughTheIndices) {
    Primitive primitive = made(Topology::kTriangleStrip, 9);
    primitive.indices = {8, 6, 4, 2};
    EXPECT_EQ(all(primitive, 2), (std::vector<Vertices>{{8, 6, 4}, {4, 6, 2}}));
}

TEST(RecentElements, AreTheElementsOfTheirKeys) {
    // More triangles than the cache holds, so that many are replaced.
    Scene scene;
    scene.materials.resize(1);
    Primitive& primitive = scene.meshes.emplace_back().primitives.emplace_back();
    std::mt19937 random(7);
    for (int i = 0; i < 3 * 3000; ++i)
        primitive.positions.emplace_back(random() % 17, random() % 13, random() % 5);
    scene.nodes.resize(2);
    scene.nodes[0].mesh = scene.nodes[1].mesh = 0;
    scene.nodes[1].local = glm::scale(glm::dmat4(1), glm::dvec3(-1, 2, 3));
    scene.scenes = {{"", {0, 1}}};
    const PosedScene shown(scene);
    RecentElements recent(shown, true);
    for (int i = 0; i < 20000; ++i) {
        const auto key = static_cast<std::uint32_t>(1 + random() % 6000);
        WorldElement element = elementOf(shown, key);
        placeCorners(shown, element);
        const RecentElements::Entry& entry = recent.at(key);
        ASSERT_EQ(entry.element.origin.in_mesh, element.origin.in_mesh);
        ASSERT_EQ(entry.element.instance, element.instance);
        ASSERT_EQ(entry.element.corner, element.corner);
        ASSERT_EQ(entry.normal, element.normal());
        const double size = glm::length(element.normal());
        ASSERT_NEAR(glm::length(entry.unit), size > 0 ? 1 : 0, 1e-12);
        ASSERT_NEAR(glm::dot(entry.unit, entry.normal), size, 1e-12 * size);
    }
}

TEST(PrimitiveCorners, VerticesThatAreLeftOverMakeNothing) {
    struct Row {
        Topology topology;
        std::uint64_t of_none, of_one, of_two, of_five;
    };
    for (const Row& row :
         {Row{Topology::kPoints, 0, 1, 2, 5}, Row{Topology::kLines, 0, 0, 1, 2},
          Row{Topology::kLineLoop, 0, 0, 2, 5}, Row{Topology::kLineStrip, 0, 0, 1, 4},
          Row{Topology::kTriangles, 0, 0, 0, 1}, Row{Topology::kTriangleStrip, 0, 0, 0, 3},
          Row{Topology::kTriangleFan, 0, 0, 0, 3}}) {
        EXPECT_EQ(elementsOf(made(row.topology, 0)), row.of_none);
        EXPECT_EQ(elementsOf(made(row.topology, 1)), row.of_one);
        EXPECT_EQ(elementsOf(made(row.topology, 2)), row.of_two);
        EXPECT_EQ(elementsOf(made(row.topology, 5)), row.of_five);
    }
    Primitive indexed = made(Topology::kTriangles, 3);
    indexed.indices = {0, 1, 2, 2, 1, 0, 1};
    EXPECT_EQ(elementsOf(indexed), 2U);
}

}  // namespace
}  // namespace peeler
