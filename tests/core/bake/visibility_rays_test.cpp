// SPDX-License-Identifier: Apache-2.0
// Compares visibility rays with brute-force rays in double precision.
#include "core/bake/visibility_rays.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <glm/gtc/matrix_transform.hpp>
#include <numeric>
#include <random>
#include <span>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/error.h>
#include "core/bake/receivers.h"
#include "core/base/parallel.h"
#include "core/base/process_memory.h"
#include "core/raster/hit_rasterizer.h"
#include "support/numbers.h"
#include "support/one_mesh.h"

namespace peeler::test {
namespace {

constexpr double kOwnSurface = 1e-3;

/// Uniform random points in a cube around the origin.
class RandomPoints {
  public:
    glm::dvec3 operator()(double half) { return half * glm::dvec3(one_(), one_(), one_()); }
    glm::vec3 normal() { return glm::vec3(glm::normalize((*this)(1) + glm::dvec3(1e-9))); }

  private:
    struct One {
        double operator()() { return std::uniform_real_distribution<double>(-1, 1)(bits); }
        std::mt19937 bits{20};
    } one_;
};

/// Returns triangles of many sizes and shapes around the origin.
Primitive soup(RandomPoints& random, int triangles) {
    Primitive p;
    for (int i = 0; i < triangles; ++i) {
        const double size = std::pow(0.5, i % 8);
        const glm::dvec3 middle = random(1), along = random(size);
        for (const glm::dvec3& corner :
             {middle, middle + along, middle + 0.3 * along + random(0.2 * size)})
            p.positions.emplace_back(corner);
    }
    return p;
}

Receivers scattered(RandomPoints& random, std::size_t count) {
    Receivers receivers;
    for (std::size_t i = 0; i < count; ++i) {
        // Every fourth point is in a small cluster, so that the grid has empty, sparse and dense
        // cells.
        receivers.positions.push_back(i % 4 == 0 ? random(0.02) : random(1.1));
        receivers.normals.push_back(random.normal());
    }
    return receivers;
}

std::vector<std::uint32_t> all(const Receivers& receivers) {
    std::vector<std::uint32_t> chosen(receivers.size());
    std::iota(chosen.begin(), chosen.end(), 0U);
    return chosen;
}

/// The next hit of a ray, by Cramer's rule for each triangle. `doubtful`: rounding may change the
/// hit, because a hit or near miss is close to an edge, to the ray's own surface or to the grazing
/// angle.
struct RayHit {
    double distance = kInfinity;
    bool doubtful = false;
};
RayHit traced(const std::vector<std::array<glm::dvec3, 3>>& triangles, const glm::dvec3& from,
              const glm::dvec3& direction, Faces faces) {
    RayHit hit;
    for (const auto& [a, b, c] : triangles) {
        const glm::dvec3 normal = glm::cross(b - a, c - a);
        const double facing = -glm::dot(normal, direction);
        if (faces == Faces::kFront ? facing < 0 : faces == Faces::kBack && facing > 0) continue;
        const double t = glm::dot(a - from, normal) / -facing;
        const glm::dvec3 at = from + t * direction;
        const double square = glm::dot(normal, normal);
        const double weights[] = {glm::dot(glm::cross(c - b, at - b), normal) / square,
                                  glm::dot(glm::cross(a - c, at - c), normal) / square,
                                  glm::dot(glm::cross(b - a, at - a), normal) / square};
        const double least = std::min({weights[0], weights[1], weights[2]});
        if (!(least > -1e-3) || t < 0.5 * kOwnSurface) continue;
        if (std::abs(least) < 1e-3 || t < 2 * kOwnSurface ||
            std::abs(facing) < 0.01 * std::sqrt(square))
            hit.doubtful = true;
        if (least >= 0 && t > kOwnSurface) hit.distance = std::min(hit.distance, t);
    }
    return hit;
}

TEST(VisibilityRays, EndWhereRaysDo) {
    RandomPoints random;
    const glm::dmat4 mirror =
        glm::scale(glm::rotate(glm::dmat4(1), 0.7, {1, 2, 3}), glm::dvec3(-1, 1, 1));
    for (const bool mirrored : {false, true}) {
        const Scene scene = oneMesh({soup(random, 700)}, mirrored ? mirror : glm::dmat4(1));
        const PosedScene shown(scene);
        std::vector<std::array<glm::dvec3, 3>> triangles(700);
        const auto& positions = scene.meshes[0].primitives[0].positions;
        for (std::size_t i = 0; i < positions.size(); ++i)
            triangles[i / 3][mirrored ? 2 - i % 3 : i % 3] =
                glm::dvec3(scene.nodes[0].local * glm::dvec4(glm::dvec3(positions[i]), 1));
        const Receivers receivers = scattered(random, 500);
        for (const Faces faces : {Faces::kBoth, Faces::kFront, Faces::kBack}) {
            const Occluders occluders(shown, faces);
            VisibilityRays rays(occluders, static_cast<float>(kOwnSurface));
            rays.place(receivers, all(receivers));
            std::size_t seen = 0, nothing = 0, doubtful = 0;
            for (const bool inside : {false, true}) {
                const glm::dvec3 direction(random.normal());
                rays.look(direction, inside, kFloatInfinity);
                for (std::size_t r = 0; r < receivers.size(); ++r) {
                    const double cosine =
                        (inside ? -1 : 1) * glm::dot(glm::dvec3(receivers.normals[r]), direction);
                    ASSERT_NEAR(rays.cosines()[r], cosine, 1e-6);
                    const RayHit hit = traced(triangles, receivers.positions[r],
                                              cosine > 0 ? direction : -direction, faces);
                    if (hit.doubtful) {
                        ++doubtful;
                        continue;
                    }
                    const auto found = static_cast<double>(rays.distances()[r]);
                    if (hit.distance == kInfinity) {
                        ++nothing;
                        ASSERT_EQ(found, kInfinity) << r;
                    } else {
                        ++seen;
                        ASSERT_NEAR(found, hit.distance, 2e-4) << r;
                    }
                }
            }
            EXPECT_GT(seen, 80U);
            EXPECT_GT(nothing, 100U);
            EXPECT_LT(doubtful, 200U);
        }
    }
}

TEST(VisibilityRays, EndAtTheLargestDistance) {
    RandomPoints random;
    const Scene scene = oneMesh({soup(random, 300)});
    const Occluders occluders(PosedScene(scene), Faces::kBoth);
    const Receivers receivers = scattered(random, 400);
    VisibilityRays rays(occluders, static_cast<float>(kOwnSurface));
    rays.place(receivers, all(receivers));
    const glm::dvec3 direction(random.normal());
    rays.look(direction, false, kFloatInfinity);
    const std::vector<float> far(rays.distances().begin(), rays.distances().end());
    rays.look(direction, false, 0.8F);
    std::size_t nearer = 0;
    for (std::size_t r = 0; r < far.size(); ++r) {
        EXPECT_EQ(rays.distances()[r], far[r] < 0.8F ? far[r] : kFloatInfinity);
        nearer += far[r] < 0.8F ? 1 : 0;
    }
    EXPECT_GT(nearer, 50U);
    EXPECT_LT(nearer, 350U);
}

TEST(VisibilityRays, HaveTheSameBitsOnEveryProcessor) {
    RandomPoints random;
    const Scene scene = oneMesh({soup(random, 2000)});
    constexpr std::size_t kCount = 1000;
    std::vector<float> at[3], side, nearest[2];
    const Receivers receivers = scattered(random, kCount);
    for (std::size_t i = 0; i < kCount + CellReceivers::kBlock; ++i) {
        const glm::dvec3 place = i < kCount ? receivers.positions[i] : glm::dvec3(0);
        at[0].push_back(static_cast<float>(place.x / 4 + 0.5));
        at[1].push_back(static_cast<float>(place.y / 4 + 0.5));
        at[2].push_back(static_cast<float>(place.z));
        side.push_back(i % 2 == 0 ? 1.0F : -1.0F);
    }
    const std::uint32_t first[] = {0, kCount};  // one cell contains all receivers
    for (const Faces faces : {Faces::kBoth, Faces::kFront}) {
        const Occluders occluders(PosedScene(scene), faces);
        for (const bool for_every : {false, true}) {
            std::vector<float>& found = nearest[for_every ? 1 : 0];
            found.assign(kCount + CellReceivers::kBlock, kFloatInfinity);
            CellReceivers cells;
            cells.first = first;
            cells.units_a_cell = glm::vec2(4);
            cells.at = {at[0].data(), at[1].data(), at[2].data()};
            cells.side = side.data();
            cells.nearest = found.data();
            cells.own_surface = static_cast<float>(kOwnSurface);
            for (const OccluderPiece& piece : occluders.pieces()) {
                PatchView view;
                for (int axis = 0; axis < 3; ++axis) {
                    const double scale = axis < 2 ? 0.25 : 1;
                    glm::vec4& row = view.rows[static_cast<std::size_t>(axis)];
                    row[axis] = static_cast<float>(scale);
                    row.w = static_cast<float>(scale * piece.offset[axis] + (axis < 2 ? 0.5 : 0));
                }
                for (const OccluderPatch& patch : occluders.patches(piece))
                    coverPatchFor(piece, for_every)(occluders, piece, patch, view, cells);
            }
        }
        EXPECT_EQ(std::memcmp(nearest[0].data(), nearest[1].data(), kCount * sizeof(float)), 0);
        EXPECT_GT(std::ranges::count_if(nearest[0], [](float d) { return d < 10; }), 300);
    }
}

/// Returns a square of side 2 around the origin. It faces +Z, and U is to the right.
Primitive square(float z = 0) {
    Primitive p;
    p.positions = {{-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}};
    p.texcoords[0] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    p.indices = {0, 1, 2, 0, 2, 3};
    return p;
}

/// Returns the distance from each point to the next hit along +Z.
std::vector<float> seenUpward(const Scene& scene, const std::vector<glm::dvec3>& points,
                              Faces faces = Faces::kBoth) {
    const Occluders occluders(PosedScene(scene), faces);
    VisibilityRays rays(occluders, static_cast<float>(kOwnSurface));
    const Receivers receivers{points, std::vector<glm::vec3>(points.size(), glm::vec3(0, 0, 1))};
    rays.place(receivers, all(receivers));
    rays.look({0, 0, 1}, false, kFloatInfinity);
    return {rays.distances().begin(), rays.distances().end()};
}

TEST(VisibilityRays, GoThroughWhatAlphaLeavesOut) {
    Primitive p = square();
    // 300 more triangles make several patches.
    p.positions.insert(p.positions.end(), {{5, 0, 0}, {6, 0, 0}, {6, 1, 0}});
    p.texcoords[0].resize(p.positions.size());
    for (int i = 0; i < 300; ++i)
        p.indices.insert(p.indices.begin(), {4, 5, 6});
    Scene scene = oneMesh({p});
    Image image;
    image.width = 2;
    image.height = 1;
    image.rgba = {255, 255, 255, 0, 255, 255, 255, 255};
    scene.images = {image};
    Material& material = scene.materials[0];
    material.base_color_texture.image = 0;
    material.base_color_texture.sampler.mag_filter = 9728;  // GL_NEAREST
    const std::vector<glm::dvec3> points{{-0.5, 0.2, -2}, {0.5, 0.2, -2}, {1.5, 0.2, -2}};
    for (const AlphaMode mode : {AlphaMode::kOpaque, AlphaMode::kMask, AlphaMode::kBlend}) {
        material.alpha_mode = mode;
        const std::vector<float> seen = seenUpward(scene, points);
        EXPECT_EQ(seen[0], mode == AlphaMode::kOpaque ? 2 : kFloatInfinity);
        EXPECT_EQ(seen[1], 2);
        EXPECT_EQ(seen[2], kFloatInfinity);
    }
}

TEST(VisibilityRays, SeeFrontsAndBacksAsMaterialsSay) {
    Scene scene = oneMesh({square()});
    for (const bool double_sided : {false, true}) {
        scene.materials[0].double_sided = double_sided;
        const glm::dvec3 below(0.3, 0.2, -2);
        EXPECT_EQ(seenUpward(scene, {below}, Faces::kGltf)[0], double_sided ? 2 : kFloatInfinity);
        EXPECT_EQ(seenUpward(scene, {below}, Faces::kBack)[0], 2);
        EXPECT_EQ(seenUpward(scene, {below}, Faces::kFront)[0], kFloatInfinity);
    }
}

TEST(VisibilityRays, AreNotStoppedByWhatIsNowhere) {
    Scene scene = oneMesh({square()});
    Primitive& p = scene.meshes[0].primitives[0];
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const float value : {nan, kFloatInfinity, -kFloatInfinity}) {
        const auto first = static_cast<std::uint32_t>(p.positions.size());
        p.positions.insert(p.positions.end(), {{value, 0, -1}, {2, value, -1}, {-2, -2, -1}});
        p.texcoords[0].resize(p.positions.size());
        p.indices.insert(p.indices.end(), {first, first + 1, first + 2});
    }
    // The call must not crash. The scene's bounds are not finite, so no other quantity can be
    // baked.
    seenUpward(scene, {{0.3, 0.2, -2}});
    Scene line = oneMesh({square()});
    line.meshes[0].primitives[0].indices.insert(line.meshes[0].primitives[0].indices.end(),
                                                {0, 1, 1, 2, 2, 2});
    EXPECT_EQ(seenUpward(line, {{0.3, 0.2, -2}})[0], 2);
}

/// A HitRasterizer whose prefersLines() is false, so that baking uses bundles.
class Bundled final : public HitSource {
  public:
    explicit Bundled(const PosedScene& posed) : hits_(posed) {}
    CapturePlan plan(const View& view, const CaptureSettings& settings,
                     const Progress& told) override {
        return hits_.plan(view, settings, told);
    }
    CaptureReport capture(const CapturePlan& plan, Sink& sink, const Progress& told) override {
        return hits_.capture(plan, sink, told);
    }
    std::uint64_t forecastMemory(const CapturePlan& plan, const Sink& sink) override {
        return hits_.forecastMemory(plan, sink);
    }
    const PosedScene& posed() const override { return hits_.posed(); }
    StageTimes takeTimes() override { return hits_.takeTimes(); }

  private:
    HitRasterizer hits_;
};

std::vector<float> baked(HitSource& source, const Receivers& receivers,
                         BakeQuantity quantity = BakeQuantity::kAmbientOcclusion,
                         std::uint64_t memory = 0) {
    BakeSettings settings;
    settings.quantity = quantity;
    settings.directions = 128;
    settings.resolution = 256;
    settings.max_distance = 1;
    CaptureSettings capture;
    capture.faces = Faces::kBoth;
    capture.memory = memory;
    return bake(source, receivers, settings, capture, {}, {});
}

/// Receivers in a scene with two hit sources: one for individual rays, and one that prefers
/// bundles.
struct Both {
    RandomPoints random;
    Scene scene = oneMesh({soup(random, 60), square(-0.5F)});
    PosedScene shown{scene};
    Receivers receivers = scattered(random, 300);
    HitRasterizer lines{shown};
    Bundled bundles{shown};
};

TEST(VisibilityRays, AgreeWithBundles) {
    Both both;
    auto& [random, scene, shown, receivers, lines, bundles] = both;
    for (const BakeQuantity quantity :
         {BakeQuantity::kAmbientOcclusion, BakeQuantity::kSkyVisibility, BakeQuantity::kBentNormal,
          BakeQuantity::kThickness}) {
        const auto a = baked(lines, receivers, quantity), b = baked(bundles, receivers, quantity);
        ASSERT_EQ(a.size(), b.size());
        double apart = 0;
        for (std::size_t i = 0; i < a.size(); ++i)
            apart += static_cast<double>(std::abs(a[i] - b[i])) / static_cast<double>(a.size());
        EXPECT_LT(apart, 0.01) << static_cast<int>(quantity);
    }
}

TEST(VisibilityRays, AreTheSameForAllThreadsAndBudgets) {
    RandomPoints random;
    const Scene scene = oneMesh({soup(random, 50)});
    const PosedScene shown(scene);
    // The second count needs several chunks.
    for (const std::size_t count : {std::size_t{500}, std::size_t{140'000}}) {
        const Receivers receivers = scattered(random, count);
        HitRasterizer source(shown);
        setThreadCount(1);
        const auto one = baked(source, receivers);
        setThreadCount(3);
        EXPECT_EQ(baked(source, receivers), one);
        const std::uint64_t tight = residentBytes() + (count > 1000 ? 60ULL : 4ULL) * (1 << 20);
        EXPECT_EQ(baked(source, receivers, BakeQuantity::kAmbientOcclusion, tight), one);
        setThreadCount(0);
        // In a subset, receivers have different neighbours and therefore different rounding.
        Receivers few;
        std::vector<float> expected;
        for (std::size_t r = 0; r < count; r += count / 250) {
            few.positions.push_back(receivers.positions[r]);
            few.normals.push_back(receivers.normals[r]);
            expected.push_back(one[r]);
        }
        const auto alone = baked(source, few);
        double apart = 0;
        for (std::size_t i = 0; i < alone.size(); ++i)
            apart += static_cast<double>(std::abs(alone[i] - expected[i])) / 250;
        EXPECT_LT(apart, 1e-4);
        const auto [least, most] = std::ranges::minmax(one);
        EXPECT_LT(least, 0.8F);
        EXPECT_GT(most, 0.9F);
    }
}

TEST(VisibilityRays, TellBeforeTheyLook) {
    Both both;
    auto& [random, scene, shown, receivers, lines, bundles] = both;
    BakeSettings settings;
    settings.directions = 16;
    settings.resolution = 64;
    for (HitSource* const source :
         {static_cast<HitSource*>(&lines), static_cast<HitSource*>(&bundles)}) {
        std::vector<std::uint64_t> told;
        double done = 0;
        bake(
            *source, receivers, settings, {}, {}, [&](double share) { done = share; },
            [&](std::uint64_t bytes) {
                EXPECT_LT(done, 1);
                told.push_back(bytes);
            });
        // Individual rays are traced in one step, bundles in 8 steps of two bundles each.
        ASSERT_EQ(told.size(), source == &lines ? 1U : 8U);
        const std::uint64_t before = forecastBake(*source, receivers, settings, {}, {});
        EXPECT_GT(before, 1'000'000U);
        EXPECT_NEAR(static_cast<double>(before), static_cast<double>(told.back()),
                    0.5 * static_cast<double>(before));
    }
    // For each of a million receivers, memory holds a value and two sums: the total, and the sum of
    // a group of directions.
    Receivers many = scattered(random, 1'000'000);
    const std::uint64_t few = forecastBake(lines, receivers, settings, {}, {});
    EXPECT_GT(forecastBake(lines, many, settings, {}, {}), few + 30'000'000);
    CaptureSettings tight;
    tight.memory = few + 10'000'000;
    EXPECT_THROW(forecastBake(lines, many, settings, tight, {}), Error);
}

}  // namespace
}  // namespace peeler::test
