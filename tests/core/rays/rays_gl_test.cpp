// SPDX-License-Identifier: Apache-2.0
// Tests rays through bodies against analytic answers: parity, lengths, volumes, and the positions
// of rays.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "core/fragments/supersampling.h"
#include "core/rays/ray_maps.h"
#include "core/scene/elements.h"
#include "support/closed_meshes.h"
#include "support/numbers.h"
#include "support/odd_rays.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

TEST(ClosedMeshes, EveryRayLeavesWhatItEnters) {
    const std::pair<const char*, Primitive> meshes[] = {
        {"icosphere 1", icosphere(1)},        {"icosphere 3", icosphere(3)},
        {"icosphere 5", icosphere(5)},        {"torus", torus(0.4, 64, 32)},
        {"thin torus", torus(0.01, 400, 12)}, {"cube", cube()},
    };
    // Embree does not depend on the backend, so the comparison with one backend is enough.
    const bool with_embree = testBackend() == "egl";
    for (const auto& [name, mesh] : meshes) {
        const OddRays found = countOddRays(name, sceneOf({{"", {mesh}}}), 64, 256, with_embree);
        EXPECT_GT(found.hits, found.rays / 100);
        EXPECT_EQ(found.raw, 0U);
        EXPECT_EQ(found.refined, 0U);
        EXPECT_EQ(found.cpu, 0U);
    }
    const OddRays fine =
        countOddRays("icosphere 5", sceneOf({{"", {icosphere(5)}}}), 2, 1024, with_embree);
    EXPECT_EQ(fine.raw, 0U);
    EXPECT_EQ(fine.refined, 0U);
    EXPECT_EQ(fine.cpu, 0U);
}

// A negative test: the tests above fail for a mesh with a hole.
TEST(ClosedMeshes, AHoleIsSeen) {
    Primitive mesh = icosphere(3);
    mesh.indices.resize(mesh.indices.size() - 3);
    const OddRays found = countOddRays("a hole", sceneOf({{"", {mesh}}}), 2, 256, false);
    EXPECT_GT(found.raw, 10U);
    EXPECT_EQ(found.raw, found.refined);
    EXPECT_GT(found.cpu, 10U);
}

/// A scene and the hits of a bundle through it.
struct Traced {
    Traced(const std::string& engine, Scene from, const glm::dvec3& direction, const RayGrid& grid,
           std::optional<Bounds> area = {}, HitMode hit_mode = HitMode::kRefined)
        : scene(std::move(from)) {
        const Bounds all = shown.bounds().value();
        bundle = parallelBundle("b", area.value_or(all), all, direction, grid);
        image = capture(*openHits(engine, shown), bundle.view, raySettings(hit_mode)).image;
    }

    glm::dvec3 start(std::size_t pixel) const {
        const auto width = static_cast<std::size_t>(bundle.view.width);
        return worldPosition(bundle.view, static_cast<double>(pixel % width) + 0.5,
                             static_cast<double>(pixel / width) + 0.5, 0);
    }
    std::span<const float> t(std::size_t pixel) const {
        return std::span(image.z).subspan(image.offsets[pixel], image.count(pixel));
    }
    /// Returns one plane per channel of the maps.
    std::vector<std::vector<float>> maps(RayMapSettings settings) const {
        const Solids solids(shown);
        const RayMaps maps(shown, &solids, std::move(settings));
        std::vector<float> planes;
        maps.evaluateRows(bundle, image, 0, bundle.view.height, planes);
        std::vector<std::vector<float>> result;
        const auto pixels = static_cast<std::ptrdiff_t>(bundle.rays());
        for (std::size_t c = 0; c < maps.channels().size(); ++c) {
            const auto plane = planes.begin() + static_cast<std::ptrdiff_t>(c) * pixels;
            result.emplace_back(plane, plane + pixels);
        }
        return result;
    }
    double volume() const {
        const std::vector<float> thickness = maps({{RayMap::kThickness}}).at(0);
        double sum = 0;
        for (const float length : thickness)
            sum += static_cast<double>(length);
        const glm::dvec2 size = bundle.size();
        return sum * size.x * size.y / static_cast<double>(bundle.rays());
    }

    Scene scene;
    PosedScene shown{scene};
    Bundle bundle;
    LayeredImage image;
};

const glm::dvec3 kAskew = glm::normalize(glm::dvec3(1, 2, -3));

/// Returns the distance between the ray's line and the origin.
double beside(const glm::dvec3& start, const glm::dvec3& direction) {
    return glm::length(glm::cross(start, direction));
}

/// Instantiated for each engine (--engine).
class RayLengths : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(By, RayLengths, testing::Values("cpu", "gl"),
                         [](const auto& row) { return std::string(row.param); });

TEST_P(RayLengths, ChordsOfASphere) {
    const Primitive mesh = icosphere(5);
    const Traced traced(GetParam(), sceneOf({{"", {mesh}}}), kAskew, {512});
    const std::vector<float> thickness = traced.maps({{RayMap::kThickness}}).at(0);

    // `within` is the largest depth of a triangle's centre below the sphere's surface.
    double within = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const glm::dvec3 sum = glm::dvec3(mesh.positions[mesh.indices[i]]) +
                               glm::dvec3(mesh.positions[mesh.indices[i + 1]]) +
                               glm::dvec3(mesh.positions[mesh.indices[i + 2]]);
        within = std::max(within, 1 - glm::length(sum) / 3);
    }
    double worst = 0;
    std::size_t rays = 0;
    for (std::size_t p = 0; p < traced.bundle.rays(); ++p) {
        const double d = beside(traced.start(p), kAskew);
        if (d > 0.95) continue;
        ++rays;
        const double half = std::sqrt(1 - d * d);
        const double off = 2 * half - static_cast<double>(thickness[p]);
        worst = std::max(worst, off);
        ASSERT_GE(off, -1e-6);
        // Each end of the chord is short by up to `within` divided by `half`, the cosine at which
        // the ray meets the surface.
        ASSERT_LE(off, 2.1 * within / half) << d;
    }
    std::printf("%zu rays; triangles are up to %.2g within the sphere, chords up to %.2g short\n",
                rays, within, worst);

    // The mesh is convex, so the planes of its triangles are enough to compute exact chords.
    std::mt19937 random(7);
    std::size_t hit = 0;
    for (int i = 0; i < 1000; ++i) {
        const std::size_t p = random() % traced.bundle.rays();
        const glm::dvec3 start = traced.start(p);
        double in = -1e9, out = 1e9;
        for (std::size_t k = 0; k < mesh.indices.size(); k += 3) {
            const glm::dvec3 a(mesh.positions[mesh.indices[k]]),
                b(mesh.positions[mesh.indices[k + 1]]), c(mesh.positions[mesh.indices[k + 2]]);
            const glm::dvec3 normal = glm::cross(b - a, c - a);
            const double along = glm::dot(normal, kAskew);
            const double at = glm::dot(normal, a - start) / along;
            (along < 0 ? in : out) = along < 0 ? std::max(in, at) : std::min(out, at);
        }
        // Skip rays that may only graze vertices, because the planes cannot decide whether such
        // rays hit.
        if (std::abs(out - in) < 1e-3) continue;
        const double chord = std::max(0.0, out - in);
        hit += chord > 0 ? 1 : 0;
        // Each end may be off by 1e-6 of the scene's size, which is 2√3.
        ASSERT_NEAR(static_cast<double>(thickness[p]), chord, 6.9e-6) << p;
    }
    EXPECT_GT(hit, 300U);
}

TEST_P(RayLengths, NestedSpheresOfTwoMaterials) {
    const glm::vec3 inner_at(0.2F, -0.1F, 0.15F);
    Primitive outer = icosphere(5), inner = placed(icosphere(5), 0.5F, inner_at);
    inner.material = 1;
    for (const bool as_nodes : {true, false}) {
        SCOPED_TRACE(as_nodes);
        std::vector<Mesh> meshes = as_nodes ? std::vector<Mesh>{{"", {outer}}, {"", {inner}}}
                                            : std::vector<Mesh>{{"", {outer, inner}}};
        const Traced traced(GetParam(), sceneOf(std::move(meshes)), kAskew, {256});
        const auto paths = traced.maps({{RayMap::kPathLength}});
        ASSERT_EQ(paths.size(), 2U);
        std::size_t through_both = 0;
        for (std::size_t p = 0; p < traced.bundle.rays(); ++p) {
            const glm::dvec3 start = traced.start(p);
            const double d0 = beside(start, kAskew),
                         d1 = beside(start - glm::dvec3(inner_at), kAskew) / 0.5;
            if (d0 > 0.95 || (d1 > 0.95 && d1 < 1.05)) continue;
            const double whole = 2 * std::sqrt(1 - d0 * d0),
                         core = d1 < 1 ? std::sqrt(1 - d1 * d1) : 0;
            ASSERT_NEAR(static_cast<double>(paths[0][p]), whole - core, 0.003);
            ASSERT_NEAR(static_cast<double>(paths[1][p]), core, 0.003);
            if (core > 0) {
                ++through_both;
            } else {
                ASSERT_EQ(paths[1][p], 0);
            }
        }
        EXPECT_GT(through_both, 5000U);
    }
}

TEST_P(RayLengths, VolumesOfASphereATorusAndACube) {
    struct Row {
        const char* name;
        Primitive mesh;
        double volume;
    };
    const Row rows[] = {{"sphere", icosphere(6), 4 * kPi / 3},
                        {"torus", torus(0.4, 400, 200), 2 * kPi * kPi * 0.4 * 0.4},
                        {"cube", cube(), 8}};
    for (const Row& row : rows) {
        SCOPED_TRACE(row.name);
        const double own = volumeOf(row.mesh);
        const double found =
            Traced(GetParam(), sceneOf({{"", {row.mesh}}}), kAskew, {1024}).volume();
        std::printf("%s: off by %.2g of its volume, %.2g of the mesh's\n", row.name,
                    found / row.volume - 1, found / own - 1);
        EXPECT_NEAR(found / row.volume, 1, 1e-3);
        EXPECT_NEAR(found / own, 1, 5e-5);
    }
}

/// Instantiated for each engine (--engine).
class BundleRays : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(By, BundleRays, testing::Values("cpu", "gl"),
                         [](const auto& row) { return std::string(row.param); });

TEST_P(BundleRays, AreWhereTheHelpSaysTheyAre) {
    const Traced traced(GetParam(), sceneOf({{"", {torus(0.4, 64, 32)}}}), {-2, 1, 0.5}, {200});
    const Bundle& bundle = traced.bundle;
    const glm::dvec2 size = bundle.size();
    const auto w = static_cast<std::size_t>(bundle.view.width),
               h = static_cast<std::size_t>(bundle.view.height);
    EXPECT_EQ(std::max(w, h), 200U);
    const auto keys = traced.image.extra.at(0).as<const std::uint32_t>();
    const double spacing = size.x / static_cast<double>(w);
    double farthest = 0;
    std::size_t exact = 0;
    for (std::size_t p = 0; p < bundle.rays(); ++p) {
        const double i = static_cast<double>(p % w) + 0.5, j = static_cast<double>(p / w) + 0.5;
        const glm::dvec3 start = bundle.origin() +
                                 (i / static_cast<double>(w) - 0.5) * size.x * bundle.right() -
                                 (j / static_cast<double>(h) - 0.5) * size.y * bundle.up();
        for (std::size_t f = traced.image.offsets[p]; f < traced.image.offsets[p + 1]; ++f) {
            const glm::dvec3 hit =
                start + static_cast<double>(traced.image.z[f]) * bundle.direction();
            WorldElement element = elementOf(traced.shown, keys[f]);
            placeCorners(traced.shown, element);
            const glm::dvec3 on = element.weighted(element.weightsAt(start, bundle.direction()));
            const double off = glm::distance(hit, on);
            farthest = std::max(farthest, off);
            exact += off < 1e-6 ? 1 : 0;
        }
    }
    EXPECT_GT(traced.image.fragments(), 10000U);
    // The rasteriser snaps vertices to a grid of 1/256 pixel, so a fragment's ray may miss its
    // triangle, by more than a grid step if the triangle is edge-on.
    EXPECT_LT(farthest, spacing / 16);
    const double misses = 1 - static_cast<double>(exact) / double(traced.image.fragments());
    std::printf("%.2g of the hits lie beside their rays, at most %.2g of the rays' distance\n",
                misses, farthest / spacing);
    EXPECT_LT(misses, 0.01);
}

TEST_P(BundleRays, DirectionsAreEven) {
    for (const int count : {64, 1000}) {
        glm::dvec3 sum(0);
        glm::dmat3 moments(0);
        for (const glm::dvec3& d : sphereDirections(count)) {
            EXPECT_NEAR(glm::length(d), 1, 1e-12);
            sum += d;
            moments += glm::outerProduct(d, d);
        }
        EXPECT_LT(glm::length(sum) / count, 0.5 / count);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                EXPECT_NEAR(moments[i][j] / count, i == j ? 1.0 / 3 : 0, 0.5 / count);
        for (const glm::dvec3& d : hemisphereDirections(count))
            EXPECT_GT(d.y, 0);
    }
}

TEST_P(BundleRays, BoundsCutNothingOffAlongTheRays) {
    // The bounds are thin slabs perpendicular to the rays. The first contains the sphere's centre,
    // the second does not.
    const Bounds slabs[] = {{{-0.5, -0.5, -0.001}, {0.5, 0.5, 0.001}},
                            {{-0.5, -0.5, 0.7}, {0.5, 0.5, 0.7}}};
    for (const Bounds& slab : slabs) {
        for (const double sign : {1.0, -1.0}) {
            const Traced traced(GetParam(), sceneOf({{"", {icosphere(4)}}}), {0, 0, sign}, {64},
                                slab);
            EXPECT_NEAR(traced.bundle.size().x, 1, 1e-4);
            for (std::size_t p = 0; p < traced.bundle.rays(); ++p) {
                const double d = beside(traced.start(p), {0, 0, 1});
                ASSERT_EQ(traced.t(p).size(), 2U);
                ASSERT_NEAR(static_cast<double>(traced.t(p)[1] - traced.t(p)[0]),
                            2 * std::sqrt(1 - d * d), 0.01);
            }
        }
    }
}

TEST_P(BundleRays, WhatLiesOnTheBorderIsHit) {
    Primitive quad;
    quad.positions = {{-1, -1, 0.3F}, {1, -1, 0.3F}, {1, 1, 0.3F}, {-1, 1, 0.3F}};
    quad.indices = {0, 1, 2, 0, 2, 3};
    for (const glm::dvec3 direction : {glm::dvec3(0, 0, 1), glm::dvec3(0, 0, -1)}) {
        // The quad's bounds are flat, and the cube touches the bundle at both ends.
        const Traced flat(GetParam(), sceneOf({{"", {quad}}}), direction, {100});
        const Traced box(GetParam(), sceneOf({{"", {cube()}}}), direction, {100});
        for (std::size_t p = 0; p < flat.bundle.rays(); ++p)
            ASSERT_EQ(flat.t(p).size(), 1U) << p;
        for (std::size_t p = 0; p < box.bundle.rays(); ++p) {
            ASSERT_EQ(box.t(p).size(), 2U) << p;
            ASSERT_NEAR(box.t(p)[1] - box.t(p)[0], 2, 1e-6);
        }
    }
}

TEST_P(BundleRays, OfAxesGoThroughTheCentresOfCells) {
    const Bounds area{{-1, 0.5, 2}, {1.3, 1.9, 2.7}};
    const AxisBundles axes = axisBundles(area, area, {37});
    ASSERT_EQ(axes.bundles.size(), 3U);
    EXPECT_EQ(std::max({axes.cells.x, axes.cells.y, axes.cells.z}), 37);
    for (int axis = 0; axis < 3; ++axis) {
        const Bundle& bundle = axes.bundles[static_cast<std::size_t>(axis)];
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        EXPECT_NEAR(bundle.direction()[axis], 1, 1e-15);
        EXPECT_EQ(bundle.rays(), static_cast<std::size_t>(axes.cells[u] * axes.cells[v]));
        std::vector<int> seen(bundle.rays(), 0);
        for (int y = 0; y < bundle.view.height; ++y) {
            for (int x = 0; x < bundle.view.width; ++x) {
                const glm::dvec3 cell =
                    (worldPosition(bundle.view, x + 0.5, y + 0.5, 0) - axes.corner) / axes.spacing -
                    0.5;
                const double cu = std::round(cell[u]), cv = std::round(cell[v]);
                ASSERT_NEAR(cell[u], cu, 1e-9);
                ASSERT_NEAR(cell[v], cv, 1e-9);
                ++seen.at(static_cast<std::size_t>(cv * axes.cells[u] + cu));
            }
        }
        EXPECT_EQ(std::ranges::count(seen, 1), static_cast<std::ptrdiff_t>(seen.size()));
    }
}

}  // namespace
}  // namespace peeler::test
