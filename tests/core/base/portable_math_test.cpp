// SPDX-License-Identifier: Apache-2.0
// Tests the portable trigonometric functions against the C library's with more digits.
#include "core/base/portable_math.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace peeler::test {
namespace {

/// Returns the error in units in the last place of the exact value.
double errorOf(double value, long double exact) {
    const double nearest = std::abs(static_cast<double>(exact));
    const double unit = std::nextafter(nearest, HUGE_VAL) - nearest;
    return static_cast<double>(std::abs(value - exact)) / unit;
}

TEST(PortableMath, ErrorsAreBelowTheDocumentedUnits) {
    std::mt19937_64 random(1);
    double sine = 0, cosine = 0, tangent = 0, arc = 0;
    for (int i = 0; i < 200'000; ++i) {
        const double span = i % 2 ? 7 : 1e4;
        const double angle = std::uniform_real_distribution<>(-span, span)(random);
        const SinCos both = portableSinCos(angle);
        sine = std::max(sine, errorOf(both.sin, std::sin(static_cast<long double>(angle))));
        cosine = std::max(cosine, errorOf(both.cos, std::cos(static_cast<long double>(angle))));
        if (std::abs(angle) < 1.5)
            tangent = std::max(
                tangent, errorOf(portableTan(angle), std::tan(static_cast<long double>(angle))));
        std::uniform_real_distribution<> side(-1, 1);
        const double y = side(random), x = side(random) * std::exp2(20 * side(random));
        arc = std::max(arc, errorOf(portableAtan2(y, x), std::atan2(static_cast<long double>(y),
                                                                    static_cast<long double>(x))));
    }
    EXPECT_LT(sine, 1);
    EXPECT_LT(cosine, 1);
    EXPECT_LT(tangent, 2);
    EXPECT_LT(arc, 2);
}

TEST(PortableMath, SpecialAngles) {
    EXPECT_EQ(portableSinCos(0).sin, 0);
    EXPECT_EQ(portableSinCos(0).cos, 1);
    EXPECT_EQ(portableAtan2(0, 0), 0);
    EXPECT_EQ(portableAtan2(0, 1), 0);
    EXPECT_EQ(portableAtan2(0, -1), std::numbers::pi);
    EXPECT_EQ(portableAtan2(1, 0), std::numbers::pi / 2);
    EXPECT_EQ(portableAtan2(-1, 0), -std::numbers::pi / 2);
    EXPECT_EQ(portableAtan2(1, 1), std::numbers::pi / 4);
    EXPECT_EQ(portableAtan2(-1, 1), -std::numbers::pi / 4);
}

}  // namespace
}  // namespace peeler::test
