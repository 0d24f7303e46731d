// SPDX-License-Identifier: Apache-2.0
#include "core/view.h"

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

}  // namespace
}  // namespace peeler
