// SPDX-License-Identifier: Apache-2.0
#include "core/base/hypotenuse.h"

#include <gtest/gtest.h>

#include <limits>

namespace peeler {
namespace {

TEST(Hypotenuse, RightTriangles) {
    EXPECT_EQ(hypotenuse(3, 4), 5);
    EXPECT_EQ(hypotenuse(-8, 15), 17);
    EXPECT_EQ(hypotenuse(0, -7), 7);
    EXPECT_EQ(hypotenuse(0, 0), 0);
    EXPECT_EQ(hypotenuse(1e-30, 1), 1);
    EXPECT_EQ(hypotenuse(std::numeric_limits<double>::infinity(), 1),
              std::numeric_limits<double>::infinity());
}

TEST(Hypotenuse, SameBitsOnEveryMachine) {
    EXPECT_EQ(hypotenuse(0.74, 0.32), 0x1.9cc99ff02c48p-1);  // glibc on arm64: …481p-1
}

}  // namespace
}  // namespace peeler
