// SPDX-License-Identifier: Apache-2.0
// Tests closed surfaces, and the mapping from keys to solids.
#include "core/rays/solids.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>
#include <random>

#include "core/scene/draw_list.h"
#include "support/one_mesh.h"
#include "support/ray_hits.h"

namespace peeler::test {
namespace {

/// Returns a sphere of quads between parallels. The poles are rows of equal vertices, so half of
/// the triangles there are degenerate. If `open`, the first and last rows of quads are missing.
Primitive globe(int columns, int rows, bool open, int material = 0, float radius = 1) {
    Primitive primitive;
    primitive.material = material;
    for (int row = 0; row <= rows; ++row) {
        for (int column = 0; column <= columns; ++column) {
            // At the seam and the poles, coordinates must be bitwise identical.
            const double u = 2 * std::numbers::pi * (column % columns) / columns;
            const double v = std::numbers::pi * row / rows;
            const double ring = row == 0 || row == rows ? 0 : std::sin(v);
            primitive.positions.emplace_back(radius * static_cast<float>(ring * std::cos(u)),
                                             radius * static_cast<float>(std::cos(v)),
                                             radius * static_cast<float>(ring * std::sin(u)));
        }
    }
    const auto at = [&](int row, int column) {
        return static_cast<std::uint32_t>(row * (columns + 1) + column);
    };
    for (int row = open ? 1 : 0; row < (open ? rows - 1 : rows); ++row) {
        for (int column = 0; column < columns; ++column) {
            for (const std::uint32_t index :
                 {at(row, column), at(row, column + 1), at(row + 1, column + 1), at(row, column),
                  at(row + 1, column + 1), at(row + 1, column)})
                primitive.indices.push_back(index);
        }
    }
    return primitive;
}

/// Returns one side of the cube from −1 to 1, with a material of its own.
Primitive cubeSide(int side) {
    const int axis = side / 2;
    const float sign = side % 2 == 0 ? -1.0F : 1.0F;
    Primitive primitive;
    primitive.material = side;
    primitive.topology = Topology::kTriangleStrip;
    for (const float a : {-1.0F, 1.0F}) {
        for (const float b : {-1.0F, 1.0F}) {
            glm::vec3 p(0);
            p[axis] = sign;
            p[(axis + 1) % 3] = a;
            p[(axis + 2) % 3] = b;
            primitive.positions.push_back(p);
        }
    }
    return primitive;
}

struct Found {
    std::vector<std::size_t> primitives;
    std::uint64_t triangles = 0, open_edges = 0;
    bool operator==(const Found&) const = default;
};

std::vector<Found> found(const Solids& solids) {
    std::vector<Found> result;
    for (const Solid& s : solids.all())
        result.push_back({{s.primitives.begin(), s.primitives.end()}, s.triangles, s.open_edges});
    return result;
}

std::vector<Found> solidsOf(std::vector<Primitive> primitives) {
    const Scene scene = oneMesh(std::move(primitives));
    return found(Solids(PosedScene(scene, 0)));
}

using List = std::vector<Found>;

TEST(Solids, SidesOfDifferentMaterialsAreOneCube) {
    std::vector<Primitive> sides;
    for (int i = 0; i < 6; ++i)
        sides.push_back(cubeSide(i));
    const Scene scene = oneMesh(sides);
    const Solids solids(PosedScene(scene, 0));
    EXPECT_EQ(found(solids), (List{{{0, 1, 2, 3, 4, 5}, 12, 0}}));
    for (std::uint32_t key = 1; key <= 12; ++key) {
        EXPECT_EQ(solids.solidOf(key), 0U);
        EXPECT_EQ(solids.materialOf(key), (key - 1) / 2);
    }
    sides.pop_back();
    EXPECT_EQ(solidsOf(sides), (List{{{0, 1, 2, 3, 4}, 10, 4}}));
}

TEST(Solids, ASphereIsClosedWhateverItsPolesAndSeamAreMadeOf) {
    // 12 by 7 quads are 168 triangles. Half of the 48 triangles at the poles are degenerate.
    EXPECT_EQ(solidsOf({globe(12, 7, false)}), (List{{{0}, 144, 0}}));
    EXPECT_EQ(solidsOf({globe(12, 7, true)}), (List{{{0}, 120, 24}}));
}

TEST(Solids, PrimitivesThatAreClosedStandAlone) {
    const Primitive outer = globe(8, 4, false, 0), inner = globe(8, 4, false, 1, 0.5F);
    EXPECT_EQ(solidsOf({outer, inner}), (List{{{0}, 48, 0}, {{1}, 48, 0}}));
    // The sphere is closed by itself. The two sides of the cube together are open.
    EXPECT_EQ(solidsOf({cubeSide(0), inner, cubeSide(1)}), (List{{{1}, 48, 0}, {{0, 2}, 4, 8}}));
}

TEST(Solids, ZeroHasTwoSigns) {
    Primitive one = tetrahedron();
    for (std::size_t i = 0; i < 3; ++i)
        for (int axis = 0; axis < 3; ++axis)
            if (one.positions[i][axis] == 0) one.positions[i][axis] = -0.0F;
    EXPECT_EQ(solidsOf({one}), (List{{{0}, 4, 0}}));
    one.positions[0].x = 1e-30F;
    EXPECT_EQ(solidsOf({one}), (List{{{0}, 4, 4}}));
}

TEST(Solids, AnEdgeOfFourTrianglesIsNotOpen) {
    Primitive twice = tetrahedron();  // two tetrahedra that touch along an edge
    const Primitive once = tetrahedron();
    for (glm::vec3 p : once.positions) {
        p.x = -p.x;
        p.y = -p.y;
        twice.positions.push_back(p);
    }
    EXPECT_EQ(solidsOf({twice}), (List{{{0}, 8, 0}}));
}

TEST(Solids, LinesAndPointsBelongToNone) {
    Primitive lines = tetrahedron();
    lines.topology = Topology::kLines;
    const Scene scene = oneMesh({lines, tetrahedron()});
    const Solids solids(PosedScene(scene, 0));
    EXPECT_EQ(found(solids), (List{{{1}, 4, 0}}));
    EXPECT_EQ(solids.solidOf(6), Solids::kNone);
    EXPECT_EQ(solids.solidOf(7), 0U);
    EXPECT_EQ(solidsOf({lines}), List{});
}

TEST(Solids, ADeformedMeshHasItsOwnTopology) {
    Scene scene = oneMesh({tetrahedron()});
    Primitive& primitive = scene.meshes[0].primitives[0];
    MorphTarget& target = primitive.targets.emplace_back();
    target.positions.resize(primitive.positions.size());
    target.positions[0] += 1;  // moves a corner of one triangle away from the others
    scene.nodes.push_back(scene.nodes[0]);
    scene.nodes[1].weights = {1};
    scene.scenes[0].roots = {0, 1};
    EXPECT_EQ(found(Solids(PosedScene(scene))), (List{{{0}, 4, 0}, {{0}, 4, 4}}));
}

/// Every key maps to the DrawList's element. The scene has everything that makes keys irregular.
TEST(Solids, KeysAreThoseOfTheDrawList) {
    Primitive empty, points;
    points.topology = Topology::kPoints;
    points.positions.resize(3);
    Primitive masked = tetrahedron(2);  // not drawn, since its alpha is below the cutoff
    Scene scene = oneMesh({empty, tetrahedron(1), points, masked, empty, cubeSide(3), empty});
    scene.materials[2].alpha_mode = AlphaMode::kMask;
    scene.materials[2].base_color.a = 0;
    scene.materials.resize(5);
    scene.meshes.push_back({"", {tetrahedron(4)}});
    scene.nodes.resize(3);
    scene.nodes[1].mesh = 1;
    scene.nodes[1].instances = {glm::dmat4(1), glm::scale(glm::dmat4(1), {-1, 1, 1}),
                                glm::dmat4(2)};
    scene.nodes[2].mesh = 0;
    scene.scenes[0].roots = {0, 1, 2};
    const PosedScene shown(scene, 0);
    const DrawList& list = shown.drawList();
    const Solids solids(shown);
    ASSERT_EQ(solids.all().size(), 3U + 3U + 3U);
    const std::uint32_t keys = 2 * (4 + 3 + 4 + 2) + 3 * 4;
    for (std::uint32_t key = 1; key <= keys; ++key) {
        const KeyOrigin origin = list.originOf(key);
        const MeshInstance& instance = shown.meshes()[origin.instance];
        const Primitive& primitive =
            scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives[origin.primitive];
        EXPECT_EQ(solids.materialOf(key), static_cast<std::size_t>(primitive.material));
        const std::uint32_t index = solids.solidOf(key);
        if (primitive.topology == Topology::kPoints) {
            EXPECT_EQ(index, Solids::kNone);
            continue;
        }
        ASSERT_LT(index, solids.all().size());
        const Solid& solid = solids.all()[index];
        EXPECT_EQ(solid.instance, origin.instance) << key;
        EXPECT_EQ(solid.node, instance.node);
        EXPECT_EQ(std::ranges::count(solid.primitives, origin.primitive), 1) << key;
    }
}

TEST(Solids, AWindingNumberNeedsTrianglesThatFaceOutwards) {
    const auto facing = [](Primitive mesh) {
        Scene scene = oneMesh({std::move(mesh)});
        return Solids(PosedScene(scene)).all().at(0).facing;
    };
    Primitive inward = tetrahedron(), mixed = tetrahedron(), open = tetrahedron();
    for (std::size_t i = 0; i < 12; i += 3)
        std::swap(inward.positions[i], inward.positions[i + 1]);
    std::swap(mixed.positions[0], mixed.positions[1]);
    open.positions.resize(9);
    EXPECT_EQ(facing(tetrahedron()), SolidFacing::kOutward);
    EXPECT_EQ(facing(inward), SolidFacing::kInward);
    EXPECT_EQ(facing(mixed), SolidFacing::kMixed);
    EXPECT_EQ(facing(open), SolidFacing::kMixed);
}

TEST(SolidSpansByWinding, ARayIsInsideUntilItHasLeftAsOftenAsEntered) {
    const Scene scene = bodies(2);
    const PosedScene posed(scene);
    const Solids solids(posed);
    // Along +z, the first triangle of a tetrahedron faces the rays, the third faces away.
    const Bounds box{{0, 0, 0}, {1, 1, 1}};
    const Bundle bundle = parallelBundle("z", box, box, {0, 0, 1}, {4});
    const TriangleSides sides(posed, {&bundle, 1});
    SolidSpans spans;
    const std::vector<float> t{1, 2, 3, 4, 5, 6};
    const auto found = [&](const std::vector<int>& of, const std::vector<int>& turns) {
        std::vector<std::uint32_t> keys;
        for (std::size_t i = 0; i < of.size(); ++i)
            keys.push_back(keyOf(of[i]) + (turns.empty() || turns[i] > 0 ? 0 : 2));
        for (std::size_t i = 0; i < turns.size(); ++i)
            EXPECT_EQ(sides.turn(keys[i]), turns[i]);
        spans.find(std::span(t).first(of.size()), keys, solids, turns.empty() ? nullptr : &sides);
        std::vector<RayInterval> intervals;
        for (const SolidSpan& span : spans.all())
            intervals.push_back(span);
        return intervals;
    };
    using Intervals = std::vector<RayInterval>;
    const std::vector<int> four(4, 0);
    EXPECT_EQ(found(four, {1, 1, -1, -1}), (Intervals{{1, 4}}));
    EXPECT_EQ(found(four, {1, -1, 1, -1}), (Intervals{{1, 2}, {3, 4}}));
    EXPECT_EQ(found(four, {}), (Intervals{{1, 2}, {3, 4}})) << "parity";
    // The ray enters twice, leaves twice, then enters and leaves once.
    EXPECT_EQ(found({0, 0, 0, 0, 0, 0}, {1, 1, -1, -1, 1, -1}), (Intervals{{1, 4}, {5, 6}}));
    // Parity decides if a ray does not leave as often as it enters.
    EXPECT_EQ(found(four, {1, 1, 1, -1}), (Intervals{{1, 2}, {3, 4}}));
    // Two solids that overlap have separate intervals.
    EXPECT_EQ(found({0, 1, 0, 1}, {1, 1, -1, -1}), (Intervals{{1, 3}, {2, 4}}));
}

// Rays that cross the same solids as the ray before take a shorter way.
TEST(SolidSpansByWinding, ARayDoesNotDependOnTheRayBefore) {
    const Scene scene = bodies(2);
    const PosedScene posed(scene);
    const Solids solids(posed);
    const Bounds box{{0, 0, 0}, {1, 1, 1}};
    const Bundle bundle = parallelBundle("z", box, box, {0, 0, 1}, {4});
    const TriangleSides sides(posed, {&bundle, 1});
    std::mt19937 random(7);
    SolidSpans reused;
    std::vector<std::uint32_t> keys;
    for (int ray = 0; ray < 20000; ++ray) {
        if (ray % 3 == 0) {
            keys.resize(random() % 7);
            for (std::uint32_t& key : keys)
                key = keyOf(static_cast<int>(random() % 2)) + (random() % 2 == 0 ? 0 : 2);
        }
        std::vector<float> t;
        for (std::size_t i = 0; i < keys.size(); ++i)
            t.push_back((i == 0 ? 0 : t.back()) + static_cast<float>(random() % 3));
        const TriangleSides* const known = ray % 5 < 3 ? &sides : nullptr;
        SolidSpans fresh;
        fresh.find(t, keys, solids, known);
        reused.find(t, keys, solids, known);
        ASSERT_TRUE(std::ranges::equal(reused.all(), fresh.all(), [](const auto& a, const auto& b) {
            return a == b && a.solid == b.solid && a.key == b.key && a.hit == b.hit;
        })) << ray;
        ASSERT_TRUE(std::ranges::equal(reused.hits(), fresh.hits(),
                                       [](const auto& a, const auto& b) {
                                           return a.number == b.number &&
                                                  a.item.hits == b.item.hits &&
                                                  a.item.last == b.item.last;
                                       }))
            << ray;
    }
}

}  // namespace
}  // namespace peeler::test
