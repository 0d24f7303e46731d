// SPDX-License-Identifier: Apache-2.0
// Tests all hits of any rays: brute force in exact integers, closed surfaces, coincident triangles,
// threads, and the rays of a bundle.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <peeler/work.h>
#include "core/raster/hit_rasterizer.h"
#include "core/scene/view.h"
#include "core/trace/ray_tracer.h"
#include "support/aimed_rays.h"
#include "support/closed_meshes.h"
#include "support/hits_oracle.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

constexpr TraceSettings kBothFaces{Faces::kBoth};

RayHits tracedBy(const RayTracer& tracer, std::span<const Ray> rays,
                 const TraceSettings& settings = kBothFaces) {
    RayHits hits;
    tracer.trace(rays, settings, hits);
    return hits;
}

using Integers = std::array<std::int64_t, 3>;

Integers minus(const Integers& a, const Integers& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Integers crossProduct(const Integers& a, const Integers& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Wide dotProduct(const std::array<Wide, 3>& a, const Integers& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
std::array<Wide, 3> widened(const Integers& a) {
    return {a[0], a[1], a[2]};
}

/// Returns hits by brute force, as (t, key). Coordinates are integers of at most 64, and the ray's
/// origin is really moved by (ε, ε², ε³) with ε = 2^-22, in units of ε³. Determinants are integers;
/// their coefficients of ε, ε² and ε³ are integers below 2^16. So a smaller ε would not change a
/// sign.
std::vector<std::pair<float, std::uint32_t>> bruteForce(
    const std::vector<std::array<Integers, 3>>& triangles, const Integers& origin,
    const Integers& direction) {
    constexpr int kBits = 22;
    std::vector<std::pair<float, std::uint32_t>> hits;
    // Returns (a − origin − (ε, ε², ε³)) / ε³.
    const auto from_origin = [&](const Integers& a) {
        std::array<Wide, 3> at{};
        for (std::size_t i = 0; i < 3; ++i)
            at[i] = (Wide{a[i] - origin[i]} << (3 * kBits)) - (Wide{1} << ((2 - i) * kBits));
        return at;
    };
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const auto& t = triangles[i];
        int positive = 0, negative = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const Integers &a = t[k], &b = t[(k + 1) % 3];
            // det(A, e, d) = A · (e × d)
            const Wide side = dotProduct(from_origin(a), crossProduct(minus(b, a), direction));
            positive += side > 0 ? 1 : 0;
            negative += side < 0 ? 1 : 0;
        }
        if (positive < 3 && negative < 3) continue;
        const Integers normal = crossProduct(minus(t[1], t[0]), minus(t[2], t[0]));
        const auto along = static_cast<std::int64_t>(dotProduct(widened(normal), direction));
        const Wide ahead = dotProduct(from_origin(t[0]), normal);
        if ((ahead > 0) != (along > 0)) continue;
        const auto distance =
            static_cast<std::int64_t>(dotProduct(widened(normal), minus(t[0], origin)));
        // Both are below 2^26, so the double is never rounded to the middle of two floats.
        const double quotient = static_cast<double>(distance) / static_cast<double>(along);
        hits.emplace_back(static_cast<float>(quotient) + 0.0F, static_cast<std::uint32_t>(i) + 1);
    }
    std::sort(hits.begin(), hits.end());
    return hits;
}

TEST(RayTracer, AgreesWithBruteForceInIntegers) {
    std::mt19937 random(peeler::test::exhaustive() ? 11 : 10);
    std::uint64_t found = 0, touching = 0;
    for (int round = 0; round < (exhaustive() ? 400 : 12); ++round) {
        // Small coordinates, so that rays often pass through edges, corners and planes.
        const int most = 1 << (2 + round % 5);
        const auto number = [&] {
            return static_cast<std::int64_t>(random() % static_cast<unsigned>(2 * most)) - most;
        };
        const auto point = [&] { return Integers{number(), number(), number()}; };
        std::vector<std::array<Integers, 3>> triangles(60);
        Primitive soup;
        for (auto& triangle : triangles) {
            triangle = {point(), point(), point()};
            if (&triangle != triangles.data() && random() % 4 == 0) triangle = *(&triangle - 1);
            for (const Integers& corner : triangle)
                soup.positions.emplace_back(corner[0], corner[1], corner[2]);
        }
        const Scene scene = sceneOf({{"", {soup}}});
        const RayTracer tracer{PosedScene(scene)};
        std::vector<Integers> origins, directions;
        std::vector<Ray> rays;
        // In every other round, rays of one eye are close to each other (RayPacket), or of eyes
        // that are close to each other.
        const bool packets = round % 2 == 1 && most <= 8, near = round % 2 == 1 && most >= 32;
        Integers eye{};
        for (int i = 0; i < 512; ++i) {
            const auto& triangle = triangles[random() % triangles.size()];
            Integers origin = random() % 8 == 0 ? triangle[1] : point();
            if (origins.size() % 64 == 0) {
                eye = {number(), number(), number()};
                eye[random() % 3] = random() % 2 == 0 ? 62 : -62;
            }
            if (packets || near) origin = eye;
            if (near) origin[random() % 3] += random() % 2 == 0 ? 1 : -1;
            Integers aim = random() % 3 == 0 ? point() : triangle[random() % 3];
            if (random() % 4 == 0)
                for (std::size_t k = 0; k < 3; ++k)
                    aim[k] = (triangle[0][k] + triangle[1][k]) / 2;
            const Integers direction = minus(aim, origin);
            if (direction == Integers{}) continue;
            origins.push_back(origin);
            directions.push_back(direction);
            rays.push_back({glm::dvec3(origin[0], origin[1], origin[2]),
                            glm::dvec3(direction[0], direction[1], direction[2])});
        }
        const RayHits hits = tracedBy(tracer, rays);
        ASSERT_EQ(hits.rays(), rays.size());
        for (std::size_t i = 0; i < rays.size(); ++i) {
            std::vector<std::pair<float, std::uint32_t>> ours;
            for (std::size_t k = 0; k < hits.count(i); ++k)
                ours.emplace_back(hits.t[hits.offsets[i] + k], hits.keys[hits.offsets[i] + k]);
            ASSERT_EQ(ours, bruteForce(triangles, origins[i], directions[i]))
                << "ray " << i << " of round " << round;
            found += ours.size();
            for (const auto& [t, key] : ours) {
                const auto weights = tracer.weightsAt(rays[i], key);
                EXPECT_NEAR(weights[0] + weights[1] + weights[2], 1, 1e-15);
                touching += *std::min_element(weights.begin(), weights.end()) == 0 ? 1 : 0;
                const auto& corners = triangles[key - 1];
                for (std::size_t k = 0; k < 3; ++k) {
                    double at = 0;
                    for (std::size_t c = 0; c < 3; ++c)
                        at += weights[c] * static_cast<double>(corners[c][k]);
                    EXPECT_NEAR(at,
                                static_cast<double>(origins[i][k]) +
                                    double{t} * static_cast<double>(directions[i][k]),
                                1e-5 * most);
                }
            }
        }
    }
    EXPECT_GT(found, 5000U);
    EXPECT_GT(touching, 1000U);
}

/// Returns a picture's rays from an eye, an equirectangular one, in tiles of 8 x 8.
std::vector<Ray> panorama(const glm::dvec3& eye, int width) {
    std::vector<Ray> rays;
    for (int tile = 0; tile < width / 8 * (width / 16); ++tile) {
        for (int i = 0; i < 64; ++i) {
            const double x = tile % (width / 8) * 8 + i % 8, y = tile / (width / 8) * 8 + i / 8;
            const double longitude = 2 * std::numbers::pi * x / width;
            const double latitude = 2 * std::numbers::pi * y / width;
            rays.push_back(
                {eye, glm::dvec3(std::sin(latitude) * std::cos(longitude), std::cos(latitude),
                                 std::sin(latitude) * std::sin(longitude))});
        }
    }
    return rays;
}

/// Expects the hits of every ray, and those of every `step`-th ray of other hits, to be equal.
void expectAlike(const RayHits& all, const RayHits& others, std::size_t step) {
    std::size_t hits = 0;
    for (std::size_t i = 0; i < all.rays(); ++i) {
        ASSERT_EQ(all.count(i), others.count(step * i)) << i;
        for (std::size_t k = 0; k < all.count(i); ++k) {
            ASSERT_EQ(all.t[all.offsets[i] + k], others.t[others.offsets[step * i] + k]);
            ASSERT_EQ(all.keys[all.offsets[i] + k], others.keys[others.offsets[step * i] + k]);
        }
        hits += all.count(i);
    }
    EXPECT_GT(hits, 1000U);
}

TEST(RayTracer, PacketsChangeNoBit) {
    // Rays of two eyes in turn cannot be traced together.
    const Scene scene = sceneOf({{"", {icosphere(4)}}, {"", {torus(0.4, 48, 24)}}, {"", {cube()}}});
    const RayTracer tracer{PosedScene(scene)};
    // The first eye is in the plane of a side of the cube, the last one inside the solids.
    for (const glm::dvec3& eye : {glm::dvec3(1, 0.25, 3), glm::dvec3(0.1, -2, 0.2),
                                  glm::dvec3(-900, 10, 5), glm::dvec3(0.01, 0.02, 0.03)}) {
        std::vector<Ray> rays = panorama(eye, exhaustive() ? 2048 : 256);
        if (eye.x < -100) {
            for (Ray& ray : rays)
                ray.direction = glm::dvec3(900, -10, -5) + 2.0 * ray.direction;
        }
        std::vector<Ray> mixed;
        for (const Ray& ray : rays) {
            mixed.push_back(ray);
            mixed.push_back({ray.origin + glm::dvec3(1), ray.direction});
        }
        const RayHits together = tracedBy(tracer, rays), single = tracedBy(tracer, mixed);
        expectAlike(together, single, 2);

        // Eyes that are close to each other, like those of a sensor that moves.
        for (std::size_t i = 0; i < rays.size(); ++i)
            rays[i].origin += 1e-3 * static_cast<double>(i % 64) * glm::dvec3(0.3, -0.1, 0.2);
        for (std::size_t i = 0; i < rays.size(); ++i)
            mixed[2 * i] = rays[i];
        expectAlike(tracedBy(tracer, rays), tracedBy(tracer, mixed), 2);
    }
}

TEST(RayTracer, ClosedSurfacesAreHitAnEvenNumberOfTimes) {
    const Scene scene = sceneOf({{"", {icosphere(3)}}, {"", {torus(0.4, 24, 12)}}, {"", {cube()}}});
    const RayTracer tracer{PosedScene(scene)};
    const AimedRays aimed(tracer.posed());
    const std::size_t count = exhaustive() ? 3'000'000 : 60'000;
    const AimedRays::Odd odd = aimed.odd(tracer, count, 7);
    EXPECT_EQ(odd.rays, 0U);
    EXPECT_GT(odd.hits, count);
}

TEST(RayTracer, RaysAlongEdgesAndInPlanesAreConsistent) {
    const Scene scene = sceneOf({{"", {cube()}}});
    const RayTracer tracer{PosedScene(scene)};
    std::vector<Ray> rays;
    for (int axis = 0; axis < 3; ++axis) {
        for (int i = -4; i <= 4; ++i) {
            for (int j = -4; j <= 4; ++j) {
                glm::dvec3 origin(0), direction(0);
                origin[axis] = -3;
                direction[axis] = 1;
                origin[(axis + 1) % 3] = i / 4.0;
                origin[(axis + 2) % 3] = j / 4.0;
                rays.push_back({origin, direction});
            }
        }
    }
    const RayHits hits = tracedBy(tracer, rays);
    std::size_t through = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_TRUE(hits.count(i) == 0 || hits.count(i) == 2) << i;
        through += hits.count(i) / 2;
        if (hits.count(i) == 0) continue;
        EXPECT_EQ(hits.t[hits.offsets[i]], 2);
        EXPECT_EQ(hits.t[hits.offsets[i] + 1], 4);
    }
    // The moved ray is inside on two of the four sides: 8 · 8 of 9 · 9 rays.
    EXPECT_EQ(through, 3U * 64);
}

TEST(RayTracer, CoincidentTrianglesAreAllHitInDrawOrder) {
    const Scene once = sceneOf({{"", {icosphere(2)}}}), twice = doubled(once);
    const RayTracer one{PosedScene(once)}, two{PosedScene(twice)};
    const std::vector<Ray> rays = AimedRays(one.posed()).rays(20'000, 3);
    const RayHits a = tracedBy(one, rays), b = tracedBy(two, rays);
    const auto half = static_cast<std::uint32_t>(one.triangles());
    ASSERT_EQ(b.t.size(), 2 * a.t.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
        ASSERT_EQ(b.count(i), 2 * a.count(i));
        for (std::size_t k = 0; k < a.count(i); ++k) {
            const std::size_t at = a.offsets[i] + k;
            // Two triangles of a sphere at one t: only at an edge.
            const bool edge =
                (k > 0 && a.t[at - 1] == a.t[at]) || (k + 1 < a.count(i) && a.t[at + 1] == a.t[at]);
            EXPECT_EQ(b.t[b.offsets[i] + 2 * k], a.t[at]);
            EXPECT_EQ(b.t[b.offsets[i] + 2 * k + 1], a.t[at]);
            if (edge) continue;
            EXPECT_EQ(b.keys[b.offsets[i] + 2 * k], a.keys[at]);
            EXPECT_EQ(b.keys[b.offsets[i] + 2 * k + 1], a.keys[at] + half);
        }
    }
}

TEST(RayTracer, ThreadsDoNotChangeABit) {
    const Scene scene = randomTriangles(5, 2000);
    std::vector<RayHits> found;
    for (const int threads : {1, 2}) {
        setThreadCount(threads);
        const RayTracer tracer{PosedScene(scene)};
        found.push_back(tracedBy(tracer, AimedRays(tracer.posed()).rays(20'000, 4)));
    }
    setThreadCount(0);
    EXPECT_EQ(found[0].offsets, found[1].offsets);
    EXPECT_EQ(found[0].t, found[1].t);
    EXPECT_EQ(found[0].keys, found[1].keys);
    EXPECT_GT(found[0].t.size(), 20'000U);
}

TEST(RayTracer, FacesNearAndFarSelectHits) {
    const Scene scene = sceneOf({{"", {cube()}}});
    const RayTracer tracer{PosedScene(scene)};
    const std::vector<Ray> rays{{{0.25, 0.125, 3}, {0, 0, -1}}};
    const auto found = [&](Faces faces, double near, double far) {
        return tracedBy(tracer, rays, {faces, near, far}).t;
    };
    using Hits = std::vector<float>;
    EXPECT_EQ(found(Faces::kBoth, 0, 100), (Hits{2, 4}));
    EXPECT_EQ(found(Faces::kFront, 0, 100), (Hits{2}));
    EXPECT_EQ(found(Faces::kGltf, 0, 100), (Hits{2}));
    EXPECT_EQ(found(Faces::kBack, 0, 100), (Hits{4}));
    EXPECT_EQ(found(Faces::kBoth, 2, 4), (Hits{2}));
    EXPECT_EQ(found(Faces::kBoth, 2.5, 4.5), (Hits{4}));
}

TEST(RayTracer, RaysOfAnyLengthAndFromAnywhere) {
    const Scene scene = sceneOf({{"", {cube()}}});
    const RayTracer tracer{PosedScene(scene)};
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const std::vector<Ray> rays{
        {{0, 0.25, 0.125}, {1, 0, 0}},         // inside
        {{-1e5, 0.25, 0.125}, {1e-30, 0, 0}},  // t beyond a third of the floats
        {{-1e30, 0.25, 0.125}, {1e30, 0, 0}},  // far away
        {{1e30, 0.25, 0.125}, {1, 0, 0}},      // leads away
        {{-1e30, 0.25, 0.125}, {1, 1, 0}},     // passes
        {{-3, 0.25, 0.125}, {0, 0, 0}},        // no direction
        {{-3, kInfinity, 0.125}, {1, 0, 0}},   // not finite
        {{-3, 0.25, 0.125}, {1, std::nan(""), 0}},
        {{-3, 0.25, 0.125}, {1e-12, 1e-300, 0}},
    };
    const RayHits hits = tracedBy(tracer, rays);
    std::vector<std::size_t> counts;
    for (std::size_t i = 0; i < rays.size(); ++i)
        counts.push_back(hits.count(i));
    EXPECT_EQ(counts, (std::vector<std::size_t>{1, 2, 2, 0, 0, 0, 0, 0, 2}));
    EXPECT_EQ(hits.t[0], 1);
    EXPECT_EQ(hits.t[1], static_cast<float>(99999 / 1e-30));
    EXPECT_EQ(hits.t[3], 1);
}

TEST(RayTracer, FindsTheHitsOfABundle) {
    // Both engines are exact on their own grids, so they differ at most where a ray passes an edge
    // within a grid step.
    const Scene scene = randomTriangles(9, 2000);
    const PosedScene posed(scene);
    const RayTracer tracer(posed);
    HitRasterizer rasterizer(posed);
    const HitsOracle oracle(posed);
    for (const View& view : oracle.views(2, 200)) {
        const TracedHits traced = trace(rasterizer, view);
        std::vector<Ray> rays;
        const Window& window = traced.image.window;
        for (int y = window.y0; y < window.y1; ++y) {
            for (int x = window.x0; x < window.x1; ++x) {
                const glm::dvec2 at = glm::dvec2(x, y) + view.sample;
                const glm::dvec3 near = worldPosition(view, at.x, at.y, 0),
                                 next = worldPosition(view, at.x, at.y, 1);
                rays.push_back({near, next - near});
            }
        }
        const RayHits hits = tracedBy(tracer, rays);
        std::size_t differing = 0;
        double largest = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
            const std::vector<std::uint32_t> keys = traced.keys(i);
            const std::vector<std::uint32_t> ours(
                hits.keys.begin() + static_cast<std::ptrdiff_t>(hits.offsets[i]),
                hits.keys.begin() + static_cast<std::ptrdiff_t>(hits.offsets[i + 1]));
            if (keys != ours) {
                ++differing;
                continue;
            }
            for (std::size_t k = 0; k < keys.size(); ++k) {
                const double z = double{traced.image.z[traced.image.offsets[i] + k]};
                largest = std::max(
                    largest, std::abs(double{hits.t[hits.offsets[i] + k]} - z) / std::max(z, 1e-3));
            }
        }
        EXPECT_LE(differing, rays.size() / 10'000);
        EXPECT_LE(largest, 0x1p-23);
        EXPECT_GT(hits.t.size(), rays.size() / 10);
    }
}

}  // namespace
}  // namespace peeler::test
