// SPDX-License-Identifier: Apache-2.0
// Tests the hits on rays before and after points, against analytic answers.
#include "core/rays/point_hits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/scene/elements.h"
#include "support/capture.h"
#include "support/closed_meshes.h"
#include "support/numbers.h"
#include "support/ray_hits.h"

namespace peeler::test {
namespace {

/// A scene of triangles. Finds hits by brute force, without a renderer.
class Traced {
  public:
    explicit Traced(Scene scene) : scene_(std::move(scene)), shown_(scene_, 0) {
        std::uint32_t count = 0;
        for (const MeshInstance& instance : shown_.meshes())
            for (const Primitive& p : scene_.meshes[std::size_t(instance.mesh)].primitives)
                count += static_cast<std::uint32_t>(elementsOf(p));
        for (std::uint32_t key = 1; key <= count; ++key) {
            WorldElement element = elementOf(shown_, key);
            placeCorners(shown_, element);
            elements_.push_back(element);
        }
    }

    Bundle bundle(const glm::dvec3& direction, int resolution) const {
        const Bounds all = shown_.bounds().value();
        return parallelBundle("b", all, all, direction, {resolution});
    }
    LayeredImage hits(const Bundle& bundle) const {
        return rayHits(bundle, [&](const glm::dvec3& start, const glm::dvec3& direction) {
            std::vector<Hit> found;
            for (std::size_t i = 0; i < elements_.size(); ++i) {
                const auto& corner = elements_[i].corner;
                const glm::dmat3 sides(corner[1] - corner[0], corner[2] - corner[0], -direction);
                if (glm::determinant(sides) == 0) continue;
                const glm::dvec3 at = glm::inverse(sides) * (start - corner[0]);
                if (at.x >= 0 && at.y >= 0 && at.x + at.y <= 1)
                    found.push_back({at.z, static_cast<std::uint32_t>(i + 1)});
            }
            return found;
        });
    }
    std::vector<PointHits> around(const Bundle& bundle, const LayeredImage& band,
                                  const std::vector<glm::dvec3>& points) const {
        std::vector<PointHits> found(points.size());
        findPointHits(shown_, bundle, band, points, found);
        return found;
    }
    std::vector<PointHits> around(const Bundle& bundle,
                                  const std::vector<glm::dvec3>& points) const {
        return around(bundle, hits(bundle), points);
    }

  private:
    Scene scene_;
    PosedScene shown_;
    std::vector<WorldElement> elements_;
};

/// Returns large triangles at these Z. All rays cross them; the n-th triangle (from 0) has the key
/// n + 1.
Scene sheets(const std::vector<float>& heights) {
    SceneBuilder builder;
    const int material = builder.material({1, 1, 1, 1});
    for (const float z : heights)
        builder.triangles({{-8, -4, z}, {8, -4, z}, {0, 12, z}}, material);
    return builder.scene();
}

TEST(PointHits, BetweenSheets) {
    const Traced traced(sheets({-1, 1, 2}));
    const Bundle bundle = traced.bundle({0, 0, 1}, 16);
    const auto found = traced.around(
        bundle, {{0.1, 0.2, 0.25}, {0.1, 0.2, -3}, {0.1, 0.2, 5}, {100, 0, 0}, {-7.9, 11, 0}});
    EXPECT_DOUBLE_EQ(found[0].before.distance, 1.25);
    EXPECT_EQ(found[0].before.key, 1U);
    EXPECT_DOUBLE_EQ(found[0].after.distance, 0.75);
    EXPECT_EQ(found[0].after.key, 2U);
    EXPECT_EQ(found[1].before.key, 0U);
    EXPECT_EQ(found[1].before.distance, kInfinity);
    EXPECT_DOUBLE_EQ(found[1].after.distance, 2);  // the rays start beyond this point
    EXPECT_DOUBLE_EQ(found[2].before.distance, 3);
    EXPECT_EQ(found[2].before.key, 3U);
    EXPECT_EQ(found[2].after.distance, kInfinity);
    // One point is outside the bundle, the other outside the sheets.
    for (const std::size_t beside : {std::size_t{3}, std::size_t{4}}) {
        EXPECT_EQ(found[beside].before.key, 0U);
        EXPECT_EQ(found[beside].after.key, 0U);
    }
    EXPECT_FALSE(nearestRay(bundle, {100, 0, 0}));
    EXPECT_FALSE(nearestRay(bundle, {0, 1e300, 0}));
    EXPECT_TRUE(nearestRay(bundle, {-7.9, 11, 0}));
}

TEST(PointHits, OnASurfaceAndWhereSurfacesCoincide) {
    const Traced traced(sheets({1, 0, 1, 1, 3}));
    const std::vector<glm::dvec3> points = {{0.3, 0.2, 1}, {0.3, 0.2, 0.5}, {0.3, 0.2, 2}};
    for (const double sign : {1.0, -1.0}) {
        const auto found = traced.around(traced.bundle({0, 0, sign}, 16), points);
        const bool up = sign > 0;
        EXPECT_EQ(found[0].before.distance, 0);
        EXPECT_EQ(found[0].before.key, 4U);  // key of the triangle drawn last
        EXPECT_EQ(found[0].after.key, up ? 5U : 2U);
        EXPECT_DOUBLE_EQ(found[0].after.distance, up ? 2 : 1);
        EXPECT_EQ(found[1].before.key, up ? 2U : 4U);
        EXPECT_EQ(found[1].after.key, up ? 1U : 2U);  // key of the triangle drawn first
        EXPECT_EQ(found[2].before.key, up ? 4U : 5U);
        EXPECT_EQ(found[2].after.key, up ? 5U : 1U);
    }
}

// The grid is coarse, so a ray's hit must be extrapolated to the ray through the point itself.
TEST(PointHits, SteepSurfacesAreFollowed) {
    SceneBuilder builder;
    const int material = builder.material({1, 1, 1, 1});
    // The planes z = 2x and z = −2x, each drawn twice, cross at x = 0, where there are rays.
    for (int i = 0; i < 2; ++i) {
        builder.triangles({{-8, -4, -16}, {8, -4, 16}, {0, 12, 0}}, material);
        builder.triangles({{-8, -4, 16}, {8, -4, -16}, {0, 12, 0}}, material);
    }
    const Traced traced(builder.scene());
    std::mt19937 random(20);
    std::uniform_real_distribution<double> x(-1.5, 1.5), z(-4, 4);
    std::vector<glm::dvec3> points;
    for (int i = 0; i < 1000; ++i)
        points.emplace_back(x(random), x(random), z(random));
    const auto found = traced.around(traced.bundle({0, 0, 1}, 9), points);
    for (std::size_t i = 0; i < points.size(); ++i) {
        SCOPED_TRACE(i);
        NextHit before, after;
        for (const std::uint32_t key : {1U, 2U}) {
            const double along = (key == 1 ? 2 : -2) * points[i].x - points[i].z;
            // Of several coincident hits, the one drawn last counts as the hit before the point,
            // the one drawn first as the hit after the point.
            if (along > 0 && along < after.distance) after = {along, key};
            if (along <= 0 && -along < before.distance) before = {-along, key + 2};
        }
        EXPECT_EQ(found[i].before.key, before.key);
        EXPECT_EQ(found[i].after.key, after.key);
        if (before.key) {
            EXPECT_NEAR(found[i].before.distance, before.distance, 1e-12);
        }
        if (after.key) {
            EXPECT_NEAR(found[i].after.distance, after.distance, 1e-12);
        }
    }
}

TEST(PointHits, OnASurfaceButForRounding) {
    SceneBuilder builder;
    builder.triangles({{-1.1F, 0.3F, 7.7F}, {1.3F, -0.9F, 8.1F}, {0.2F, 1.7F, 9.3F}},
                      builder.material({1, 1, 1, 1}));
    const Traced traced(builder.scene());
    const auto& corner = builder.scene().meshes[0].primitives[0].positions;
    std::mt19937 random(23);
    std::uniform_real_distribution<double> weight(0.1, 0.4);
    std::vector<glm::dvec3> points;
    for (int i = 0; i < 500; ++i) {
        const double u = weight(random), v = weight(random);
        points.push_back((1 - u - v) * glm::dvec3(corner[0]) + u * glm::dvec3(corner[1]) +
                         v * glm::dvec3(corner[2]));
    }
    for (const PointHits& hit : traced.around(traced.bundle({1, 2, -3}, 64), points)) {
        EXPECT_EQ(hit.before.distance, 0);
        EXPECT_EQ(hit.before.key, 1U);
        EXPECT_EQ(hit.after.key, 0U);
    }
}

/// Compares hits with the intersections of slabs (Kay & Kajiya 1986).
TEST(PointHits, InsideAndOutsideACube) {
    const Traced traced(sceneOf({{"", {cube()}}}));
    std::mt19937 random(22);
    std::uniform_real_distribution<double> around(-1.6, 1.6);
    std::vector<glm::dvec3> points;
    for (int i = 0; i < 2000; ++i)
        points.emplace_back(around(random), around(random), around(random));
    struct Row {
        glm::dvec3 direction;
        double exact;  ///< the minimum share of points with exact distances
    };
    // At an oblique angle, an edge may lie between the point's own ray and the nearest traced ray.
    for (const Row& row : {Row{{0, 1, 0}, 1}, {{0, 0, -1}, 1}, {{1, 2, -3}, 0.97}}) {
        const glm::dvec3 direction = glm::normalize(row.direction);
        const auto found = traced.around(traced.bundle(direction, 128), points);
        std::size_t exact = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const glm::dvec3 a = (-1.0 - points[i]) / direction, b = (1.0 - points[i]) / direction;
            const glm::dvec3 in = glm::min(a, b), out = glm::max(a, b);
            const double t[] = {std::max({in.x, in.y, in.z}), std::min({out.x, out.y, out.z})};
            double before = kInfinity, after = kInfinity;
            for (const double along : t)
                if (t[0] < t[1])
                    (along > 0 ? after : before) =
                        std::min(along > 0 ? after : before, std::abs(along));
            const auto same = [](double x, double y) { return x == y || std::abs(x - y) < 1e-9; };
            exact += same(found[i].before.distance, before) && same(found[i].after.distance, after)
                         ? 1
                         : 0;
        }
        EXPECT_GE(exact, static_cast<std::size_t>(row.exact * 2000));
    }
}

TEST(PointHits, InsideASphereChordsAddUp) {
    SceneBuilder builder;
    builder.sphere({0, 0, 0}, 1, builder.material({1, 1, 1, 1}));
    const Traced traced(builder.scene());
    std::mt19937 random(21);
    std::uniform_real_distribution<double> within(-0.45, 0.45);
    std::vector<glm::dvec3> points;
    for (int i = 0; i < 500; ++i)
        points.emplace_back(within(random), within(random), within(random));
    const glm::dvec3 direction = glm::normalize(glm::dvec3(1, 2, -3));
    const Bundle bundle = traced.bundle(direction, 64);
    const LayeredImage hits = traced.hits(bundle);
    const auto found = traced.around(bundle, hits, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double along = glm::dot(points[i], direction);
        const double half = std::sqrt(1 - glm::dot(points[i], points[i]) + along * along);
        // The mesh is up to 0.004 inside the sphere, and is seen obliquely.
        EXPECT_NEAR(found[i].before.distance, half + along, 0.008);
        EXPECT_NEAR(found[i].after.distance, half - along, 0.008);
    }
    // All bands together must equal the whole.
    std::vector<PointHits> banded(points.size());
    for (int y = 0; y < bundle.view.height; y += 5) {
        Bundle part = bundle;
        part.view.crop.y0 = y;
        part.view.crop.y1 = std::min(y + 5, bundle.view.height);
        const LayeredImage band = traced.hits(part);
        const auto some = traced.around(bundle, band, points);
        for (std::size_t i = 0; i < points.size(); ++i)
            if (some[i].before.key || some[i].after.key) banded[i] = some[i];
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        EXPECT_EQ(banded[i].before.key, found[i].before.key);
        EXPECT_EQ(banded[i].after.distance, found[i].after.distance);
    }
}

}  // namespace
}  // namespace peeler::test
