// SPDX-License-Identifier: Apache-2.0
// Tests cameras with calibrated intrinsics: compares projected points with OpenCV's formula.
#include <gtest/gtest.h>

#include <cmath>

#include <peeler/camera_choice.h>
#include <peeler/error.h>
#include "core/scene/framing.h"
#include "core/scene/posed_scene.h"
#include "core/scene/view.h"

namespace peeler {
namespace {

Scene triangleScene() {
    Scene scene;
    scene.scenes = {{"", {0}}};
    scene.nodes.resize(1);
    scene.nodes[0].mesh = 0;
    scene.materials.resize(1);
    Primitive triangle;
    triangle.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
    scene.meshes = {{"", {triangle}}};
    return scene;
}

View viewOf(const CameraChoice& choice) {
    static const Scene scene = triangleScene();
    const PosedScene posed(scene);
    return makeView(posed, SceneExtent(posed), choice);
}

CameraChoice cameraOf(const Intrinsics& intrinsics, const Size& size) {
    CameraChoice choice;
    choice.pose = glm::dmat4(1);
    choice.size = size;
    choice.intrinsics = intrinsics;
    return choice;
}

/// Returns the pixel (centres at whole numbers) of the requested picture that shows a point in
/// front of the camera (x right, y down, z forward).
glm::dvec2 seenAt(const View& view, const glm::dvec3& point) {
    const glm::dvec2 pixel = PixelRays(view).pixel({point.x, -point.y, -point.z});
    return pixel - view.sample - glm::dvec2(view.crop.x0, view.crop.y0);
}

TEST(Intrinsics, PointsAreSeenWhereTheFormulaSays) {
    const Intrinsics cameras[] = {{500, 500, 319.5, 239.5},
                                  {612.3, 587.9, 301.2, 255.75},
                                  {40, 900, 0, 479},
                                  {300, 310, -20.4, 511.9},
                                  {1066.778, 1067.487, 312.9869, 241.3109}};
    for (const Intrinsics& k : cameras) {
        const View view = viewOf(cameraOf(k, {640, 480}));
        EXPECT_EQ(view.crop.width(), 640);
        EXPECT_EQ(view.crop.height(), 480);
        EXPECT_GE(view.crop.x0, 0);
        EXPECT_GE(view.crop.y0, 0);
        EXPECT_LE(view.crop.x1, view.width);
        EXPECT_LE(view.crop.y1, view.height);
        EXPECT_GE(view.sample.x, 0);
        EXPECT_LT(view.sample.x, 1);
        EXPECT_GE(view.sample.y, 0);
        EXPECT_LT(view.sample.y, 1);
        for (const glm::dvec3& point : {glm::dvec3(0.1, 0.2, 1), {-3, 2, 7.5}, {0.4, -0.3, 0.6}}) {
            const glm::dvec2 seen = seenAt(view, point);
            EXPECT_NEAR(seen.x, k.fx * point.x / point.z + k.cx, 1e-9);
            EXPECT_NEAR(seen.y, k.fy * point.y / point.z + k.cy, 1e-9);
        }
    }
}

TEST(Intrinsics, OfAnAxisInTheMiddleAreAFieldOfView) {
    for (const Size size : {Size{640, 480}, Size{641, 479}}) {
        const double f = size.height / 2.0 / std::tan(glm::radians(20.0));
        const View view =
            viewOf(cameraOf({f, f, (size.width - 1) / 2.0, (size.height - 1) / 2.0}, size));
        CameraChoice choice;
        choice.pose = glm::dmat4(1);
        choice.size = size;
        choice.fov = 40;
        const View other = viewOf(choice);
        EXPECT_EQ(view.width, other.width);
        EXPECT_EQ(view.height, other.height);
        EXPECT_EQ(view.crop, other.crop);
        EXPECT_EQ(view.sample, other.sample);
        EXPECT_NEAR(view.projection.half_width, other.projection.half_width, 1e-12);
        EXPECT_NEAR(view.projection.half_height, other.projection.half_height, 1e-12);
        EXPECT_EQ(view.projection.near, other.projection.near);
    }
}

TEST(Intrinsics, OfAViewAreThoseItWasMadeOf) {
    const Intrinsics cameras[] = {
        {500, 500, 319.5, 239.5},  {612.3, 587.9, 301.2, 255.75},
        {40.1, 900.7, 0.1, 479.3}, {300, 1e-3, -20.4, 511.9},
        {0.3, 3e7, -0.49, 1e-3},   {1066.778, 1067.487, 312.9869, 241.3109}};
    for (const Intrinsics& k : cameras) {
        for (const Size size : {Size{640, 480}, Size{641, 479}, Size{1, 1}, Size{1, 3000}}) {
            const View view = viewOf(cameraOf(k, size));
            EXPECT_EQ(intrinsicsOf(view), k);
            CameraChoice part = cameraOf(k, {640, 480});
            part.crop = Window{10, 20, 50, 90};
            const Intrinsics cropped = intrinsicsOf(viewOf(part));
            EXPECT_NEAR(cropped.fx, k.fx, 1e-12 * k.fx);
            EXPECT_NEAR(cropped.cx, k.cx - 10, 1e-12 * 640);
            EXPECT_NEAR(cropped.cy, k.cy - 20, 1e-12 * 640);
        }
    }
    CameraChoice field;
    field.pose = glm::dmat4(1);
    field.size = {640, 480};
    field.fov = 90;
    const Intrinsics k = intrinsicsOf(viewOf(field));
    EXPECT_NEAR(k.fx, 240, 1e-12);
    EXPECT_EQ(k.cx, 319.5);
    EXPECT_EQ(k.cy, 239.5);
    field.fov.reset();
    field.ortho_height = 2;
    EXPECT_THROW(intrinsicsOf(viewOf(field)), Error);
}

TEST(Intrinsics, CropsAreOfThePictureThatIsAskedFor) {
    CameraChoice choice = cameraOf({500, 500, 100.25, 200}, {640, 480});
    const View whole = viewOf(choice);
    choice.crop = Window{10, 20, 50, 90};
    const View part = viewOf(choice);
    EXPECT_EQ(part.width, whole.width);
    EXPECT_EQ(part.crop, (Window{whole.crop.x0 + 10, whole.crop.y0 + 20, whole.crop.x0 + 50,
                                 whole.crop.y0 + 90}));
    choice.crop = Window{600, 0, 641, 10};
    EXPECT_THROW(viewOf(choice), Error);
}

TEST(Poses, ThatAreRigidStayAsTheyAre) {
    // In double precision, rotations are orthonormal only up to rounding. They must not be
    // normalised, because normalisation would change their last bits.
    CameraChoice choice;
    glm::dmat4 pose(1);
    int changed = 0;
    for (int i = 0; i < 100; ++i) {
        const double a = 0.1 * i, b = 0.07 * i;
        pose[0] = {std::cos(a), std::sin(a), 0, 0};
        pose[1] = {-std::sin(a) * std::cos(b), std::cos(a) * std::cos(b), std::sin(b), 0};
        pose[2] = {std::sin(a) * std::sin(b), -std::cos(a) * std::sin(b), std::cos(b), 0};
        choice.pose = pose;
        EXPECT_EQ(viewOf(choice).camera_to_world, pose);
        changed += *rigid(pose) != pose;
    }
    EXPECT_GT(changed, 10);
    pose *= 1.0001;
    pose[3] = {1, 2, 3, 1};
    choice.pose = pose;
    EXPECT_EQ(viewOf(choice).camera_to_world, *rigid(pose));
}

TEST(Intrinsics, WhatCannotBeIsRefused) {
    for (const Intrinsics& k : {Intrinsics{0, 1, 0, 0}, Intrinsics{1, -1, 0, 0},
                                Intrinsics{NAN, 1, 0, 0}, Intrinsics{500, 500, 1e9, 0}}) {
        EXPECT_THROW(viewOf(cameraOf(k, {64, 48})), Error);
    }
    CameraChoice choice = cameraOf({50, 50, 32, 24}, {64, 0});
    EXPECT_THROW(checkCamera(choice), Error);
    choice.size.height = 48;
    EXPECT_NO_THROW(checkCamera(choice));
    choice.fov = 40;
    EXPECT_THROW(checkCamera(choice), Error);
    choice.fov.reset();
    choice.eye = glm::dvec3(1);
    EXPECT_THROW(checkCamera(choice), Error);
    choice.eye.reset();
    choice.pose = glm::dmat4(0);
    EXPECT_THROW(viewOf(choice), Error);
}

}  // namespace
}  // namespace peeler
