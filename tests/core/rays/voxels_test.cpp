// SPDX-License-Identifier: Apache-2.0
// Tests voxel votes along three axes, and the report of rays that do not leave every solid that
// they enter.
#include "core/rays/voxels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <random>
#include <vector>

#include "core/base/parallel.h"
#include "core/rays/solids.h"
#include "support/ray_hits.h"

namespace peeler::test {
namespace {

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

/// Returns the votes of all cells, in the order (x · cells.y + y) · cells.z + z.
std::vector<std::uint8_t> votesOf(const VoxelVotes& votes, const AxisBundles& axes) {
    std::vector<std::uint8_t> all, plane(static_cast<std::size_t>(axes.cells.y * axes.cells.z));
    for (int x = 0; x < axes.cells.x; ++x) {
        votes.votesAt(x, plane);
        all.insert(all.end(), plane.begin(), plane.end());
    }
    return all;
}

/// Returns random hits of one to four solids. Some solids have an odd number of hits, some hits
/// coincide, and some are outside the lattice.
LayeredImage randomHits(const Bundle& bundle, double length, std::mt19937& random) {
    std::uniform_int_distribution<int> places(-4, 40), counts(0, 9), solids(0, 3);
    return rayHits(bundle, [&](const glm::dvec3&, const glm::dvec3&) {
        std::vector<Hit> hits(static_cast<std::size_t>(counts(random)));
        const int last = solids(random);
        for (Hit& hit : hits) {
            hit.t = length * places(random) / 36;
            hit.key = keyOf(std::min(solids(random), last));
        }
        return hits;
    });
}

/// Adds the votes of a bundle cell by cell. A cell's centre is inside a solid if an odd number of
/// the solid's hits lie in front of the centre, unless the last of these hits is unpaired.
void addVotes(const AxisBundles& axes, std::size_t axis, const LayeredImage& hits,
              std::vector<std::uint8_t>& votes) {
    const Bundle& bundle = axes.bundles[axis];
    const auto keys = hits.extra[0].as<std::uint32_t>();
    for (int py = 0; py < bundle.view.height; ++py) {
        for (int px = 0; px < bundle.view.width; ++px) {
            const std::size_t pixel = hits.pixelIndex(px, py);
            const glm::dvec3 start =
                (worldPosition(bundle.view, px + 0.5, py + 0.5, 0) - axes.corner) / axes.spacing;
            const int along = static_cast<int>(axis);
            for (int c = 0; c < axes.cells[along]; ++c) {
                bool inside = false;
                for (int solid = 0; solid < 4; ++solid) {
                    int before = 0, all = 0;
                    for (std::uint32_t i = hits.offsets[pixel]; i < hits.offsets[pixel + 1]; ++i) {
                        if (keys[i] != keyOf(solid)) continue;
                        ++all;
                        before += start[along] + hits.z[i] / axes.spacing <= c + 0.5 ? 1 : 0;
                    }
                    inside |= before % 2 == 1 && before < all;
                }
                glm::ivec3 cell(glm::floor(start));
                cell[along] = c;
                const int at = (cell.x * axes.cells.y + cell.y) * axes.cells.z + cell.z;
                if (inside) ++votes.at(static_cast<std::size_t>(at));
            }
        }
    }
}

class Voxels : public testing::Test {
  protected:
    /// Returns the lattice over a box with three different sides.
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
    votes.finish();
    const std::vector<std::uint8_t> found = votesOf(votes, axes);
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
                if (found[i] != (expected ? 3 : 0)) ++wrong;
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
        // Along this axis, the exits (the second half of the hits) are removed, so no ray leaves a
        // solid.
        if (axis == 1) {
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
    right.finish();
    holed.finish();
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
    votes.finish();
    EXPECT_EQ(std::ranges::max(votesOf(votes, axes)), 3);
    EXPECT_EQ(votes.disputed(), 0U);
}

TEST_F(Voxels, RandomHitsAreCountedAsCellByCell) {
    const Scene scene = bodies(4);
    const PosedScene shown(scene);
    const Solids solids(shown);
    std::mt19937 random(7);
    // Lines of cells take less than a 64-bit word, exactly one word, slightly more than one, or
    // more than two. Some lattices are one cell wide.
    for (const glm::ivec3& cells :
         {glm::ivec3(7, 10, 20), {5, 20, 64}, {20, 3, 65}, {2, 9, 150}, {1, 70, 3}, {30, 1, 1}}) {
        const glm::dvec3 corner(-0.3, 0.2, 1.1);
        const Bounds box{corner, corner + 0.13 * (glm::dvec3(cells) - 0.01)};
        RayGrid grid;
        grid.spacing = 0.13;
        const AxisBundles axes = axisBundles(box, box, grid);
        ASSERT_EQ(axes.cells, cells);
        std::vector<LayeredImage> hits;
        std::vector<std::uint8_t> expected(VoxelVotes::cellsOf(axes));
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double length = axes.spacing * axes.cells[static_cast<int>(axis)];
            hits.push_back(randomHits(axes.bundles[axis], length, random));
            addVotes(axes, axis, hits[axis], expected);
        }
        const auto count = [&](auto&& which) {
            return static_cast<std::uint64_t>(std::ranges::count_if(expected, which));
        };
        const std::uint64_t inside = count([](int v) { return v >= 2; });
        const std::uint64_t disputed = count([](int v) { return v == 1 || v == 2; });
        for (const int threads : {1, 3}) {
            setThreadCount(threads);
            VoxelVotes votes(axes, solids);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const Bundle& bundle = axes.bundles[axis];
                for (int y = 0; y < bundle.view.height; y += 13)
                    votes.add(axis, bundle,
                              rowsOf(hits[axis], y, std::min(y + 13, bundle.view.height)));
            }
            votes.finish();
            setThreadCount(0);
            EXPECT_EQ(votesOf(votes, axes), expected)
                << cells.x << " " << cells.y << " " << cells.z << ", " << threads;
            EXPECT_EQ(votes.occupied(), inside);
            EXPECT_EQ(votes.disputed(), disputed);
            std::vector<std::uint8_t> plane(static_cast<std::size_t>(cells.y * cells.z));
            std::size_t i = 0, wrong = 0;
            for (int x = 0; x < cells.x; ++x) {
                votes.insideAt(x, plane);
                for (const std::uint8_t one : plane)
                    wrong += one == (expected[i++] >= 2 ? 1 : 0) ? 0 : 1;
            }
            EXPECT_EQ(wrong, 0U);
        }
    }
}

TEST_F(Voxels, OddRaysAreCountedBySolid) {
    Bundle bundle = lattice(40).bundles[2];
    // The second sphere has no exit where x > 0.
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
    EXPECT_EQ(parity.oddRays(), pixels);  // in two bundles, half of the rays are odd
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
