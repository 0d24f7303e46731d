// SPDX-License-Identifier: Apache-2.0
// What three axes say of cells, and rays that do not leave what they enter.
#include "core/rays/voxels.h"

#include <gtest/gtest.h>

#include <numbers>

#include "core/rays/solids.h"
#include "support/ray_hits.h"

namespace peeler::test {
namespace {

/// Rows [y0, y1) of a picture.
LayeredImage rowsOf(const LayeredImage& image, int y0, int y1) {
    LayeredImage band;
    band.window = {image.window.x0, y0, image.window.x1, y1};
    const std::size_t first = image.pixelIndex(image.window.x0, y0);
    const std::uint32_t begin = image.offsets[first];
    for (std::size_t p = 0; p <= band.window.pixels(); ++p)
        band.offsets.push_back(image.offsets[first + p] - begin);
    const std::uint32_t end = begin + band.offsets.back();
    band.z.assign(image.z.begin() + begin, image.z.begin() + end);
    const auto keys = image.extra[0].as<std::uint32_t>().subspan(begin, end - begin);
    const auto bytes = std::as_bytes(keys);
    band.extra.push_back({{kKeyChannel}, PixelType::kUint, {bytes.begin(), bytes.end()}});
    return band;
}

class Voxels : public testing::Test {
  protected:
    /// The lattice over a box that is not a cube.
    static AxisBundles lattice(int resolution) {
        const Bounds box{{-1.5, -1.25, -1}, {1.5, 1.25, 1.75}};
        return axisBundles(box, box, {resolution});
    }

    Scene scene_ = bodies(2);
    PosedScene shown_{scene_};
    Solids solids_{shown_};
};

TEST_F(Voxels, CellsOfSpheresAreThoseWhoseCentresAreInside) {
    const std::vector<Sphere> spheres = {{{0.1, 0.05, 0.2}, 0.8}, {{-0.9, -0.7, -0.5}, 0.35}};
    const AxisBundles axes = lattice(60);
    ASSERT_NE(axes.cells.x, axes.cells.y);
    ASSERT_NE(axes.cells.y, axes.cells.z);
    VoxelVotes votes(axes, solids_);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const Bundle& bundle = axes.bundles[axis];
        const LayeredImage hits = sphereHits(bundle, spheres);
        for (int y = 0; y < bundle.view.height; y += 7)
            votes.add(axis, bundle, rowsOf(hits, y, std::min(y + 7, bundle.view.height)));
    }
    ASSERT_EQ(votes.votes().size(), VoxelVotes::cellsOf(axes));
    std::size_t i = 0, wrong = 0, inside = 0;
    for (int x = 0; x < axes.cells.x; ++x) {
        for (int y = 0; y < axes.cells.y; ++y) {
            for (int z = 0; z < axes.cells.z; ++z, ++i) {
                const glm::dvec3 p = axes.corner + axes.spacing * (glm::dvec3(x, y, z) + 0.5);
                bool expected = false, unsure = false;
                for (const Sphere& s : spheres) {
                    const double beyond = glm::distance(p, s.center) - s.radius;
                    expected |= beyond < 0;
                    unsure |= std::abs(beyond) < 1e-5;
                }
                if (unsure) continue;
                if (votes.votes()[i] != (expected ? 3 : 0)) ++wrong;
                inside += expected;
            }
        }
    }
    EXPECT_EQ(wrong, 0U);
    EXPECT_EQ(votes.occupied(), inside);
    EXPECT_EQ(votes.disputed(), 0U);
    const double volume = double(inside) * std::pow(axes.spacing, 3);
    const double expected = 4 * std::numbers::pi / 3 * (std::pow(0.8, 3) + std::pow(0.35, 3));
    EXPECT_NEAR(volume / expected, 1, 0.01);
}

TEST_F(Voxels, AnAxisThatIsMisledIsOutvoted) {
    const AxisBundles axes = lattice(40);
    const std::vector<Sphere> spheres = {{{0, 0, 0.3}, 0.9}};
    VoxelVotes right(axes, solids_), holed(axes, solids_);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        LayeredImage hits = sphereHits(axes.bundles[axis], spheres);
        right.add(axis, axes.bundles[axis], hits);
        if (axis == 1) {  // no ray leaves: the upper half is missing
            const LayeredImage all = hits;
            std::vector<std::uint32_t> keys;
            hits.z.clear();
            hits.offsets = {0};
            for (std::size_t p = 0; p < all.window.pixels(); ++p) {
                if (all.count(p) > 0) {
                    hits.z.push_back(all.z[all.offsets[p]]);
                    keys.push_back(keyOf(0));
                }
                hits.offsets.push_back(static_cast<std::uint32_t>(keys.size()));
            }
            const auto bytes = std::as_bytes(std::span(keys));
            hits.extra[0].data.assign(bytes.begin(), bytes.end());
        }
        holed.add(axis, axes.bundles[axis], hits);
    }
    EXPECT_GT(right.occupied(), 1000U);
    EXPECT_EQ(holed.occupied(), right.occupied());
    EXPECT_EQ(holed.disputed(), right.occupied());
}

TEST_F(Voxels, SolidsThatOverlapCountOnce) {
    const AxisBundles axes = lattice(20);
    VoxelVotes votes(axes, solids_);
    for (std::size_t axis = 0; axis < 3; ++axis)
        votes.add(axis, axes.bundles[axis],
                  sphereHits(axes.bundles[axis], {{{}, 0.9}, {{0.1, 0, 0}, 0.5}}));
    EXPECT_EQ(std::ranges::max(votes.votes()), 3);
    EXPECT_EQ(votes.disputed(), 0U);
}

TEST_F(Voxels, OddRaysAreCountedBySolid) {
    Bundle bundle = lattice(40).bundles[2];
    // The second sphere cannot be left where x > 0.
    const auto hits = [&](const glm::dvec3& start, const glm::dvec3&) {
        std::vector<Hit> found = {{1, keyOf(0)}, {2, keyOf(0)}, {3, keyOf(1)}};
        if (!(start.x > 0)) found.push_back({4, keyOf(1)});
        return found;
    };
    const LayeredImage image = rayHits(bundle, hits);
    Parity parity(solids_);
    EXPECT_TRUE(parity.holds());
    const int height = bundle.view.height, half = height / 3;
    parity.add(0, rowsOf(image, 0, half));
    parity.add(0, rowsOf(image, half, height));
    parity.add(1, image);
    EXPECT_FALSE(parity.holds());
    const auto pixels = static_cast<std::uint64_t>(image.window.pixels());
    EXPECT_EQ(parity.oddRays(), pixels);  // half of both bundles
    ASSERT_EQ(parity.solids().size(), 2U);
    EXPECT_EQ(parity.solids().at(0).rays, 2 * pixels);
    EXPECT_EQ(parity.solids().at(0).odd, 0U);
    EXPECT_TRUE(parity.solids().at(0).first.empty());
    const SolidParity& second = parity.solids().at(1);
    EXPECT_EQ(second.rays, 2 * pixels);
    EXPECT_EQ(second.odd, pixels);
    ASSERT_EQ(second.first.size(), Parity::kKept);
    for (std::size_t i = 0; i < Parity::kKept; ++i) {
        const glm::dvec3 start =
            worldPosition(bundle.view, second.first[i].x + 0.5, second.first[i].y + 0.5, 0);
        EXPECT_EQ(second.first[i].bundle, 0U);
        EXPECT_EQ(second.first[i].y, 0);
        EXPECT_GT(start.x, 0);
    }
}

}  // namespace
}  // namespace peeler::test
