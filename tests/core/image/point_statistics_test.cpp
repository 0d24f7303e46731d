// SPDX-License-Identifier: Apache-2.0
#include "core/image/statistics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace peeler {
namespace {

TEST(PointStatistics, OfFourCornersOfAPicture) {
    View view;
    view.width = view.height = 2;
    view.projection.half_width = 2;
    view.projection.half_height = 1;
    view.camera_to_world[3] = {0, 0, 10, 1};
    LayeredImage image;
    image.window = {0, 0, 2, 2};
    image.offsets = {0, 1, 2, 3, 5};
    image.z = {4, 4, 4, 4, 8};
    PointStatistics statistics;
    addPoints(view, image, statistics);
    EXPECT_EQ(statistics.points, 5U);
    EXPECT_EQ(statistics.boxMin(), glm::dvec3(-4, -4, 2));
    EXPECT_EQ(statistics.boxMax(), glm::dvec3(8, 2, 6));
    EXPECT_EQ(statistics.mean(), glm::dvec3(1.6, -0.8, 5.2));
}

TEST(PointStatistics, WhatRoundingLeftIsZero) {
    PointStatistics statistics;
    statistics.add({-1, 1e-17, -0.0});
    statistics.add({1, 1e-17, 1});
    statistics.add({1e-12, 1e-17, 0.5});
    EXPECT_EQ(statistics.mean().x, 0);
    EXPECT_EQ(statistics.boxMin().y, 0);
    EXPECT_FALSE(std::signbit(statistics.boxMin().z));
}

}  // namespace
}  // namespace peeler
