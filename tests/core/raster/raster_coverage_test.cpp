// SPDX-License-Identifier: Apache-2.0
// Compares the coverage of rays by triangles with ray-by-ray tests in integers that cannot
// overflow.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "core/raster/corner_grid.h"
#include "core/raster/hit_rasterizer.h"
#include "support/closed_meshes.h"
#include "support/one_mesh.h"
#include "support/traced_hits.h"

namespace peeler::test {
namespace {

__extension__ using Wide = __int128;

/// The textbook top-left rule: (x, y) is covered if it is inside all three edges. A point on a left
/// or top edge counts as inside. Corners may be in any order; y is down.
bool covers(std::array<SnappedCorner, 3> corner, std::int64_t x, std::int64_t y) {
    const auto side = [](const SnappedCorner& a, const SnappedCorner& b, Wide px, Wide py) {
        return (Wide{b.x} - a.x) * (py - a.y) - (Wide{b.y} - a.y) * (px - a.x);
    };
    const Wide area = side(corner[0], corner[1], corner[2].x, corner[2].y);
    if (area == 0) return false;
    if (area < 0) std::swap(corner[1], corner[2]);
    for (std::size_t i = 0; i < 3; ++i) {
        const SnappedCorner& a = corner[i];
        const SnappedCorner& b = corner[(i + 1) % 3];
        const Wide at = side(a, b, x, y);
        // The order is clockwise on screen, so left edges go up and top edges go right.
        const bool left = b.y < a.y, top = b.y == a.y && b.x > a.x;
        if (at < 0 || (at == 0 && !left && !top)) return false;
    }
    return true;
}

using Positions = std::vector<glm::vec3>;

Scene triangleScene(const Positions& positions) {
    Primitive primitive;
    primitive.positions = positions;
    return oneMesh({primitive});
}

/// Compares every ray. Returns the number of hits.
std::size_t compareAllRays(const Positions& positions, const View& view) {
    const Scene scene = triangleScene(positions);
    HitRasterizer source{PosedScene(scene)};
    const TracedHits traced = trace(source, view);
    const CornerGrid grid(view);
    const CornerPlacement placement(view, grid, glm::dmat4(1));
    std::vector<SnappedCorner> corners(positions.size());
    placement.snap(positions, corners.data());
    for (const SnappedCorner& corner : corners)
        EXPECT_GE(corner.x, 0) << "such a triangle would be cut";
    for (int y = view.crop.y0; y < view.crop.y1; ++y) {
        for (int x = view.crop.x0; x < view.crop.x1; ++x) {
            std::vector<std::uint32_t> expected;
            for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
                if (covers({corners[i], corners[i + 1], corners[i + 2]},
                           (std::int64_t{x} + grid.origin().x) << grid.bits(),
                           (std::int64_t{y} + grid.origin().y) << grid.bits()))
                    expected.push_back(static_cast<std::uint32_t>(i / 3 + 1));
            }
            std::vector<std::uint32_t> found = traced.keys(traced.image.pixelIndex(x, y));
            std::sort(found.begin(), found.end());
            EXPECT_EQ(found, expected) << "ray " << x << ", " << y;
        }
    }
    EXPECT_EQ(traced.plan.fragments_counted, traced.image.fragments());
    return traced.image.fragments();
}

/// Random triangles with many special cases.
class HardTriangles {
  public:
    explicit HardTriangles(unsigned seed) : random_(seed) {}

    Positions make() {
        positions_.clear();
        while (positions_.size() < 3 * 24) {
            switch (random_() % 7) {
                case 0:
                    fan();
                    break;
                case 1:
                    sliver();
                    break;
                case 2:
                    again();
                    break;
                case 3:
                    junction();
                    break;
                case 4:
                    add(throughRays(), throughRays(), throughRays());
                    break;
                case 5:
                    tiny();
                    break;
                default:
                    add(anywhere(), anywhere(), anywhere());
            }
        }
        return positions_;
    }

  private:
    static constexpr int kSide = 20;

    float share() { return std::uniform_real_distribution<float>(0, 1)(random_); }
    float depth() { return -1 - 50 * share(); }
    glm::vec3 anywhere() {
        return {kSide * (1.4F * share() - 0.2F), -kSide * (1.4F * share() - 0.2F), depth()};
    }
    /// Returns a corner whose coordinates are those of a ray, or differ by one grid step.
    glm::vec3 throughRays() {
        const auto at = [&] {
            const int step = random_() % 3 == 0 ? static_cast<int>(random_() % 3) - 1 : 0;
            return static_cast<float>(random_() % kSide) + 0.5F +
                   static_cast<float>(step) / 65536.0F;
        };
        return {at(), -at(), depth()};
    }
    glm::vec3 corner() { return random_() % 2 ? anywhere() : throughRays(); }
    void add(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
        positions_.insert(positions_.end(), {a, b, c});
    }

    /// Adds a fan of triangles with random orientations around a corner. All its inner edges are
    /// shared.
    void fan() {
        const glm::vec3 middle = corner();
        std::vector<glm::vec3> rim(3 + random_() % 4);
        for (glm::vec3& at : rim)
            at = corner();
        for (std::size_t i = 0; i < rim.size(); ++i) {
            const glm::vec3 &a = rim[i], &b = rim[(i + 1) % rim.size()];
            random_() % 2 ? add(middle, a, b) : add(b, a, middle);
        }
    }
    void sliver() {
        const glm::vec3 a = corner(), b = corner();
        const glm::vec3 off(1e-5F * share(), 1e-5F * share(), 0);
        add(a, b, random_() % 2 ? b + off : 0.5F * (a + b) + off);
    }
    void again() {
        if (positions_.empty()) return;
        const std::size_t i = random_() % (positions_.size() / 3) * 3;
        const Positions was(positions_);
        add(was[i + random_() % 3], was[i + 1], was[i + 2]);
    }
    /// Adds triangles with a T-junction: a corner in the middle of another triangle's edge.
    void junction() {
        const glm::vec3 a = corner(), b = corner(), c = corner(), d = corner();
        const glm::vec3 middle = 0.5F * (a + b);
        add(a, b, c);
        add(middle, a, d);
        add(b, middle, d);
    }
    void tiny() {
        const glm::vec3 a = corner();
        const auto beside = [&] {
            return a + glm::vec3(share() - 0.5F, share() - 0.5F, share()) *
                           (random_() % 2 ? 1.5F : 1e-4F);
        };
        const glm::vec3 b = beside();
        add(a, b, beside());
    }

    std::mt19937 random_;
    Positions positions_;
};

TEST(RasterCoverage, EveryRayOfHardTrianglesIsTheSameInWideIntegers) {
    std::size_t hits = 0;
    for (unsigned seed = 0; seed < 200; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        View view = parallelView(20, 20);
        if (seed % 4 == 1) view.crop = {3, 5, 17, 11};
        if (seed % 4 == 2) view.sample = {0.25, 0.875};
        hits += compareAllRays(HardTriangles(seed).make(), view);
        if (testing::Test::HasFailure()) return;
    }
    EXPECT_GT(hits, 100000U);
}

TEST(RasterCoverage, OfHugePicturesTheGridIsCoarserAndStillExact) {
    View view = parallelView(65536, 65536);
    EXPECT_EQ(CornerGrid(view).bits(), 14);
    view.crop = {65500, 65500, 65536, 65536};
    Positions positions = {{-30000, 30000, -1},       {98000, -65500, -1}, {65530, -98000, -1},
                           {65500.3F, -65500.7F, -2}, {65540, -65520, -2}, {65511, -65541, -2}};
    EXPECT_GT(compareAllRays(positions, view), 100U);
    for (const auto& [side, bits] : {std::pair{1, 16}, {1920, 16}, {16384, 16}, {16385, 15}})
        EXPECT_EQ(CornerGrid(parallelView(side, 1)).bits(), bits) << side;
}

/// Every ray within a quad of two triangles must hit the quad exactly once, for either diagonal.
TEST(RasterCoverage, SharedEdgesAreHitOnce) {
    const View view = parallelView(16, 16);
    for (const bool turned : {false, true}) {
        // The corners and the diagonal lie exactly on rays.
        const glm::vec3 a(2.5F, -2.5F, -1), b(12.5F, -2.5F, -1), c(12.5F, -12.5F, -1),
            d(2.5F, -12.5F, -1);
        const Positions positions =
            turned ? Positions{a, b, c, a, c, d} : Positions{b, a, d, b, d, c};
        const Scene scene = triangleScene(positions);
        HitRasterizer source{PosedScene(scene)};
        const TracedHits traced = trace(source, view);
        for (int y = 0; y < 16; ++y)
            for (int x = 0; x < 16; ++x)
                EXPECT_EQ(traced.image.count(traced.image.pixelIndex(x, y)),
                          x >= 2 && x < 12 && y >= 2 && y < 12 ? 1U : 0U)
                    << x << ", " << y;
    }
}

}  // namespace
}  // namespace peeler::test
