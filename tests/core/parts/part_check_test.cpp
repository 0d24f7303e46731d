// SPDX-License-Identifier: Apache-2.0
// Tests checks of parts as solid bodies: connectivity, volume, wall thickness.
#include "core/parts/crossings.h"
#include "core/parts/volumes.h"
#include "core/parts/wall_thickness.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <numbers>
#include <random>

#include "core/parts/part_mesh.h"
#include "support/closed_meshes.h"
#include "support/one_mesh.h"

namespace peeler {
namespace {

using test::cube;
using test::icosphere;
using test::oneMesh;
using test::placed;

/// A part and the results of all checks.
struct Checked {
    explicit Checked(PartMesh mesh)
        : raw(std::move(mesh)),
          topology(findTopology(raw)),
          sides(findSides(PartTree(raw), topology)),
          turned(turnedBack(raw, topology, sides)),
          tree(turned),
          crossings(findCrossings(tree)) {}
    Checked(std::vector<Primitive> primitives, const glm::dmat4& at = glm::dmat4(1))
        : Checked(meshOf(std::move(primitives), at)) {}

    static PartMesh meshOf(std::vector<Primitive> primitives, const glm::dmat4& at) {
        const Scene scene = oneMesh(std::move(primitives), at);
        const PosedScene posed(scene);
        return partMesh(posed, posed.meshes().front());
    }
    double volume() const { return volumeOf(turned); }
    double united() const { return unionVolume(tree, topology, crossings).value_or(-1); }
    double wall() const {
        const auto wall = thinnestWall(tree).wall;
        return wall ? wall->thickness : -1;
    }
    bool good() const {
        return topology.closed() && topology.crowded.empty() && topology.turned.empty() &&
               crossings.pairs.empty() && std::ranges::all_of(sides, [](ShellSide side) {
                   return side == ShellSide::kOutside || side == ShellSide::kCavity;
               });
    }

    PartMesh raw;
    PartTopology topology;
    std::vector<ShellSide> sides;
    PartMesh turned;
    PartTree tree;
    Crossings crossings;
};

Primitive box(const glm::vec3& min, const glm::vec3& max) {
    Primitive box = cube();
    for (glm::vec3& p : box.positions)
        p = min + (p + 1.0F) / 2.0F * (max - min);
    return box;
}

Primitive inwards(Primitive mesh) {
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        std::swap(mesh.indices[i], mesh.indices[i + 1]);
    return mesh;
}

/// Returns a rigid transformation after which no plane of the part is axis-aligned.
glm::dmat4 askew() {
    return glm::rotate(glm::translate(glm::dmat4(1), {3, -1, 2}), 0.7,
                       glm::normalize(glm::dvec3(1, 2, -0.5)));
}

TEST(PartCheck, ACubeIsGoodAndHasItsVolumeAreaAndWall) {
    for (const glm::dmat4& at : {glm::dmat4(1), askew()}) {
        const Checked part({cube()}, at);
        EXPECT_TRUE(part.good());
        EXPECT_EQ(part.raw.points.size(), 8U);
        ASSERT_EQ(part.sides.size(), 1U);
        EXPECT_EQ(part.sides[0], ShellSide::kOutside);
        EXPECT_NEAR(part.volume(), 8, 1e-12);
        EXPECT_NEAR(part.united(), 8, 1e-12);
        EXPECT_NEAR(areaOf(part.raw), 24, 1e-12);
        EXPECT_NEAR(part.wall(), 2, 1e-12);
    }
}

TEST(PartCheck, AMirroredPartStillFacesOutwards) {
    const Checked part({cube()}, glm::scale(glm::dmat4(1), {-1, 2, 1}));
    EXPECT_TRUE(part.good());
    EXPECT_NEAR(part.volume(), 16, 1e-12);
}

TEST(PartCheck, VerticesAtOnePlaceAreOnePointAcrossPrimitives) {
    Primitive lower = cube(), upper = cube();
    lower.indices.resize(18);
    upper.indices.erase(upper.indices.begin(), upper.indices.begin() + 18);
    const Checked part({lower, upper});
    EXPECT_TRUE(part.good());
    EXPECT_EQ(part.topology.shells.size(), 1U);
}

TEST(PartCheck, MinusZeroIsZero) {
    Primitive lower = placed(cube(), 1, {1, 0, 0}), upper = lower;
    lower.indices.resize(18);
    upper.indices.erase(upper.indices.begin(), upper.indices.begin() + 18);
    for (glm::vec3& p : upper.positions)
        if (p.x == 0) p.x = -0.0F;
    EXPECT_TRUE(Checked({lower, upper}).good());
}

TEST(PartCheck, AMissingTriangleLeavesThreeEdgesOpenAroundOneHole) {
    Primitive mesh = cube();
    mesh.indices.resize(mesh.indices.size() - 3);
    const Checked part({mesh});
    EXPECT_EQ(part.topology.open.size(), 3U);
    EXPECT_EQ(part.topology.holes, 1U);
    EXPECT_EQ(part.sides[0], ShellSide::kOpen);
    EXPECT_TRUE(part.topology.crowded.empty());
}

TEST(PartCheck, ATJunctionIsOpen) {
    // Only one of the two triangles at a face's diagonal gets a vertex in the middle of the
    // diagonal.
    Primitive mesh = cube();
    mesh.indices.resize(mesh.indices.size() - 3);  // removes triangle 1, 7, 5 of the face x = 1
    const auto middle = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.emplace_back(1, 0, 0);
    mesh.indices.insert(mesh.indices.end(), {1, middle, 5, middle, 7, 5});
    const Checked part({mesh});
    // The open edges are the whole diagonal and its two halves.
    EXPECT_EQ(part.topology.open.size(), 3U);
    EXPECT_EQ(part.topology.holes, 1U);
}

TEST(PartCheck, AFlippedTriangleIsFoundAndTurnedBack) {
    for (const std::uint32_t flipped : {0U, 3U, 11U}) {
        Primitive mesh = cube();
        std::swap(mesh.indices[3 * flipped], mesh.indices[3 * flipped + 1]);
        const Checked part({mesh});
        EXPECT_TRUE(part.topology.closed());
        EXPECT_EQ(part.topology.turned, std::vector<std::uint32_t>{flipped});
        EXPECT_EQ(part.sides[0], ShellSide::kOutside);
        EXPECT_NEAR(part.volume(), 8, 1e-12);
    }
}

TEST(PartCheck, ACubeInsideOutIsFoundAndTurnedBack) {
    const Checked part({inwards(cube())});
    EXPECT_TRUE(part.topology.turned.empty());
    EXPECT_EQ(part.sides, std::vector<ShellSide>{ShellSide::kInsideOut});
    EXPECT_NEAR(part.volume(), 8, 1e-12);
}

TEST(PartCheck, PointsOfOpenEdgesAreWeldedWithinTheTolerance) {
    // A box with sides of 10. Each triangle has corners of its own, off by at most 1e-6 along each
    // axis.
    std::mt19937 random(45);
    std::uniform_real_distribution<double> noise(-1e-6, 1e-6);
    const PartMesh exact = Checked::meshOf({box({0, 0, 0}, {10, 10, 10})}, glm::dmat4(1));
    PartMesh mesh;
    for (std::size_t t = 0; t < exact.triangles.size(); ++t) {
        for (const glm::dvec3& p : exact.corners(t))
            mesh.points.push_back(p + glm::dvec3(noise(random), noise(random), noise(random)));
        const auto first = static_cast<std::uint32_t>(3 * t);
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    const std::vector<std::uint32_t> open = pointsOf(findTopology(mesh).open);
    EXPECT_EQ(open.size(), 36U);
    EXPECT_EQ(weldPoints(mesh, open, 1e-9).points.size(), 36U);
    const Checked welded(weldPoints(mesh, open, 1e-5));
    EXPECT_EQ(welded.raw.points.size(), 8U);
    EXPECT_TRUE(welded.good());
    EXPECT_NEAR(welded.volume(), 1000, 1e-3);
    EXPECT_NEAR(welded.wall(), 10, 1e-4);
    // All points are within the tolerance, so they merge into one.
    const PartMesh point = weldPoints(mesh, open, 100);
    EXPECT_TRUE(point.triangles.empty());
    EXPECT_EQ(point.degenerate, 12U);
}

TEST(PartCheck, OmittedFacesHaveNoWall) {
    const Checked part({box({0, 0, 0}, {10, 20, 30})});
    std::vector<char> omitted(12);
    EXPECT_NEAR(thinnestWall(part.tree, omitted).wall->thickness, 10, 1e-9);
    for (std::uint32_t t = 0; t < 12; ++t)
        omitted[t] = std::abs(part.turned.normal(t).x) > 0 ? 1 : 0;
    EXPECT_NEAR(thinnestWall(part.tree, omitted).wall->thickness, 20, 1e-9);
}

TEST(PartCheck, ACavityIsTakenAway) {
    const Checked part({cube(), inwards(placed(cube(), 0.5F, {0.1F, 0, 0}))}, askew());
    EXPECT_TRUE(part.good());
    EXPECT_EQ(part.sides, (std::vector{ShellSide::kOutside, ShellSide::kCavity}));
    EXPECT_NEAR(part.volume(), 7, 1e-6);
    EXPECT_NEAR(part.united(), 7, 1e-6);
    EXPECT_NEAR(part.wall(), 0.4, 1e-6);
    const Checked filled({cube(), placed(cube(), 0.5F, {0.1F, 0, 0})});
    EXPECT_EQ(filled.sides, (std::vector{ShellSide::kOutside, ShellSide::kInside}));
    EXPECT_NEAR(filled.volume(), 9, 1e-6);
    EXPECT_NEAR(filled.united(), 8, 1e-6);
    EXPECT_NEAR(filled.wall(), 2, 1e-6) << "what is inside of the other is no surface";
}

TEST(PartCheck, CubesThatOverlapCrossAndTheirUnionIsLess) {
    for (const glm::dmat4& at : {glm::dmat4(1), askew()}) {
        const Checked part({cube(), placed(cube(), 1, {1, 1, 1})}, at);
        EXPECT_FALSE(part.crossings.pairs.empty());
        EXPECT_NEAR(part.volume(), 16, 1e-9);
        EXPECT_NEAR(part.united(), 15, 1e-9);
        EXPECT_NEAR(part.wall(), 2, 1e-5);
    }
}

TEST(PartCheck, TheCurveWhereCubesCrossHasItsLength) {
    // Each face of the common box that belongs to one cube meets two of the other: six segments.
    for (const glm::vec3& by : {glm::vec3(1, 1, 1), {0.75F, 1, 1.25F}, {0.5F, 0.25F, 1.5F}}) {
        for (const glm::dmat4& at : {glm::dmat4(1), askew()}) {
            const Checked part({cube(), placed(cube(), 1, by)}, at);
            const double length = 2 * (6 - by.x - by.y - by.z) * glm::length(glm::dvec3(at[0]));
            EXPECT_NEAR(CrossingCurve(part.turned).length(part.crossings.pairs), length, 1e-5);
        }
    }
    const Checked flat({cube(), placed(cube(), 1, {0.5F, 0.25F, 0})});
    const CrossingCurve curve(flat.turned);
    EXPECT_TRUE(std::ranges::any_of(flat.crossings.pairs, [&](const CrossingPair& pair) {
        return !curve.segment(pair);
    })) << "the faces in one plane";
}

TEST(PartCheck, CubesThatOverlapWithSidesInOnePlaneHaveTheirUnion) {
    for (const glm::vec3& by : {glm::vec3(1, 0, 0), {0.5F, 0.25F, 0}, {0, 0, 1.5F}}) {
        const Checked part({cube(), placed(cube(), 1, by)});
        EXPECT_FALSE(part.crossings.pairs.empty());
        const double common = (2 - by.x) * (2.0 - by.y) * (2 - by.z);
        EXPECT_NEAR(part.united(), 16 - common, 1e-9) << by.x;
    }
    const Checked apart({cube(), placed(cube(), 1, {3, 0, 0})});
    EXPECT_TRUE(apart.good());
    EXPECT_NEAR(apart.united(), 16, 1e-9);
}

TEST(PartCheck, BoxesTurnedAgainstEachOtherHaveTheUnionOfTheirOctagon) {
    Primitive turned = cube();
    for (glm::vec3& p : turned.positions)
        p = {(p.x - p.y) * std::numbers::sqrt2_v<float> / 2,
             (p.x + p.y) * std::numbers::sqrt2_v<float> / 2, p.z / 2 + 0.1F};
    for (const glm::dmat4& at : {glm::dmat4(1), askew()}) {
        const Checked part({cube(), turned}, at);
        const double octagon = 8 * (std::numbers::sqrt2 - 1);
        EXPECT_NEAR(part.volume(), 12, 1e-6);
        EXPECT_NEAR(part.united(), 12 - octagon, 1e-6);
    }
}

TEST(PartCheck, BodiesThatTouchDoNotCross) {
    Primitive other = placed(cube(), 0.5F, {1.5F, 0, 0});
    const Checked part({cube(), other});
    EXPECT_TRUE(part.good());
    EXPECT_NEAR(part.united(), 9, 1e-9);
}

TEST(PartCheck, SpheresThatOverlapHaveTheUnionOfTheirLens) {
    const Primitive sphere = icosphere(3);
    const Checked part({sphere, placed(sphere, 1, {0.9F, 0.05F, 0.02F})});
    EXPECT_FALSE(part.crossings.pairs.empty());
    const double apart = glm::length(glm::dvec3(0.9, 0.05, 0.02));
    const double lens = std::numbers::pi * (4 + apart) * (2 - apart) * (2 - apart) / 12;
    // Flat facets shrink the lens and the spheres by the same factor.
    const double one = test::volumeOf(sphere);
    EXPECT_NEAR(part.united(), 2 * one - lens * one / (4 * std::numbers::pi / 3), 0.01);
    EXPECT_LT(part.united(), part.volume() - 1);
}

/// The corners are random integers, so that many faces of the boxes are coplanar.
TEST(PartCheck, ManyBoxesHaveTheUnionOfTheirCells) {
    constexpr int kCells = 12;
    std::mt19937 random(42);
    std::vector<Primitive> boxes;
    std::array<bool, kCells * kCells * kCells> filled{};
    for (int i = 0; i < 60; ++i) {
        glm::ivec3 min, max;
        for (int axis = 0; axis < 3; ++axis) {
            min[axis] = int(random() % (kCells - 1));
            max[axis] = min[axis] + 1 + int(random() % unsigned(kCells - min[axis]));
        }
        max = glm::min(max, glm::ivec3(kCells));
        boxes.push_back(box(glm::vec3(min), glm::vec3(max)));
        for (int x = min.x; x < max.x; ++x)
            for (int y = min.y; y < max.y; ++y)
                for (int z = min.z; z < max.z; ++z)
                    filled[std::size_t((x * kCells + y) * kCells + z)] = true;
    }
    const double cells = double(std::ranges::count(filled, true));
    for (const glm::dmat4& at : {glm::dmat4(1), askew()}) {
        // The boxes are not welded, because welding would give some edges more than two triangles.
        std::vector<PartMesh> parts;
        std::vector<const PartMesh*> all;
        for (const Primitive& one : boxes)
            parts.push_back(Checked::meshOf({one}, at));
        for (const PartMesh& part : parts)
            all.push_back(&part);
        const Checked part(joinParts(all, false));
        EXPECT_FALSE(part.crossings.more);
        EXPECT_GT(part.volume(), 2 * cells);
        EXPECT_NEAR(part.united(), cells, 1e-9 * cells);
    }
}

TEST(PartCheck, AFaceThatHundredsCrossHasItsExactShare) {
    // 300 posts, each rotated differently, pass through a plate.
    std::vector<Primitive> primitives{box({0, 0, 0}, {100, 1, 100})};
    for (int i = 0; i < 300; ++i) {
        Primitive post = box({-1, -1, -1}, {1, 2, 1});
        const float turn = 0.1F + 0.01F * float(i);
        for (glm::vec3& p : post.positions)
            p = {std::cos(turn) * p.x - std::sin(turn) * p.z + 5 + 5 * float(i % 19), p.y,
                 std::sin(turn) * p.x + std::cos(turn) * p.z + 5 + 5 * float(i / 19)};
        primitives.push_back(post);
    }
    const Checked part(primitives);
    EXPECT_NEAR(part.volume(), 10000 + 300 * 12, 0.01);
    EXPECT_NEAR(part.united(), 10000 + 300 * 8, 0.01) << "a post has 2 x 2 x 1 in the plate";
}

TEST(PartCheck, ABodyWithoutVolumeIsFlat) {
    Primitive sheet;
    sheet.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    sheet.indices = {0, 1, 2, 0, 2, 1};
    const Checked two({sheet}, askew());
    EXPECT_TRUE(two.topology.closed());
    EXPECT_EQ(two.sides, std::vector{ShellSide::kFlat});
    // The first cube is thinner than a millionth of its size, the second is not.
    EXPECT_EQ(Checked({cube()}, glm::scale(askew(), {1, 1e-7, 1})).sides,
              std::vector{ShellSide::kFlat});
    EXPECT_EQ(Checked({cube()}, glm::scale(askew(), {1, 1e-4, 1})).sides,
              std::vector{ShellSide::kOutside});
    EXPECT_EQ(Checked({cube(), placed(sheet, 1, {3, 0, 0})}).sides,
              (std::vector{ShellSide::kOutside, ShellSide::kFlat}));
}

TEST(PartCheck, TwoCubesAtOneEdgeHaveItCrowded) {
    const Checked part({cube(), placed(cube(), 1, {2, 2, 0})});
    ASSERT_EQ(part.topology.crowded.size(), 1U);
    EXPECT_TRUE(part.topology.closed());
    EXPECT_EQ(part.topology.shells.size(), 2U);
    EXPECT_TRUE(part.crossings.pairs.empty());
    EXPECT_NEAR(part.united(), 16, 1e-9);
}

TEST(PartCheck, ASurfaceThatGoesThroughItselfIsFound) {
    // One corner of the cube is pushed through the opposite face.
    Primitive mesh = cube();
    mesh.positions[7] = {-0.3F, -1.5F, 0.2F};
    const Checked part({mesh}, askew());
    EXPECT_TRUE(part.topology.closed());
    EXPECT_EQ(part.topology.shells.size(), 1U);
    EXPECT_FALSE(part.crossings.pairs.empty());
}

TEST(PartCheck, TheThinnestWallIsFoundWhereverItIs) {
    // A hollow box with walls of thickness 1.2 at the bottom and 2 to 4 elsewhere; the floor of the
    // hollow is small.
    const glm::dmat4 millimetres = glm::scale(glm::dmat4(1), glm::dvec3(1e-3));
    for (const glm::dmat4& at : {glm::dmat4(1), askew(), askew() * millimetres}) {
        const double unit = glm::length(glm::dvec3(at[0]));
        const Checked part(
            {box({0, 0, 0}, {40, 20, 30}), inwards(box({2.5F, 1.2F, 2}, {36, 17, 28}))}, at);
        EXPECT_TRUE(part.good());
        const auto wall = thinnestWall(part.tree).wall;
        ASSERT_TRUE(wall);
        EXPECT_NEAR(wall->thickness / unit, 1.2, 2e-6);
        const glm::dvec3 from(glm::inverse(at) * glm::dvec4(wall->from, 1)),
            to(glm::inverse(at) * glm::dvec4(wall->to, 1));
        EXPECT_NEAR(std::min(from.y, to.y), 0, 1e-5);
        EXPECT_NEAR(std::max(from.y, to.y), 1.2, 1e-5);
    }
}

TEST(PartCheck, AWallThatThinsTowardsAPointIsFoundThere) {
    // The floor of the hollow has a downward tip, far from the corners of the outer bottom face.
    Primitive hollow = box({3, 3, 3}, {37, 17, 27});
    const auto tip = static_cast<std::uint32_t>(hollow.positions.size());
    hollow.positions.emplace_back(11.0F, 1.3F, 17.0F);
    // The two triangles of the floor (0 1 5, 0 5 4) become four that meet at the tip.
    for (std::size_t i = 0; i < hollow.indices.size();) {
        int low = 0;
        for (std::size_t k = 0; k < 3; ++k)
            low += hollow.positions[hollow.indices[i + k]].y < 4 ? 1 : 0;
        if (low < 3) {
            i += 3;
            continue;
        }
        hollow.indices.erase(hollow.indices.begin() + static_cast<std::ptrdiff_t>(i),
                             hollow.indices.begin() + static_cast<std::ptrdiff_t>(i) + 3);
    }
    for (const auto& [a, b] : {std::pair{0U, 1U}, {1U, 5U}, {5U, 4U}, {4U, 0U}})
        hollow.indices.insert(hollow.indices.end(), {a, b, tip});
    const Checked part({box({0, 0, 0}, {40, 20, 30}), inwards(hollow)}, askew());
    EXPECT_TRUE(part.good());
    const auto wall = thinnestWall(part.tree).wall;
    ASSERT_TRUE(wall);
    EXPECT_NEAR(wall->thickness, 1.3, 1.3 * kWallTolerance);
    const glm::dvec3 from(glm::inverse(askew()) * glm::dvec4(wall->from, 1));
    EXPECT_NEAR(from.x, 11, 0.01);
    EXPECT_NEAR(from.z, 17, 0.01);
}

/// Traces rays from random surface points through the body, by testing every triangle. No ray may
/// find a thinner wall than thinnestWall().
TEST(PartCheck, NoRayFindsAThinnerWall) {
    std::mt19937 random(20);
    std::uniform_real_distribution<double> share(0, 1);
    for (int round = 0; round < 3; ++round) {
        Primitive outer = icosphere(3), hollow = inwards(icosphere(2));
        for (glm::vec3& p : outer.positions)
            p *= static_cast<float>(1 + 0.1 * share(random));
        for (glm::vec3& p : hollow.positions)
            p *= static_cast<float>(0.6 + 0.2 * share(random));
        const Checked part({outer, hollow});
        ASSERT_TRUE(part.good());
        const auto wall = thinnestWall(part.tree).wall;
        ASSERT_TRUE(wall);
        EXPECT_NEAR(glm::length(wall->to - wall->from), wall->thickness, 1e-9);
        double least = 10;
        const PartMesh& mesh = part.turned;
        for (int i = 0; i < 4000; ++i) {
            const auto t = static_cast<std::size_t>(random() % mesh.triangles.size());
            const auto [a, b, c] = mesh.corners(t);
            double u = share(random), v = share(random);
            if (u + v > 1) {
                u = 1 - u;
                v = 1 - v;
            }
            const glm::dvec3 normal = glm::normalize(mesh.normal(t));
            const CheckedLine line(a + u * (b - a) + v * (c - a), -normal);
            LineHit first{10};
            for (std::size_t s = 0; s < mesh.triangles.size(); ++s) {
                const auto hit = line.meets(mesh.corners(s));
                if (s == t || !hit || hit->t < 0 || hit->t > first.t) continue;
                first = *hit;
                first.triangle = static_cast<std::uint32_t>(s);
            }
            const glm::dvec3 other = glm::normalize(mesh.normal(first.triangle));
            const double facing = std::cos(kWallAngle * std::numbers::pi / 180);
            if (-glm::dot(other, normal) >= facing && mesh.sharedCorners(t, first.triangle) == 0)
                least = std::min(least, first.t);
        }
        EXPECT_LE(wall->thickness, least * (1 + kWallTolerance)) << round;
        EXPECT_GT(wall->thickness, 0.5 * least) << round;
    }
}

TEST(PartCheck, ATubeHasItsWallWhateverItsFacets) {
    // The radii are 10 and 8, with 48 and 32 facets. The wall is thinnest where a corner of the
    // inner polygon is nearest to a facet of the outer polygon.
    const auto ring = [](double radius, std::uint32_t facets, double turn) {
        Primitive p;
        for (std::uint32_t i = 0; i < facets; ++i) {
            const double u = 2 * std::numbers::pi * i / facets + turn;
            for (const double y : {0.0, 30.0})
                p.positions.emplace_back(radius * std::sin(u), y, radius * std::cos(u));
        }
        return p;
    };
    const std::uint32_t n = 48;
    Primitive tube = ring(10, n, 0);
    const Primitive inner = ring(8, n, std::numbers::pi / n);
    tube.positions.insert(tube.positions.end(), inner.positions.begin(), inner.positions.end());
    for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t a = 2 * i, b = 2 * ((i + 1) % n), c = 2 * n + a, d = 2 * n + b;
        const auto quad = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r, std::uint32_t s) {
            tube.indices.insert(tube.indices.end(), {p, q, r, p, r, s});
        };
        quad(a, b, b + 1, a + 1);
        quad(d, c, c + 1, d + 1);
        quad(b, a, c, d);
        quad(a + 1, b + 1, d + 1, c + 1);
    }
    const Checked part({tube}, askew());
    EXPECT_TRUE(part.good());
    const double least = 10 * std::cos(std::numbers::pi / n) - 8;
    EXPECT_NEAR(part.wall(), least, least * 2e-4);
}

TEST(PartCheck, SharpEdgesAreNoWallsButAreFound) {
    // In a wedge of 40 degrees, only the two ends face each other. In a wedge of 20 degrees, the
    // tapering sides face each other, too, and the distance between them goes down to 0.
    const auto wedge = [](double degrees) {
        const auto x = static_cast<float>(std::tan(degrees * std::numbers::pi / 180));
        Primitive p;
        for (const float z : {0.0F, 5.0F})
            p.positions.insert(p.positions.end(), {{0, 0, z}, {1, 0, z}, {1, x, z}});
        p.indices = {0, 2, 1, 3, 4, 5, 0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4, 2, 0, 3, 2, 3, 5};
        return p;
    };
    const Checked blunt({wedge(40)}), blade({wedge(20)});
    EXPECT_TRUE(blunt.good());
    EXPECT_NEAR(blunt.wall(), 5, 1e-9);
    EXPECT_TRUE(sharpEdges(blunt.turned, blunt.topology).empty());
    EXPECT_TRUE(blade.good());
    EXPECT_GT(blade.wall(), 0) << "faces that share a corner are an edge";
    EXPECT_LT(blade.wall(), std::tan(std::numbers::pi / 9));
    EXPECT_EQ(sharpEdges(blade.turned, blade.topology), (std::vector{PartEdge{0, 3}}));
}

TEST(PartCheck, JoinedPartsAreOneIfTheyAreWelded) {
    Primitive lower = cube(), upper = cube();
    lower.indices.resize(18);
    upper.indices.erase(upper.indices.begin(), upper.indices.begin() + 18);
    const Checked a({lower}), b({upper});
    EXPECT_FALSE(a.topology.closed());
    EXPECT_TRUE(Checked(joinParts({&a.raw, &b.raw}, true)).good());
    EXPECT_FALSE(Checked(joinParts({&a.raw, &b.raw}, false)).topology.closed());
}

TEST(CheckedLine, MeetsABoxAlongItsSides) {
    const Bounds box{{0, 0, 0}, {1, 1, 1}};
    for (const double side : {0.0, 1.0}) {
        for (const double zero : {0.0, -0.0}) {
            for (int axis = 0; axis < 2; ++axis) {
                glm::dvec3 origin(0.5, 0.5, -1), direction(zero, zero, 1);
                origin[axis] = side;
                EXPECT_TRUE(CheckedLine(origin, direction).meets(box, 0, 10)) << side << zero;
                origin[axis] = side == 0 ? -0.1 : 1.1;
                EXPECT_FALSE(CheckedLine(origin, direction).meets(box, 0, 10)) << side << zero;
            }
        }
    }
}

}  // namespace
}  // namespace peeler
