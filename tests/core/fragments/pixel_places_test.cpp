// SPDX-License-Identifier: Apache-2.0
#include "core/fragments/pixel_places.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "core/fragments/supersampling.h"

namespace peeler::test {
namespace {

using Places = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

Places placesOf(const SampleKeys& keys) {
    Places places;
    forEachPlace(
        keys, [&](std::uint32_t key, std::uint32_t samples) { places.emplace_back(key, samples); });
    EXPECT_EQ(numberOfPlaces(keys), places.size());
    return places;
}

TEST(PixelPlaces, EachTriangleHasOneWithItsSamples) {
    EXPECT_EQ(placesOf({0, 0, 0, 0}), Places{});
    EXPECT_EQ(placesOf({7, 7, 7, 7}), (Places{{7, 0b1111}}));
    EXPECT_EQ(placesOf({0, 7, 0, 7}), (Places{{7, 0b1010}}));
    EXPECT_EQ(placesOf({9, 7, 9, 0}), (Places{{9, 0b0101}, {7, 0b0010}}));
    EXPECT_EQ(placesOf({4, 3, 2, 1}), (Places{{4, 1}, {3, 2}, {2, 4}, {1, 8}}));
}

TEST(PixelPlaces, AreShadedAtTheMeanOfTheirSamples) {
    const auto positions = samplePositions(kPixelSamples);
    for (std::size_t i = 0; i < positions.size(); ++i)
        EXPECT_EQ(centroid(1U << i, positions), positions[i]);
    EXPECT_EQ(centroid(0b0011, positions), 0.5 * (positions[0] + positions[1]));
    EXPECT_EQ(centroid(0b1111, positions), glm::dvec2(0.5));
}

}  // namespace
}  // namespace peeler::test
