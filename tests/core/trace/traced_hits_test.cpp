// SPDX-License-Identifier: Apache-2.0
// Tests hits of pictures with rays of their own: closed forms, bands, memory, parity.
#include "core/trace/traced_hits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <utility>

#include <peeler/error.h>
#include "core/base/process_memory.h"
#include "core/lens/picture_rays.h"
#include "core/raster/hit_rasterizer.h"
#include "core/rays/ray_maps.h"
#include "core/rays/solids.h"
#include "core/scene/intrinsics.h"
#include "core/scene/view.h"
#include "support/closed_meshes.h"
#include "support/one_mesh.h"
#include "support/test_support.h"
#include "support/traced_hits.h"

namespace peeler::test {
namespace {

/// The CPU's sources of hits.
struct Sources {
    explicit Sources(Scene of) : scene(std::move(of)) {}

    Scene scene;
    PosedScene posed{scene};
    HitRasterizer rasterizer{posed};
    peeler::TracedHits all{posed, &rasterizer};
};

View throughLens(const Lens& lens, const Intrinsics& intrinsics, const Size& size,
                 const glm::dvec3& eye = glm::dvec3(0)) {
    View view;
    view.width = size.width;
    view.height = size.height;
    view.crop = {0, 0, size.width, size.height};
    view.camera_to_world[3] = glm::dvec4(eye, 1);
    setLens(view, {lens, intrinsics});
    return view;
}

View fisheye(int size, double degrees, const glm::dvec3& eye = glm::dvec3(0)) {
    const double f = size / (degrees * std::numbers::pi / 180);
    const double middle = (size - 1) / 2.0;
    return throughLens({"fisheye"}, {f, f, middle, middle}, {size, size}, eye);
}

/// Returns the distance at which a ray leaves the cube from −1 to 1 that it begins in.
double distanceInCube(const glm::dvec3& eye, const glm::dvec3& direction) {
    double nearest = 1e9;
    for (int axis = 0; axis < 3; ++axis)
        if (direction[axis] != 0)
            nearest = std::min(nearest,
                               (std::copysign(1, direction[axis]) - eye[axis]) / direction[axis]);
    return nearest;
}

TEST(TracedPictures, EveryDirectionSeesTheWallOfABox) {
    Sources sources(sceneOf({{"", {cube()}}}));
    const glm::dvec3 eye(0.25, -0.5, 0.125);
    for (const View& view : {throughLens({"equirectangular"}, {}, {256, 128}, eye),
                             throughLens({"cube"}, {}, {192, 128}, eye), fisheye(100, 220, eye)}) {
        const TracedHits traced = trace(sources.all, view);
        std::size_t rays = 0;
        for (int y = 0; y < view.height; ++y) {
            for (int x = 0; x < view.width; ++x) {
                const Ray ray = rayOf(view, glm::dvec2(x, y) + 0.5);
                const std::size_t pixel = traced.image.pixelIndex(x, y);
                if (ray.direction == glm::dvec3(0)) {
                    EXPECT_EQ(traced.image.count(pixel), 0U);
                    continue;
                }
                ++rays;
                ASSERT_EQ(traced.image.count(pixel), 1U) << x << ", " << y;
                const double expected = distanceInCube(eye, ray.direction);
                EXPECT_NEAR(traced.image.z[traced.image.offsets[pixel]], expected, 1e-6);
            }
        }
        EXPECT_GT(rays, view.crop.pixels() / 2);
    }
}

TEST(TracedPictures, ASphereSeenByAFisheyeIsACircle) {
    // The angular radius of a sphere of radius 1 at distance 2 is 30°.
    Scene scene = sceneOf({{"", {icosphere(5)}}});
    Sources sources(scene);
    const View view = fisheye(400, 180, {0, 0, 2});
    const TracedHits traced = trace(sources.all, view);
    const double radius = 400.0 / 6;
    for (int y = 0; y < 400; ++y) {
        for (int x = 0; x < 400; ++x) {
            const double r = std::hypot(x + 0.5 - 200, y + 0.5 - 200);
            const std::size_t pixel = traced.image.pixelIndex(x, y);
            if (std::abs(r - radius) < 0.5) continue;
            ASSERT_EQ(traced.image.count(pixel), r < radius ? 2U : 0U) << x << ", " << y;
            if (r > radius) continue;
            const double angle = r / 400 * std::numbers::pi;
            const double middle = 2 * std::cos(angle);
            const double half = std::sqrt(middle * middle - 3);
            EXPECT_NEAR(traced.image.z[traced.image.offsets[pixel]], middle - half, 3e-2);
        }
    }
}

bool isEqual(const LayeredImage& a, const LayeredImage& b) {
    bool equal = a.window == b.window && a.offsets == b.offsets && a.z == b.z &&
                 a.extra.size() == b.extra.size();
    for (std::size_t i = 0; equal && i < a.extra.size(); ++i)
        equal = a.extra[i].channels == b.extra[i].channels && a.extra[i].data == b.extra[i].data;
    return equal;
}

TracedHits tracedAnew(const Scene& scene, const View& view, const CaptureSettings& settings) {
    Sources sources(scene);
    return trace(sources.all, view, settings);
}

TEST(TracedPictures, BandsAndTheMemoryForHitsChangeNothing) {
    const Scene scene = sceneOf({{"", {torus(0.4, 90, 40), icosphere(4)}}});
    View view = fisheye(700, 200, {0.1, 0.2, 1.5});
    CaptureSettings settings = hitSettings();
    settings.channels = {Channel::kNormal, Channel::kFacing, Channel::kBarycentric};
    const TracedHits whole = tracedAnew(scene, view, settings);
    EXPECT_GT(whole.image.fragments(), 100'000U);
    settings.band_bytes = 1 << 16;  // limits the kept hits, too, so most are found again
    const TracedHits banded = tracedAnew(scene, view, settings);
    EXPECT_GT(banded.bands.size(), whole.bands.size());
    EXPECT_TRUE(isEqual(banded.image, whole.image));

    Sources tight(scene);
    settings.memory = MemoryBudget(residentBytes() + (150U << 20));
    const TracedHits again = trace(tight.all, view, settings);
    EXPECT_TRUE(isEqual(again.image, whole.image));
    settings.memory = MemoryBudget(1U << 20);
    EXPECT_THROW(tracedAnew(scene, view, settings), Error);

    const Window crop{300, 411, 433, 587};
    view.crop = crop;
    settings.memory = 0;
    const TracedHits cut = trace(tight.all, view, settings);
    for (int y = crop.y0; y < crop.y1; ++y) {
        for (int x = crop.x0; x < crop.x1; ++x) {
            const std::size_t a = cut.image.pixelIndex(x, y), b = whole.image.pixelIndex(x, y);
            ASSERT_EQ(cut.keys(a), whole.keys(b));
            for (std::uint32_t i = 0; i < cut.image.count(a); ++i)
                ASSERT_EQ(cut.image.z[cut.image.offsets[a] + i],
                          whole.image.z[whole.image.offsets[b] + i]);
        }
    }
}

TEST(TracedPictures, PinholesAndParallelRaysAreRasterised) {
    const Scene scene = sceneOf({{"", {torus(0.4, 90, 40)}}});
    Sources sources(scene);
    for (const View& view : {pinhole({1, 2, 3}, 90), bundleOf(sources.posed, {1, 2, 3}, 80).view}) {
        const TracedHits routed = trace(sources.all, view);
        HitRasterizer alone(sources.posed);
        EXPECT_TRUE(isEqual(routed.image, trace(alone, view).image));
        EXPECT_EQ(routed.plan.fragments_counted, routed.image.fragments());
    }
}

TEST(TracedPictures, APinholeLensSeesWhatThePinholeSees) {
    // The engines differ by the grid to which they snap corners, so only at edges.
    const Scene scene = sceneOf({{"", {torus(0.4, 200, 100)}}});
    Sources sources(scene);
    View plain = pinhole({0.3, 2, 2.5}, 256);
    View lens = plain;
    setLens(lens, {{"pinhole"}, intrinsicsOf(plain)});
    const TracedHits a = trace(sources.all, plain), b = trace(sources.all, lens);
    std::size_t other = 0;
    for (std::size_t pixel = 0; pixel < plain.crop.pixels(); ++pixel) {
        if (a.keys(pixel) != b.keys(pixel)) {
            ++other;
            continue;
        }
        const auto x = static_cast<int>(pixel % 256), y = static_cast<int>(pixel / 256);
        const double scale = glm::length(rayOf(plain, glm::dvec2(x, y) + 0.5).direction);
        for (std::uint32_t i = 0; i < a.image.count(pixel); ++i)
            EXPECT_NEAR(a.image.z[a.image.offsets[pixel] + i] * scale,
                        b.image.z[b.image.offsets[pixel] + i], 2e-5);
    }
    EXPECT_LT(other, 20U);
}

TEST(TracedPictures, TheRangeIsAlongTheRay) {
    Sources sources(sceneOf({{"", {icosphere(3)}}}));
    View view = fisheye(64, 180, {0, 0, 3});
    CaptureSettings settings = hitSettings();
    settings.depth_clamp = false;
    const std::uint64_t all = trace(sources.all, view, settings).plan.fragments_counted;
    view.projection.near = 2.9;
    const TracedHits behind = trace(sources.all, view, settings);
    EXPECT_LT(behind.plan.fragments_counted, all);
    for (const float z : behind.image.z)
        EXPECT_GE(z, 2.9F);
    view.projection.near = 0;
    view.projection.far = 2.9;
    EXPECT_EQ(
        trace(sources.all, view, settings).plan.fragments_counted + behind.plan.fragments_counted,
        all);
}

TEST(TracedPictures, AMovingCameraSeesEachRowFromItsPose) {
    // A wall at z = −5. The camera moves from z = 0 to z = −4 along its axis.
    Sources sources(sceneOf({{"", {square(-900, -900, 900, 900, -5)}}}));
    glm::dmat4 end(1);
    end[3] = {0, 0, -4, 1};
    View view;
    view.width = view.height = 64;
    view.crop = {0, 0, 64, 64};
    view.projection.near = 0;
    const LensCamera camera{{"pinhole"}, {40, 40, 31.5, 31.5}};
    const auto still = lensPicture(camera, {64, 64});
    view.rays = shutterPicture(still, {glm::dmat4(1), end}, 64);
    const TracedHits traced = trace(sources.all, view);
    for (int y = 0; y < 64; ++y) {
        const double depth = 5 - 4 * (y + 0.5) / 64;
        const glm::dvec3 direction = still->at({20.5, y + 0.5}).direction;
        const std::size_t pixel = traced.image.pixelIndex(20, y);
        ASSERT_EQ(traced.image.count(pixel), 1U);
        EXPECT_NEAR(traced.image.z[traced.image.offsets[pixel]], depth / -direction.z, 1e-5);
    }
    // A turn by 90° about Y, halfway: 45°.
    const glm::dmat4 turned(0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1);
    const auto turning = shutterPicture(still, {glm::dmat4(1), turned}, 64);
    const glm::dvec3 halfway = turning->at({32, 32}).direction;
    EXPECT_NEAR(halfway.x, -std::sqrt(0.5), 1e-12);
    EXPECT_NEAR(halfway.z, -std::sqrt(0.5), 1e-12);
    EXPECT_NE(turning->text(), view.rays->text());
}

TEST(TracedPictures, TheInsideIsFoundForEachRayOfAMovingCamera) {
    // The camera goes around the torus while it exposes, so triangles are crossed from both sides.
    const Scene scene = sceneOf({{"", {torus(0.3, 60, 30)}}});
    Sources sources(scene);
    std::vector<glm::dmat4> poses;
    for (int i = 0; i <= 8; ++i) {
        const double angle = i * std::numbers::pi / 4;
        const glm::dvec3 eye(4 * std::sin(angle), 1, 4 * std::cos(angle));
        poses.push_back(*lookAlong(eye, -eye, {0, 1, 0}));
    }
    Bundle bundle{"b", {}};
    View& view = bundle.view;
    view.width = view.height = 96;
    view.crop = {0, 0, 96, 96};
    view.projection.near = 0;
    view.rays =
        shutterPicture(lensPicture({{"pinhole"}, {150, 150, 47.5, 47.5}}, {96, 96}), poses, 96);
    const TracedHits traced = trace(sources.all, view);
    const Solids solids(sources.posed);
    std::vector<float> by_winding, by_parity;
    for (const auto& [overlap, values] :
         {std::pair{Overlap::kWinding, &by_winding}, {Overlap::kParity, &by_parity}}) {
        RayMaps maps(sources.posed, &solids, {{RayMap::kThickness}, {}, {}, overlap});
        maps.begin(bundle);
        maps.evaluateRows(bundle, traced.image, 0, 96, *values);
    }
    EXPECT_EQ(by_winding, by_parity);
    EXPECT_GT(*std::ranges::max_element(by_winding), 0.5F);
}

TEST(TracedPictures, RaysOfALensAreRefusedByPictures) {
    Sources sources(sceneOf({{"", {cube()}}}));
    EXPECT_THROW(sources.rasterizer.plan(fisheye(8, 180), hitSettings()), Error);
    EXPECT_THROW(sources.all.plan(fisheye(8, 180), hitSettings(HitMode::kSloped)), Error);
    View flat = parallelView(8, 8);
    EXPECT_THROW(setLens(flat, {{"fisheye"}, {8, 8, 4, 4}}), Error);
}

}  // namespace
}  // namespace peeler::test
