// SPDX-License-Identifier: Apache-2.0
#include "core/scene/view.h"

#include <gtest/gtest.h>

#include <cmath>

namespace peeler {
namespace {

double depthOf(const glm::dmat4& matrix, double distance) {
    const glm::dvec4 clip = matrix * glm::dvec4(0, 0, -distance, 1);
    return clip.z / clip.w;
}

TEST(Projection, DepthIsReversedAndLinearZInvertsIt) {
    Projection finite, infinite, parallel;
    finite.near = infinite.near = 0.25;
    finite.far = 80;
    parallel.perspective = false;
    parallel.near = -3;
    parallel.far = 17;
    for (const Projection& p : {finite, infinite, parallel}) {
        EXPECT_NEAR(depthOf(p.matrix(), p.near), 1, 1e-12);
        const double at_far = depthOf(p.matrix(), std::isfinite(p.far) ? p.far : 1e15);
        EXPECT_NEAR(at_far, 0, 1e-12);
        double previous = 2;
        for (double z = std::max(p.near, 0.3); z < 16; z *= 1.3) {
            const double depth = depthOf(p.matrix(), z);
            EXPECT_LT(depth, previous);
            EXPECT_NEAR(p.linearZ(depth), z, 1e-9 * z);
            previous = depth;
        }
    }
}

TEST(Projection, SubRectanglesAreThePartsOfTheWhole) {
    for (const bool perspective : {true, false}) {
        Projection p;
        p.perspective = perspective;
        p.half_width = 0.9;
        p.half_height = 0.6;
        p.far = 50;
        const double u0 = 0.25, v0 = 0.5, u1 = 0.75, v1 = 0.625;
        const glm::dvec4 point(0.37, -0.21, -1.7, 1);
        const glm::dvec4 whole = p.matrix() * point, part = p.matrix(u0, v0, u1, v1) * point;
        const double u = 0.5 + 0.5 * whole.x / whole.w, v = 0.5 - 0.5 * whole.y / whole.w;
        EXPECT_NEAR(0.5 + 0.5 * part.x / part.w, (u - u0) / (u1 - u0), 1e-12);
        EXPECT_NEAR(0.5 - 0.5 * part.y / part.w, (v - v0) / (v1 - v0), 1e-12);
        EXPECT_NEAR(part.z / part.w, whole.z / whole.w, 1e-15);
    }
}

TEST(WorldPosition, LiesOnTheRayOfThePixel) {
    View view;
    view.width = 40;
    view.height = 20;
    view.projection.half_width = 2;
    view.projection.half_height = 1;
    // The camera is at (10, 20, 30) and looks along the world's +X; the camera's +X is the world's
    // +Z.
    view.camera_to_world = {{0, 0, 1, 0}, {0, 1, 0, 0}, {-1, 0, 0, 0}, {10, 20, 30, 1}};
    const auto expectPoint = [&](double x, double y, double z, const glm::dvec3& expected) {
        const glm::dvec3 point = worldPosition(view, x, y, z);
        for (int i = 0; i < 3; ++i)
            EXPECT_NEAR(point[i], expected[i], 1e-12);
    };
    expectPoint(20, 10, 5, {15, 20, 30});
    expectPoint(40, 0, 5, {15, 25, 40});  // the upper right corner
    expectPoint(10, 15, 1, {11, 19.5, 29});
    view.projection.perspective = false;
    expectPoint(40, 0, 5, {15, 21, 32});
}

/// worldPosition() is the inverse of the clip matrix: it returns each point from its projected
/// pixel and depth.
TEST(WorldPosition, InvertsTheClipMatrix) {
    for (const bool perspective : {true, false}) {
        View view;
        view.projection.perspective = perspective;
        view.projection.half_width = 0.8;
        view.projection.half_height = 0.45;
        view.projection.far = 100;
        view.camera_to_world = {
            {0.36, 0.48, -0.8, 0}, {-0.8, 0.6, 0, 0}, {0.48, 0.64, 0.6, 0}, {-3, 2, 7, 1}};
        const glm::dvec3 point(-4.1, 1.2, 4.3);
        const glm::dvec4 in_camera = glm::inverse(view.camera_to_world) * glm::dvec4(point, 1);
        const glm::dvec4 clip = view.projection.matrix() * in_camera;
        const glm::dvec3 back =
            worldPosition(view, (0.5 + 0.5 * clip.x / clip.w) * view.width,
                          (0.5 - 0.5 * clip.y / clip.w) * view.height, -in_camera.z);
        for (int i = 0; i < 3; ++i)
            EXPECT_NEAR(back[i], point[i], 1e-12);
    }
}

TEST(Rigid, HowFarAMatrixIsFromIt) {
    glm::dmat4 matrix(1);
    matrix[3] = {5, 6, 7, 1};
    EXPECT_EQ(distanceFromRigid(matrix), 0);
    matrix[1] = {0, 1.5, 0, 0};
    EXPECT_EQ(distanceFromRigid(matrix), 1.25);  // 1.5² − 1
    matrix[1] = {0.25, 1, 0, 0};
    EXPECT_EQ(distanceFromRigid(matrix), 0.25);
    matrix[1] = {0, -1, 0, 0};
    EXPECT_EQ(distanceFromRigid(matrix), 2);  // a mirroring matrix
    for (int column = 0; column < 3; ++column) {
        for (int row = 0; row < 3; ++row) {
            glm::dmat4 broken(1);
            broken[column][row] = NAN;
            EXPECT_FALSE(distanceFromRigid(broken) < 1e9);
            broken[column][row] = INFINITY;
            EXPECT_FALSE(distanceFromRigid(broken) < 1e9);
        }
    }
}

TEST(Rigid, ViewsAreHoweverSteep) {
    int steep = 0;
    for (double slant = 1e-7; slant < 3; slant *= 1.01) {
        const auto view = lookAlong({1, 2, 3}, {0.3, -0.8, 0.5 + slant}, {0.3, -0.8, 0.5});
        if (!view) continue;
        ++steep;
        EXPECT_LT(distanceFromRigid(*view), kRigidByRounding) << slant;
        EXPECT_LT(distanceFromRigid(*rigid(*view)), kRigidByRounding) << slant;
    }
    EXPECT_GT(steep, 1000);
}

}  // namespace
}  // namespace peeler
