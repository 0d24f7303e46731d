// SPDX-License-Identifier: Apache-2.0
// All hits of bundles against an independent witness: Embree's, ray by ray.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <random>

#include "core/rays/bundle.h"
#include "formats/gltf/gltf_reader.h"
#include "support/capture.h"
#include "support/edge_distance.h"
#include "support/embree_oracle.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

CaptureSettings allHits() {
    CaptureSettings settings;
    settings.hit_mode = HitMode::kRefined;
    settings.faces = Faces::kBoth;
    return settings;
}

struct Ray {
    glm::dvec3 origin, direction;
};

/// As the help of `peeler rays` says.
Ray rayOf(const Bundle& bundle, int i, int j) {
    const double w = bundle.view.width, h = bundle.view.height;
    const glm::dvec3 origin = bundle.origin() +
                              ((i + 0.5) / w - 0.5) * bundle.size().x * bundle.right() -
                              ((j + 0.5) / h - 0.5) * bundle.size().y * bundle.up();
    return {origin, bundle.direction()};
}

/// Rays between this one and the nearest projected edge.
double raysToEdge(const TriangleSoup& soup, const Bundle& bundle, int i, int j) {
    double nearest = std::numeric_limits<double>::infinity();
    const glm::dvec2 point(i + 0.5, j + 0.5);
    const double rays_a_unit = bundle.view.width / bundle.size().x;
    for (const Triangle& triangle : soup.triangles) {
        glm::dvec2 at[3];
        for (int k = 0; k < 3; ++k) {
            const glm::dvec3 from = triangle.corner[k] - bundle.origin();
            at[k] = {glm::dot(from, bundle.right()) * rays_a_unit + bundle.view.width / 2.0,
                     -glm::dot(from, bundle.up()) * rays_a_unit + bundle.view.height / 2.0};
        }
        nearest = std::min(nearest, distanceToEdges(at, point));
    }
    return nearest;
}

/// Where a ray meets the plane of a triangle, in double precision: Embree has it in floats.
double exactT(const Triangle& triangle, const Ray& ray) {
    const glm::dvec3 normal = glm::cross(triangle.corner[1] - triangle.corner[0],
                                         triangle.corner[2] - triangle.corner[0]);
    return glm::dot(triangle.corner[0] - ray.origin, normal) / glm::dot(ray.direction, normal);
}

struct Agreement {
    std::size_t rays = 0, hit = 0;
    std::size_t differing = 0;       // in the number of hits
    std::size_t elsewhere = 0;       // those, and those that hit other triangles
    double farthest = 0;             // of one of them from an edge, in rays
    double largest_error = 0;        // of t, in sizes of the scene
    double largest_float_error = 0;  // against t as Embree has it
};

void compare(const Scene& scene, Renderer& renderer, AllHits& oracle, const TriangleSoup& soup,
             const Bundle& bundle, Agreement& agreement) {
    const LayeredImage image = capture(renderer, bundle.view, allHits()).image;
    const auto keys = image.extra.front().as<const std::uint32_t>();
    const Bounds box = *PosedScene(scene).bounds();
    const double size = glm::length(box.max - box.min);
    for (int j = 0; j < bundle.view.height; ++j) {
        for (int i = 0; i < bundle.view.width; ++i) {
            const Ray ray = rayOf(bundle, i, j);
            const std::size_t pixel = image.pixelIndex(i, j);
            std::map<unsigned, float> expected;
            for (const OracleHit& hit : oracle.hits(ray.origin, ray.direction))
                expected[hit.triangle] = hit.t;
            ++agreement.rays;
            if (!expected.empty() || image.count(pixel) > 0) ++agreement.hit;
            bool same = expected.size() == image.count(pixel);
            if (!same) ++agreement.differing;
            for (std::uint32_t f = image.offsets[pixel]; f < image.offsets[pixel + 1]; ++f) {
                const unsigned triangle = keys[f] - 1;  // they have nothing but triangles
                if (!expected.contains(triangle)) {
                    same = false;
                    continue;
                }
                const double t = exactT(soup.triangles[triangle], ray);
                agreement.largest_error = std::max(
                    agreement.largest_error, std::abs(static_cast<double>(image.z[f]) - t) / size);
                agreement.largest_float_error =
                    std::max(agreement.largest_float_error,
                             static_cast<double>(std::abs(image.z[f] - expected[triangle])) / size);
            }
            if (same) continue;
            ++agreement.elsewhere;
            agreement.farthest = std::max(agreement.farthest, raysToEdge(soup, bundle, i, j));
        }
    }
}

void check(const std::string& name, const Scene& scene, const std::vector<glm::dvec3>& directions,
           int resolution) {
    const PosedScene shown(scene);
    const Bounds box = *shown.bounds();
    Renderer renderer(sharedContext(), shown);
    const TriangleSoup soup = soupOf(scene);
    AllHits oracle(soup);
    Agreement agreement;
    RayGrid grid;
    grid.resolution = resolution;
    for (const glm::dvec3& direction : directions)
        compare(scene, renderer, oracle, soup, parallelBundle("b", box, box, direction, grid),
                agreement);
    std::printf(
        "%s: %zu rays, %zu with hits, %zu differ in number (%.4f %%), those and %zu "
        "that hit other triangles are at most %.4f rays from an edge; largest error of t %.2g of "
        "the size (against Embree's floats %.2g)\n",
        name.c_str(), agreement.rays, agreement.hit, agreement.differing,
        100.0 * static_cast<double>(agreement.differing) / static_cast<double>(agreement.rays),
        agreement.elsewhere - agreement.differing, agreement.farthest, agreement.largest_error,
        agreement.largest_float_error);
    EXPECT_GT(agreement.hit, agreement.rays / 20);
    EXPECT_LE(static_cast<double>(agreement.differing),
              0.001 * static_cast<double>(agreement.rays));
    // Corners are snapped to a grid of 1/256 in each direction.
    EXPECT_LE(agreement.farthest, std::sqrt(2.0) / 256);
    EXPECT_LE(agreement.largest_error, 1e-6);
}

const char* const kModelsForRays[] = {
    "2CylinderEngine/glTF/2CylinderEngine.gltf",
    "DamagedHelmet/glTF-Binary/DamagedHelmet.glb",
    "Duck/glTF-Quantized/Duck.gltf",
    "CesiumMilkTruck/glTF/CesiumMilkTruck.gltf",
    "NegativeScaleTest/glTF/NegativeScaleTest.gltf",
};

class RaysOracle : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Models, RaysOracle, testing::ValuesIn(kModelsForRays),
                         [](const auto& row) {
                             const std::string path = row.param;
                             std::string name = path.substr(0, path.find('/'));
                             return name;
                         });

TEST_P(RaysOracle, EmbreeFindsTheSameHits) {
    PEELER_REQUIRE_ASSETS(assets);
    auto directions = sphereDirections(3);
    directions.push_back({0, 0, -1});
    check(GetParam(), readGltf(assets / "gltf-sample-assets" / GetParam()), directions, 640);
}

TEST(RaysOracle, EmbreeFindsTheSameHitsInTriangleSoups) {
    for (const unsigned seed : {1U, 2U, 3U}) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<float> place(-1, 1), extent(-0.4F, 0.4F);
        const auto point = [&](auto& along) {
            return glm::vec3(along(random), along(random), along(random));
        };
        SceneBuilder builder;
        const int material = builder.material(glm::vec4(1));
        std::vector<glm::vec3> positions;
        for (int i = 0; i < 1000; ++i) {
            const glm::vec3 center = point(place);
            for (int k = 0; k < 3; ++k)
                positions.push_back(center + point(extent));
        }
        builder.triangles(positions, material);
        check("soup of seed " + std::to_string(seed), builder.scene(), sphereDirections(4), 400);
    }
}

TEST(RaysOracle, CoincidentMeshesHaveTwiceTheHits) {
    PEELER_REQUIRE_ASSETS(assets);
    Scene once = readGltf(assets / "gltf-sample-assets" / kModelsForRays[1]);
    Scene twice = once;
    for (const int root : once.scenes.front().roots) {
        // The same tree again: nodes are a forest, so they are copied.
        const auto copy = [&](const auto& self, int node) -> int {
            Node again = twice.nodes[static_cast<std::size_t>(node)];
            for (int& child : again.children)
                child = self(self, child);
            twice.nodes.push_back(again);
            return static_cast<int>(twice.nodes.size()) - 1;
        };
        const int again = copy(copy, root);
        twice.scenes.front().roots.push_back(again);
    }
    const PosedScene shown(once, 0);
    const Bounds box = *shown.bounds();
    Renderer one(sharedContext(), shown), two(sharedContext(), PosedScene(twice));
    for (const glm::dvec3& direction : sphereDirections(3)) {
        const Bundle bundle = parallelBundle("b", box, box, direction, {});
        const LayeredImage a = capture(one, bundle.view, allHits()).image;
        const LayeredImage b = capture(two, bundle.view, allHits()).image;
        ASSERT_GT(a.fragments(), 100'000U);
        ASSERT_EQ(2 * a.fragments(), b.fragments());
        for (std::size_t p = 0; p < a.window.pixels(); ++p) {
            ASSERT_EQ(2 * a.count(p), b.count(p)) << "ray " << p;
            for (std::uint32_t k = 0; k < b.count(p); ++k)
                ASSERT_EQ(b.z[b.offsets[p] + k], a.z[a.offsets[p] + k / 2]) << "ray " << p;
        }
    }
}

}  // namespace
}  // namespace peeler::test
