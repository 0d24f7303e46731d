// SPDX-License-Identifier: Apache-2.0
// Compares the interpolation of keyframes with the formulas of glTF 2.0, appendix C.
#include "core/scene/posed_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace peeler {
namespace {

std::vector<double> sampledAt(const Keyframes& keyframes, double time, std::size_t width,
                              bool rotation = false) {
    std::vector<double> value(width);
    sampleKeyframes(keyframes, time, rotation, value);
    return value;
}

using Values = std::vector<double>;

TEST(Keyframes, GiveExactlyTheirValuesAtTheirTimes) {
    // Most arithmetic would change the last bit of these numbers.
    const Keyframes linear{Interpolation::kLinear, {0.1F, 0.7F, 1.3F}, {0.1F, -0.3F, 7e30F}};
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(sampledAt(linear, double{linear.times[i]}, 1)[0], double{linear.values[i]});
    }
    const Keyframes spline{Interpolation::kCubicSpline,
                           {0.1F, 0.7F},
                           {9, 0.1F, 3, 4, 0.7F, 8}};  // in-tangent, value, out-tangent
    EXPECT_EQ(sampledAt(spline, double{0.1F}, 1)[0], double{0.1F});
    EXPECT_EQ(sampledAt(spline, double{0.7F}, 1)[0], double{0.7F});
    // Rotations in files are rounded to a few digits, so a quaternion's length is not 1. At a
    // keyframe, the quaternion must not be normalised.
    const Keyframes turn{
        Interpolation::kLinear, {0, 1}, {0, 0, 0.7071F, 0.7071F, 0, 0.5F, 0, 0.86F}};
    EXPECT_EQ(sampledAt(turn, 0, 4, true), (Values{0, 0, double{0.7071F}, double{0.7071F}}));
    EXPECT_EQ(sampledAt(turn, 1, 4, true), (Values{0, 0.5, 0, double{0.86F}}));
}

TEST(Keyframes, StandStillBeforeTheFirstAndAfterTheLast) {
    for (const Interpolation kind :
         {Interpolation::kStep, Interpolation::kLinear, Interpolation::kCubicSpline}) {
        const bool cubic = kind == Interpolation::kCubicSpline;
        const Keyframes keys{
            kind, {1, 2}, cubic ? std::vector<float>{5, 3, 5, 5, 4, 5} : std::vector<float>{3, 4}};
        EXPECT_EQ(sampledAt(keys, -10, 1)[0], 3);
        EXPECT_EQ(sampledAt(keys, 0.999, 1)[0], 3);
        EXPECT_EQ(sampledAt(keys, 2.001, 1)[0], 4);
        EXPECT_EQ(sampledAt(keys, 1e9, 1)[0], 4);
    }
    const Keyframes single{Interpolation::kCubicSpline, {1}, {5, 3, 5}};
    for (const double time : {0.0, 1.0, 2.0})
        EXPECT_EQ(sampledAt(single, time, 1)[0], 3);
}

TEST(Keyframes, StepHoldsTheValueUntilTheNextKey) {
    const Keyframes keys{Interpolation::kStep, {0, 1, 2}, {10, 20, 30}};
    EXPECT_EQ(sampledAt(keys, 0.999999, 1)[0], 10);
    EXPECT_EQ(sampledAt(keys, 1, 1)[0], 20);
    EXPECT_EQ(sampledAt(keys, 1.5, 1)[0], 20);
    EXPECT_EQ(sampledAt(keys, 2, 1)[0], 30);
}

TEST(Keyframes, AreMetByFramesWhoseTimesAreNoFloats) {
    Keyframes keys{Interpolation::kStep, {}, {}};
    for (int frame = 0; frame < 200; ++frame) {
        keys.times.push_back(static_cast<float>(frame / 24.0));
        keys.values.push_back(static_cast<float>(frame));
    }
    for (int frame = 0; frame < 200; ++frame)
        EXPECT_EQ(sampledAt(keys, frame / 24.0, 1)[0], frame);
}

TEST(Keyframes, LinearDividesTheDistance) {
    const Keyframes keys{Interpolation::kLinear, {2, 6}, {0, 10, 100, 4, 20, -100}};
    const Values third = sampledAt(keys, 3, 3);
    EXPECT_DOUBLE_EQ(third[0], 1);
    EXPECT_DOUBLE_EQ(third[1], 12.5);
    EXPECT_DOUBLE_EQ(third[2], 50);
}

/// Returns the quaternion (x, y, z, w) of a rotation about Z.
std::vector<float> turned(double degrees, float sign = 1) {
    const double half = degrees * std::numbers::pi / 360;
    return {0, 0, sign * static_cast<float>(std::sin(half)),
            sign * static_cast<float>(std::cos(half))};
}

TEST(Keyframes, RotationsTurnEvenlyAlongTheShorterArc) {
    // A quaternion and its negative describe the same rotation.
    for (const float sign : {1.0F, -1.0F}) {
        Keyframes keys{Interpolation::kLinear, {0, 1}, turned(20)};
        const auto second = turned(110, sign);
        keys.values.insert(keys.values.end(), second.begin(), second.end());
        for (const double u : {0.1, 0.25, 0.5, 0.9}) {
            const Values q = sampledAt(keys, u, 4, true);
            const double degrees = 2 * std::atan2(q[2], q[3]) * 180 / std::numbers::pi;
            EXPECT_NEAR(degrees, 20 + 90 * u, 1e-4) << sign << ' ' << u;
            EXPECT_NEAR(std::hypot(q[2], q[3]), 1, 1e-12);
        }
    }
}

TEST(Keyframes, CubicSplineIsTheHermiteFormula) {
    const double t0 = 0.5, t1 = 3, p0 = -1, out0 = 2, in1 = -0.75, p1 = 4;
    const Keyframes keys{Interpolation::kCubicSpline,
                         {0.5F, 3},
                         {99, -1, 2, -0.75F, 4, 99}};  // the outermost tangents have no effect
    for (const double t : {0.625, 1.0, 1.75, 2.875}) {
        const double td = t1 - t0, u = (t - t0) / td;
        const double expected = (2 * std::pow(u, 3) - 3 * std::pow(u, 2) + 1) * p0 +
                                td * (std::pow(u, 3) - 2 * std::pow(u, 2) + u) * out0 +
                                (-2 * std::pow(u, 3) + 3 * std::pow(u, 2)) * p1 +
                                td * (std::pow(u, 3) - std::pow(u, 2)) * in1;
        EXPECT_NEAR(sampledAt(keys, t, 1)[0], expected, 1e-12) << t;
    }
    // A cubic spline with the tangents 2x is exactly the parabola x².
    const Keyframes square{Interpolation::kCubicSpline, {1, 3}, {0, 1, 2, 6, 9, 0}};
    for (const double t : {1.25, 2.0, 2.5})
        EXPECT_NEAR(sampledAt(square, t, 1)[0], t * t, 1e-12);
}

TEST(Keyframes, OfTheSameTimeTheLaterCounts) {
    const Keyframes keys{Interpolation::kLinear, {0, 1, 1, 2}, {0, 1, 5, 6}};
    EXPECT_NEAR(sampledAt(keys, 0.999999, 1)[0], 1, 1e-5);
    EXPECT_EQ(sampledAt(keys, 1, 1)[0], 5);
    EXPECT_DOUBLE_EQ(sampledAt(keys, 1.5, 1)[0], 5.5);
}

TEST(Animation, LastsUntilItsLastKey) {
    Animation animation;
    EXPECT_EQ(durationOf(animation), 0);
    animation.keyframes = {{Interpolation::kStep, {0, 2.5F}, {0, 0}},
                           {Interpolation::kStep, {1}, {0}}};
    EXPECT_EQ(durationOf(animation), 2.5);
}

}  // namespace
}  // namespace peeler
