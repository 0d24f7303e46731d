// SPDX-License-Identifier: Apache-2.0
// Tests cameras around a scene, and around a normalised scene.
#include "core/views/many_cameras.h"

#include <gtest/gtest.h>

#include <cmath>

#include <peeler/error.h>
#include "tests/support/capture.h"

namespace peeler {
namespace {

/// Returns a scene whose bounds are the box from (1, 2, 3) to (3, 8, 7), with the centre (2, 5, 5).
Scene boxScene() {
    Scene scene;
    scene.scenes.resize(1);
    scene.materials.resize(1);
    Primitive primitive;
    primitive.positions = {{1, 2, 3}, {3, 2, 3}, {3, 8, 7}};
    primitive.indices = {0, 1, 2};
    scene.meshes.resize(1);
    scene.meshes[0].primitives = {primitive};
    scene.nodes.resize(1);
    scene.nodes[0].mesh = 0;
    scene.scenes[0].roots = {0};
    return scene;
}

constexpr glm::dvec3 kMiddle{2, 5, 5};

std::vector<CameraChoice> around(const ViewsAround& asked) {
    const Scene scene = boxScene();
    return viewsAround(asked, SceneExtent(PosedScene(scene)));
}

TEST(ManyCameras, LookAtTheMiddleFromOneDistance) {
    for (const Around place :
         {Around::kSphere, Around::kHemisphere, Around::kOrbit, Around::kRandom}) {
        const auto cameras =
            around({.count = 23, .around = place, .distance = 7, .size = {300, 200}});
        ASSERT_EQ(cameras.size(), 23U);
        for (const CameraChoice& camera : cameras) {
            const glm::dmat4& pose = *camera.pose;
            EXPECT_NEAR(glm::distance(glm::dvec3(pose[3]), kMiddle), 7, 1e-12);
            const glm::dvec3 seen = glm::dvec3(pose[3]) - 7.0 * glm::dvec3(pose[2]);
            EXPECT_NEAR(glm::distance(seen, kMiddle), 0, 1e-12);
            EXPECT_GE(pose[1].y, 0) << "+Y is up";
            EXPECT_NEAR(pose[0].y, 0, 1e-12) << "the horizon is level";
            EXPECT_EQ(camera.size, (Size{300, 200}));
            // The half angle of 20° spans half of 200 pixels, so tan(20°) · fy = 100.
            EXPECT_NEAR(camera.intrinsics->fy, 100 / std::tan(glm::radians(20.0)), 1e-9);
            EXPECT_EQ(camera.intrinsics->fx, camera.intrinsics->fy);
            EXPECT_EQ(camera.intrinsics->cx, 149.5);
            EXPECT_EQ(camera.intrinsics->cy, 99.5);
            if (place == Around::kHemisphere) {
                EXPECT_GT(pose[3].y, kMiddle.y);
            }
            if (place == Around::kOrbit) {
                EXPECT_NEAR(pose[3].y - kMiddle.y, 3.5, 1e-12);  // the height is sin(30°) · 7
            }
        }
    }
}

TEST(ManyCameras, SeeASphereAroundTheScene) {
    const double radius = std::sqrt(4.0 + 36 + 16) / 2;
    for (const Size size : {Size{400, 200}, Size{200, 400}}) {
        const auto camera = around({.count = 1, .fov = 50, .size = size}).front();
        const double half =
            std::tan(glm::radians(25.0)) * std::min(1.0, 1.0 * size.width / size.height);
        const double distance = glm::distance(glm::dvec3((*camera.pose)[3]), kMiddle);
        EXPECT_NEAR(radius / distance, std::sin(std::atan(half * 0.9)), 1e-12);
    }
}

TEST(ManyCameras, CirclesHaveABeginningAHeightAndADirection) {
    for (const bool clockwise : {false, true}) {
        const auto cameras = around({.count = 4,
                                     .around = Around::kOrbit,
                                     .distance = 2,
                                     .elevation = -60,
                                     .azimuth = 90,
                                     .clockwise = clockwise,
                                     .size = {8, 8}});
        const double low = -2 * std::sin(glm::radians(60.0)), near = 1;
        const auto offset = [&](std::size_t i) {
            return glm::dvec3((*cameras[i].pose)[3]) - kMiddle;
        };
        EXPECT_NEAR(glm::distance(offset(0), {near, low, 0}), 0, 1e-12);
        EXPECT_NEAR(glm::distance(offset(1), {0, low, clockwise ? near : -near}), 0, 1e-12);
    }
}

/// The least margins of all pictures, as shares of the picture's sides.
struct Margins {
    double left = 1, right = 1, top = 1, bottom = 1;
};

Margins marginsOf(const Scene& scene, const std::vector<CameraChoice>& cameras) {
    Margins least;
    for (const CameraChoice& camera : cameras) {
        const glm::dmat4 to_camera = glm::inverse(*camera.pose);
        for (const glm::vec3& position : scene.meshes[0].primitives[0].positions) {
            const glm::dvec3 p(to_camera * glm::dvec4(position, 1));
            const Intrinsics& lens = *camera.intrinsics;
            const double u = (lens.fx * p.x / -p.z + lens.cx + 0.5) / camera.size.width;
            const double v = (lens.fy * p.y / p.z + lens.cy + 0.5) / camera.size.height;
            least = {std::min(least.left, u), std::min(least.right, 1 - u), std::min(least.top, v),
                     std::min(least.bottom, 1 - v)};
        }
    }
    return least;
}

/// On a turntable, the margins over the whole turn are 5 % of the limiting side, and equal on
/// opposite sides. The distance does not depend on the number of views.
TEST(ManyCameras, ATurntableIsAsNearAsTheWholeTurnAllows) {
    const Scene scene = boxScene();
    for (const Size size : {Size{400, 200}, Size{200, 800}}) {
        for (const double elevation : {0.0, 20.0, -50.0, 89.0}) {
            ViewsAround asked{.count = 1440,
                              .around = Around::kTurntable,
                              .elevation = elevation,
                              .azimuth = 10,
                              .size = size};
            const auto cameras = around(asked);
            const Margins margins = marginsOf(scene, cameras);
            EXPECT_NEAR(std::min(margins.left, margins.top), 0.05, 1e-4) << elevation;
            EXPECT_NEAR(margins.left, margins.right, 1e-4) << elevation;
            EXPECT_NEAR(margins.top, margins.bottom, 1e-4) << elevation;
            asked.count = 1;
            EXPECT_EQ(around(asked).front().pose, cameras.front().pose);
        }
    }
}

/// A moving scene is framed by its bounding boxes over all times.
TEST(ManyCameras, ATurntableOfAMovingSceneFramesItsBounds) {
    const Scene scene = boxScene();
    const auto cameras =
        viewsAround({.count = 360, .around = Around::kTurntable, .size = {300, 200}},
                    SceneExtent(scene, 0, {}));
    Scene box = scene;
    auto& positions = box.meshes[0].primitives[0].positions;
    for (int i = 0; i < 8; ++i)
        positions.emplace_back(i & 1 ? 1 : 3, i & 2 ? 2 : 8, i & 4 ? 3 : 7);
    const Margins margins = marginsOf(box, cameras);
    EXPECT_NEAR(std::min(margins.left, margins.top), 0.05, 1e-4);
}

TEST(ManyCameras, LookThroughCornersIfAsked) {
    const Scene scene = boxScene();
    const PosedScene posed(scene);
    const auto cameras = around({.through_corners = true, .size = {300, 200}});
    EXPECT_EQ(cameras[0].intrinsics->cx, 150);
    EXPECT_EQ(cameras[0].intrinsics->cy, 100);
    const View view = makeView(posed, SceneExtent(posed), cameras[0]);
    EXPECT_EQ(intrinsicsOf(view), *cameras[0].intrinsics);
}

TEST(ManyCameras, ChanceHasASeed) {
    const ViewsAround asked{.count = 4, .around = Around::kRandom, .size = {8, 8}};
    ViewsAround other = asked;
    other.seed = 1;
    EXPECT_EQ(around(asked).back().pose, around(asked).back().pose);
    EXPECT_NE(around(asked).back().pose, around(other).back().pose);
    // The C++ standard defines mt19937_64 exactly, so the first value for seed 0 is the same on all
    // platforms.
    EXPECT_NEAR(((*around(asked).front().pose)[3].y - kMiddle.y) /
                    glm::distance(glm::dvec3((*around(asked).front().pose)[3]), kMiddle),
                2 * (2947667278772165694ULL >> 11U) * 0x1p-53 - 1, 1e-12);
}

TEST(ManyCameras, SidesAreAllSeenAlike) {
    // The mean direction is 0 over a sphere, and (0, 1/2, 0) over its upper half.
    for (const auto& [place, mean] :
         {std::pair{Around::kSphere, 0.0}, {Around::kHemisphere, 0.5}}) {
        glm::dvec3 sum(0);
        for (const CameraChoice& camera :
             around({.count = 1000, .around = place, .distance = 1, .size = {8, 8}}))
            sum += glm::dvec3((*camera.pose)[3]) - kMiddle;
        EXPECT_NEAR(glm::distance(sum / 1000.0, {0, mean, 0}), 0, 2e-3);
    }
}

TEST(ManyCameras, NormalizeBringsToOneSize) {
    Scene scene = boxScene();
    for (const Normalized to : {Normalized::kUnitCube, Normalized::kUnitSphere}) {
        const Normalizing found = normalizing(PosedScene(scene), to);
        EXPECT_EQ(found.middle, kMiddle);
        Scene moved = scene;
        moved.scenes[0].to_world = found.matrix();
        const Bounds bounds = *PosedScene(moved).bounds();
        EXPECT_NEAR(glm::length(bounds.min + bounds.max), 0, 1e-12);
        const double longest = to == Normalized::kUnitCube ? 1 : 2 * 3 / std::sqrt(1.0 + 9 + 4);
        EXPECT_NEAR(bounds.max.y - bounds.min.y, longest, 1e-12);
    }
    scene.meshes[0].primitives[0].positions.assign(3, glm::vec3(4));
    EXPECT_THROW(normalizing(PosedScene(scene), Normalized::kUnitCube), Error);
}

}  // namespace
}  // namespace peeler
