// SPDX-License-Identifier: Apache-2.0
#include "core/capture/gpu_scene.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <vector>

namespace peeler {
namespace {

constexpr int kWidth = 640, kHeight = 360;
const Window kAll{0, 0, kWidth, kHeight};

Box around(const std::vector<glm::vec3>& points) {
    Box box;
    box.add(points);
    return box;
}

TEST(ScreenBounds, OfAUnitSquareAreItsPixelsAndAMargin) {
    const Box box = around({{-0.5F, -0.5F, 0}, {0.5F, 0.25F, 0}});
    const Window bounds = screenBounds(box, glm::dmat4(1), kWidth, kHeight);
    // The square spans -0.5 to 0.5 by -0.5 to 0.25 in NDC; the bounds add a margin of pixels on
    // every side.
    EXPECT_EQ(bounds.y0, 90 - 2 - 1);
    EXPECT_EQ(bounds.x0, 160 - 2 - 1);
    EXPECT_EQ(bounds.x1, 480 + 2 + 1);
    EXPECT_EQ(bounds.y1, 225 + 2 + 1);
}

TEST(ScreenBounds, HoldEveryPointOfTheBoxInFrontOfTheEye) {
    const unsigned seed = std::random_device{}();
    std::printf("seed %u\n", seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> coordinate(-2, 2), share(0, 1);
    const glm::dmat4 projection = glm::perspective(1.0, 16.0 / 9, 0.1, 100.0);
    for (int i = 0; i < 1000; ++i) {
        const auto point = [&] {
            return glm::vec3(coordinate(random), coordinate(random), coordinate(random));
        };
        const Box box = around({point(), point()});
        const glm::dmat4 matrix = projection * glm::translate(glm::dmat4(1), {0, 0, -3}) *
                                  glm::rotate(glm::dmat4(1), double(share(random)), {0, 1, 0});
        const Window bounds = screenBounds(box, matrix, kWidth, kHeight);
        const glm::vec3 inside =
            glm::mix(box.min, box.max, glm::vec3(share(random), share(random), share(random)));
        const glm::dvec4 clip = matrix * glm::dvec4(inside, 1);
        if (clip.w <= 0) continue;
        const double x = (clip.x / clip.w + 1) / 2 * kWidth,
                     y = (clip.y / clip.w + 1) / 2 * kHeight;
        if (x < 0 || y < 0 || x > kWidth || y > kHeight) continue;
        EXPECT_TRUE(x >= bounds.x0 && x <= bounds.x1 && y >= bounds.y0 && y <= bounds.y1)
            << x << ", " << y;
    }
}

TEST(ScreenBounds, AreAllPixelsForABoxAroundTheEye) {
    const glm::dmat4 projection = glm::perspective(1.0, 1.0, 0.1, 100.0);
    EXPECT_EQ(screenBounds(around({{-1, -1, -1}, {1, 1, 1}}), projection, kWidth, kHeight), kAll);
}

TEST(ScreenBounds, AreNoneForABoxBesideThePicture) {
    const glm::dmat4 projection = glm::perspective(1.0, 1.0, 0.1, 100.0);
    EXPECT_TRUE(
        screenBounds(around({{50, 0, -5}, {51, 1, -4}}), projection, kWidth, kHeight).empty());
}

TEST(ScreenBounds, AreNoneForNoPoints) {
    EXPECT_TRUE(screenBounds({}, glm::dmat4(1), kWidth, kHeight).empty());
}

// Near a corner of a huge world, single precision is off by many pixels, so the bounds must grow.
TEST(ScreenBounds, GrowWithWhatSinglePrecisionLoses) {
    const glm::dmat4 far_away = glm::translate(glm::dmat4(1), {-1e7, 0, 0});
    const Box box = around({{1e7F, 0, 0}, {1e7F, 0.01F, 0}});
    const Window bounds = screenBounds(box, far_away, kWidth, kHeight);
    EXPECT_EQ(bounds.x0, 0);
    EXPECT_EQ(bounds.x1, kWidth);
}

}  // namespace
}  // namespace peeler
