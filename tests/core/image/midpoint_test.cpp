// SPDX-License-Identifier: Apache-2.0
// Tests midpoint depths, which lie between the two nearest surfaces.
#include "core/image/statistics.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace peeler::test {
namespace {

std::vector<float> midpointsOf(const std::vector<std::vector<float>>& pixels,
                               const Projection& projection) {
    LayeredImage image;
    image.window = {3, 5, 3 + static_cast<int>(pixels.size()), 6};
    image.offsets = {0};
    for (const auto& pixel : pixels) {
        image.z.insert(image.z.end(), pixel.begin(), pixel.end());
        image.offsets.push_back(static_cast<std::uint32_t>(image.z.size()));
    }
    std::vector<float> result(pixels.size());
    midpoints(image, projection, result);
    return result;
}

constexpr float kNone = std::numeric_limits<float>::infinity();

TEST(Midpoints, LieBetweenTheTwoNearestSurfaces) {
    EXPECT_EQ(midpointsOf({{1, 3, 7}, {}, {2}, {4, 4.5F}}, {}),
              (std::vector<float>{2, kNone, kNone, 4.25F}));
}

TEST(Midpoints, CoincidentSurfacesAreOne) {
    const float almost = 1 + 2e-7F;
    EXPECT_EQ(midpointsOf({{1, 1, 1, 5}, {2, 2}, {1, almost, 3}}, {}),
              (std::vector<float>{3, kNone, 2}));
    // Orthographic depths are rounded relative to the depth range rather than to the depth.
    const Projection box = {.perspective = false, .near = 0, .far = 1000};
    EXPECT_EQ(midpointsOf({{1, 1.001F, 3}, {1, 1.01F, 3}}, box), (std::vector<float>{2, 1.005F}));
}

}  // namespace
}  // namespace peeler::test
