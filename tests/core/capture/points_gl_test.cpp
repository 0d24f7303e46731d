// SPDX-License-Identifier: Apache-2.0
// Tests points of several pixels: they are squares around their centres, identical in every pass of
// every method.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include <peeler/error.h>
#include "support/capture.h"
#include "support/method_names.h"
#include "support/one_mesh.h"

namespace peeler::test {
namespace {

Scene pointScene(const std::vector<glm::vec3>& positions) {
    Primitive points;
    points.topology = Topology::kPoints;
    points.positions = positions;
    return oneMesh({points});
}

CaptureSettings sized(int size) {
    CaptureSettings settings;
    settings.point_size = size;
    return settings;
}

/// A view with odd sides, so that the optical axis passes through the middle pixel.
const View kView = testView(41, 31);

TEST(Points, CoverASquareAroundWhereTheyAre) {
    for (const int size : {1, 3, 5, 9}) {
        const LayeredImage image = capture(pointScene({{0, 0, -2}}), kView, sized(size)).image;
        ASSERT_EQ(image.fragments(), static_cast<std::uint64_t>(size * size));
        for (int y = 0; y < 31; ++y)
            for (int x = 0; x < 41; ++x)
                EXPECT_EQ(image.count(static_cast<std::size_t>(y * 41 + x)),
                          std::abs(x - 20) <= size / 2 && std::abs(y - 15) <= size / 2 ? 1U : 0U);
        for (const float z : image.z)
            EXPECT_FLOAT_EQ(z, 2);
    }
}

TEST(Points, AreTheSameInEveryMethodBandAndStrip) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> unit(-1, 1);
    std::vector<glm::vec3> positions;
    for (int i = 0; i < 200; ++i)
        positions.emplace_back(unit(random), unit(random), unit(random) - 2.5F);
    const Scene scene = pointScene(positions);
    const CaptureSettings settings = sized(5);
    const LayeredImage whole = capture(scene, kView, settings).image;
    EXPECT_GT(whole.fragments(), 2000U);
    for (const std::string& method : methodNames(true)) {
        CaptureSettings other = settings;
        other.method = method;
        EXPECT_EQ(difference(capture(scene, kView, other).image, whole), "") << method;
    }
    CaptureSettings banded = settings;
    banded.band_bytes = 1 << 14;
    EXPECT_EQ(difference(capture(scene, kView, banded).image, whole), "");
    std::uint64_t fragments = 0;
    // The squares of points in other strips reach into this strip.
    for (int y = 0; y < 31; y += 7) {
        View strip = kView;
        strip.crop = {0, y, 41, std::min(y + 7, 31)};
        fragments += capture(scene, strip, settings).image.fragments();
    }
    EXPECT_EQ(fragments, whole.fragments());
}

TEST(Points, LargerThanTheDriverHasAreRefused) {
    const int most = sharedContext().device().limits.point_size;
    EXPECT_GE(most, 3);
    try {
        capture(pointScene({{0, 0, -2}}), kView, sized(most + 1));
        ADD_FAILURE() << "nothing was thrown";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_EQ(error.where(), "`point_size` " + std::to_string(most + 1));
    }
}

}  // namespace
}  // namespace peeler::test
