// SPDX-License-Identifier: Apache-2.0
// Tests the parity and the positions of CPU hits against analytic answers.
#include "core/raster/hit_rasterizer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <peeler/bundle.h>
#include "core/scene/elements.h"
#include "core/scene/view.h"
#include "support/closed_meshes.h"
#include "support/edge_distance.h"
#include "support/numbers.h"
#include "support/one_mesh.h"
#include "support/test_support.h"
#include "support/traced_hits.h"

namespace peeler::test {
namespace {

std::size_t oddRays(const LayeredImage& image) {
    return static_cast<std::size_t>(
        std::ranges::count_if(countsOf(image), [](std::uint32_t n) { return n % 2 == 1; }));
}

TEST(HitRasterizer, ClosedMeshesHaveEvenRays) {
    const Primitive meshes[] = {icosphere(1), icosphere(4), torus(0.4, 64, 32),
                                torus(0.01, 400, 12), cube()};
    for (const Primitive& mesh : meshes) {
        const Scene scene = sceneOf({{"", {mesh}}});
        const PosedScene posed(scene);
        HitRasterizer source(posed);
        std::size_t odd = 0, hits = 0;
        for (const glm::dvec3& direction : sphereDirections(64)) {
            const TracedHits traced = trace(source, bundleOf(posed, direction, 128).view);
            odd += oddRays(traced.image);
            hits += traced.image.fragments();
            const TracedHits seen = trace(source, pinhole(-4.0 * direction, 64));
            odd += oddRays(seen.image);
            hits += seen.image.fragments();
        }
        EXPECT_EQ(odd, 0U) << mesh.indices.size() << " indices";
        EXPECT_GT(hits, 20000U);
    }
}

// A negative test: the test above fails for a mesh with a hole.
TEST(HitRasterizer, AHoleIsSeen) {
    Primitive mesh = icosphere(3);
    mesh.indices.resize(mesh.indices.size() - 3);
    const Scene scene = sceneOf({{"", {mesh}}});
    const PosedScene posed(scene);
    HitRasterizer source(posed);
    std::size_t odd = 0;
    for (const glm::dvec3& direction : sphereDirections(8))
        odd += oddRays(trace(source, bundleOf(posed, direction, 128).view).image);
    EXPECT_GT(odd, 10U);
}

/// Compares every ray with every triangle in double precision. Hits must be the same for all rays
/// that are more than about one grid step away from an edge. Hits must be on the triangle's plane.
void compareWithTriangles(const PosedScene& posed, const View& view) {
    HitRasterizer source(posed);
    const TracedHits traced = trace(source, view);
    const Bounds box = *posed.bounds();
    const double size = glm::length(box.max - box.min);
    const auto triangles =
        static_cast<std::uint32_t>(elementsOf(posed.primitives(posed.meshes()[0])[0]));
    const PixelRays rays(view);
    const glm::dmat4 camera = glm::inverse(view.camera_to_world);
    std::size_t differing = 0;
    for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
            const glm::dvec2 at = glm::dvec2(x, y) + view.sample;
            const glm::dvec3 origin = worldPosition(view, at.x, at.y, 0);
            const glm::dvec3 direction = worldPosition(view, at.x, at.y, 1) - origin;
            const std::size_t pixel = traced.image.pixelIndex(x, y);
            const std::vector<std::uint32_t> keys = traced.keys(pixel);
            for (std::uint32_t key = 1; key <= triangles; ++key) {
                WorldElement element = elementOf(posed, key);
                placeCorners(posed, element);
                const glm::dvec3 &a = element.corner[0], &b = element.corner[1],
                                 &c = element.corner[2];
                const glm::dvec3 e1 = b - a, e2 = c - a, across = glm::cross(direction, e2);
                const double determinant = glm::dot(e1, across);
                const double u = glm::dot(origin - a, across) / determinant;
                const double v = glm::dot(direction, glm::cross(origin - a, e1)) / determinant;
                const bool hit = u >= 0 && v >= 0 && u + v <= 1;
                const auto found = std::ranges::find(keys, key);
                if (hit != (found != keys.end())) {
                    ++differing;
                    glm::dvec2 corners[3];
                    for (int i = 0; i < 3; ++i)
                        corners[i] = rays.pixel(glm::dvec3(
                            camera * glm::dvec4(element.corner[static_cast<std::size_t>(i)], 1)));
                    EXPECT_LE(distanceToEdges(corners, at), 2.0 / 65536);
                }
                if (!hit || found == keys.end()) continue;
                const double t = glm::dot(e2, glm::cross(origin - a, e1)) / determinant;
                const std::size_t f =
                    traced.image.offsets[pixel] + static_cast<std::size_t>(found - keys.begin());
                EXPECT_NEAR(static_cast<double>(traced.image.z[f]), t, 1e-7 * size)
                    << x << ", " << y;
            }
        }
    }
    EXPECT_LE(differing, 2U);
    EXPECT_GT(traced.image.fragments(), 1000U);
}

TEST(HitRasterizer, HitsAreWhereRaysMeetTriangles) {
    const Scene scene = sceneOf({{"", {placed(torus(0.4, 24, 12), 3, {1, 2, 3})}}});
    const PosedScene posed(scene);
    compareWithTriangles(posed, bundleOf(posed, {0.3, -0.7, 0.2}, 60).view);
    View eye = pinhole({4, 9, 7}, 60, 0.5);
    eye.sample = {0.3, 0.6};
    compareWithTriangles(posed, eye);
}

/// Buffer depth is 1 at the near plane and 0 at the far plane.
TEST(HitRasterizer, SlopesAreHowBufferDepthChanges) {
    Primitive plane = square(-20, -20, 40, 40, 0);
    for (glm::vec3& p : plane.positions)
        p.z = -10 + 0.25F * p.x - 0.125F * p.y;
    const Scene scene = oneMesh({plane});
    HitRasterizer source{PosedScene(scene)};
    const TracedHits parallel =
        trace(source, parallelView(16, 16, 100), hitSettings(HitMode::kSloped));
    ASSERT_EQ(parallel.image.fragments(), 256U);
    const auto slopes = parallel.image.color.as<float>();
    for (std::size_t f = 0; f < 256; ++f) {
        // With y up, Z = 10 − x/4 + y/8, and depth = (100 − Z)/100.
        EXPECT_NEAR(static_cast<double>(slopes[2 * f]), 0.25 / 100, 1e-9);
        EXPECT_NEAR(static_cast<double>(slopes[2 * f + 1]), -0.125 / 100, 1e-9);
    }
    View eye = parallelView(16, 16);
    eye.projection = {true, 0.5, 0.5, 0.5, 50};
    const TracedHits seen = trace(source, eye, hitSettings(HitMode::kSloped));
    const double n = 0.5, far = 50;
    const auto depth = [&](std::size_t f) {
        return (n * far / static_cast<double>(seen.image.z[f]) - n) / (far - n);
    };
    ASSERT_EQ(seen.image.fragments(), 256U);
    const auto changes = seen.image.color.as<float>();
    EXPECT_NEAR(static_cast<double>(changes[2 * 100]), depth(101) - depth(100), 1e-7);
    EXPECT_NEAR(static_cast<double>(changes[2 * 100 + 1]), depth(84) - depth(100), 1e-7);
}

TEST(HitRasterizer, TrianglesBeyondNumbers) {
    constexpr float kFar = 1e30F;
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    Primitive primitive;
    const auto add = [&](glm::vec3 a, glm::vec3 b, glm::vec3 c) {
        primitive.positions.insert(primitive.positions.end(), {a, b, c});
    };
    add({-kFar, kFar, -1}, {kFar, kFar, -1}, {0, -kFar, -1});   // 1: covers the whole picture
    add({kNan, 0, -2}, {8, 0, -2}, {0, -8, -2});                // 2: hit by no ray (NaN)
    add({0, 0, -3}, {8, -8, -3}, {4, -4, -3});                  // 3: hit by no ray (no area)
    add({-1, 1, kNan}, {20, 1, -2}, {-1, -20, -2});             // 4: hit by no ray (NaN)
    add({-1, 1, -kFloatInfinity}, {20, 1, -2}, {-1, -20, -2});  // 5: hit by no ray (infinite)
    add({kFar, 1, -5}, {-1, 1, -5}, {-1, -kFar, -5});           // 6: covers the whole picture
    add({-kFar, -2, -6}, {kFar, -2, -6}, {4, -6, -6});          // 7: covers 4 rows from y = 2 down
    add({2, -2, -7}, {2, -2, -7}, {2, -2, -7});                 // 8: hit by no ray (a point)
    const Scene scene = oneMesh({primitive});
    HitRasterizer source{PosedScene(scene)};
    const TracedHits traced = trace(source, parallelView(8, 8));
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x)
            EXPECT_EQ(traced.keys(traced.image.pixelIndex(x, y)),
                      (y >= 2 && y < 6 ? std::vector<std::uint32_t>{1, 6, 7}
                                       : std::vector<std::uint32_t>{1, 6}))
                << x << ", " << y;
    // From a pinhole at (4, −4, 4), triangles 1 and 6 are practically infinite and still cover the
    // whole picture.
    View eye = parallelView(8, 8);
    eye.camera_to_world[3] = {4, -4, 4, 1};
    eye.projection = {true, 0.5, 0.5, 0.1, kInfinity};
    const TracedHits seen = trace(source, eye);
    for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 8; ++x) {
            // `down` is in the plane of triangle 7, at Z = 10.
            const double down = 4 + 10 * ((y + 0.5) / 8 - 0.5);
            std::vector<std::uint32_t> expected = {1, 6};
            if (down >= 2 && down < 6) expected.push_back(7);
            EXPECT_EQ(seen.keys(seen.image.pixelIndex(x, y)), expected) << x << ", " << y;
        }
    }
}

/// Without clipping at the near plane, parallel rays have no start, so hits behind their origin
/// come first.
TEST(HitRasterizer, HitsBehindTheStartComeFirst) {
    const Scene scene =
        oneMesh({square(0, 0, 4, 4, -3), square(0, 0, 4, 4, 5), square(0, 0, 4, 4, 0),
                 square(0, 0, 4, 4, 2), square(0, 0, 4, 4, -0.0F), square(0, 0, 4, 4, -7)});
    HitRasterizer source{PosedScene(scene)};
    const LayeredImage image = trace(source, parallelView(4, 4)).image;
    EXPECT_EQ(std::vector<float>(image.z.begin(), image.z.begin() + image.count(0)),
              (std::vector<float>{-5, -2, 0, 0, 3, 7}));
    EXPECT_FALSE(std::signbit(image.z[2]) || std::signbit(image.z[3]));
}

}  // namespace
}  // namespace peeler::test
