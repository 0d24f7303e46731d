// SPDX-License-Identifier: Apache-2.0
// Tests links between fragments of the same surface, in scenes with known links.
#include "core/views/surface_cells.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/fragment_lists.h"

namespace peeler::test {
namespace {

/// Returns an orthographic view with pixels of one unit, so that a plane's step in Z from pixel to
/// pixel is its slope.
View unitView(int width, int height) {
    View view;
    view.width = width;
    view.height = height;
    view.crop = {0, 0, width, height};
    view.projection = {false, width / 2.0, height / 2.0, 0, 1000};
    return view;
}

/// Returns the fragment in the neighbouring pixel on this side that continues the k-th fragment of
/// (x, y), as an index into the list of the neighbouring pixel; −1 = none.
int placeOfNext(const LayeredImage& image, const SurfaceLinks& links, int x, int y, int k,
                Side side) {
    const std::uint32_t next =
        links[image.offsets[image.pixelIndex(x, y)] + static_cast<std::uint32_t>(k)][side];
    if (next == kNoFragment) return -1;
    const int dx = side == kRight ? 1 : side == kLeft ? -1 : 0;
    const int dy = side == kDown ? 1 : side == kUp ? -1 : 0;
    return static_cast<int>(next - image.offsets[image.pixelIndex(x + dx, y + dy)]);
}

TEST(SurfaceLinks, SurfacesOnDifferentLayersStayThemselves) {
    // A plane is on layer 1 behind a square, and on layer 0 next to it.
    const auto covered = [](int x) { return x >= 3 && x < 6; };
    const LayeredImage image = fragmentLists({0, 0, 9, 2}, [&](int x, int) {
        std::vector<TestFragment> list;
        if (covered(x)) list.push_back({10, {}});
        list.push_back({50, {}});
        return list;
    });
    const SurfaceLinks links = linkSurfaces(image, unitView(9, 2));
    for (int x = 0; x + 1 < 9; ++x) {
        EXPECT_EQ(placeOfNext(image, links, x, 0, covered(x), kRight), covered(x + 1)) << x;
        if (!covered(x)) continue;
        EXPECT_EQ(placeOfNext(image, links, x, 0, 0, kRight), x < 5 ? 0 : -1);
    }
}

TEST(SurfaceLinks, ParallelSurfacesCloserThanTheirStep) {
    // For a fragment of the back surface, the nearest depth in the next pixel is that of the front
    // surface, so depth alone would give wrong links.
    const LayeredImage image = fragmentLists({0, 0, 8, 3}, [](int x, int) {
        const float z = 10 + 3.0F * static_cast<float>(x);
        return std::vector<TestFragment>{{z, {}}, {z + 2, {}}};
    });
    const SurfaceLinks links = linkSurfaces(image, unitView(8, 3));
    for (int x = 0; x + 1 < 8; ++x)
        for (const int k : {0, 1})
            EXPECT_EQ(placeOfNext(image, links, x, 1, k, kRight), k) << x;
}

TEST(SurfaceLinks, CoincidentSurfacesKeepTheirOrder) {
    const LayeredImage image = fragmentLists({0, 0, 4, 4}, [](int x, int y) {
        const float z = 10 + 0.5F * static_cast<float>(x + y);
        return std::vector<TestFragment>(3, {z, {}});
    });
    const SurfaceLinks links = linkSurfaces(image, unitView(4, 4));
    for (const int k : {0, 1, 2}) {
        EXPECT_EQ(placeOfNext(image, links, 1, 1, k, kRight), k);
        EXPECT_EQ(placeOfNext(image, links, 1, 1, k, kUp), k);
    }
}

TEST(SurfaceLinks, AStepIsAnEdgeUnlessTheSurfaceGoesOnLikeThat) {
    const auto linked = [](std::vector<float> depths) {
        const int width = static_cast<int>(depths.size());
        const LayeredImage image = fragmentLists({0, 0, width, 1}, [&](int x, int) {
            return std::vector<TestFragment>{{depths[static_cast<std::size_t>(x)], {}}};
        });
        const SurfaceLinks links = linkSurfaces(image, unitView(width, 1));
        std::string text;
        for (int x = 0; x + 1 < width; ++x)
            text += placeOfNext(image, links, x, 0, 0, kRight) < 0 ? '|' : '-';
        return text;
    };
    EXPECT_EQ(linked({10, 10, 10, 18, 18, 18}), "--|--");
    EXPECT_EQ(linked({10, 18, 26, 34}), "---") << "a steep plane";
    EXPECT_EQ(linked({10, 11, 13, 16, 20}), "----") << "a curved surface";
    EXPECT_EQ(linked({10, 60, 110}), "||") << "too steep to be seen";
}

TEST(SurfaceLinks, ObjectsAreNotLinkedToOneAnother) {
    LayeredImage image = fragmentLists({0, 0, 4, 1}, [](int, int) {
        return std::vector<TestFragment>{{10, {}}};
    });
    FragmentArray ids{{"id.material", "id.object"}, PixelType::kUint, {}};
    // Pairs of a material id and an object id.
    const std::array<std::uint32_t, 8> values = {7, 1, 8, 1, 7, 2, 7, 2};
    const auto bytes = std::as_bytes(std::span(values));
    ids.data.assign(bytes.begin(), bytes.end());
    image.extra.push_back(ids);
    const SurfaceLinks links = linkSurfaces(image, unitView(4, 1));
    EXPECT_EQ(placeOfNext(image, links, 0, 0, 0, kRight), 0);
    EXPECT_EQ(placeOfNext(image, links, 1, 0, 0, kRight), -1);
    EXPECT_EQ(placeOfNext(image, links, 2, 0, 0, kRight), 0);
}

TEST(SurfaceLinks, DepthsThatAreNoneHaveNoLinks) {
    const float nan = std::nanf(""), inf = HUGE_VALF;
    View view = unitView(6, 1);
    view.projection.perspective = true;
    const std::array<float, 6> depths = {nan, inf, 0, -1, 1e-40F, 2};
    const LayeredImage image = fragmentLists({0, 0, 6, 1}, [&](int x, int) {
        return std::vector<TestFragment>{{depths[static_cast<std::size_t>(x)], {}}};
    });
    for (const auto& sides : linkSurfaces(image, view))
        for (const std::uint32_t side : sides)
            EXPECT_EQ(side, kNoFragment);
}

TEST(SurfaceCells, APlanesCornersAreThePlanesAndShared) {
    // In perspective, a plane is linear in 1/Z, so corners are exact even at the border.
    View view = unitView(16, 12);
    view.projection = {true, 0.8, 0.6, 0.1};
    const auto inverse = [](double x, double y) { return 0.2 + 0.003 * x - 0.004 * y; };
    const LayeredImage image = fragmentLists(view.crop, [&](int x, int y) {
        return std::vector<TestFragment>{{static_cast<float>(1 / inverse(x + 0.5, y + 0.5)), {}}};
    });
    const SurfaceCells cells = surfaceCells(image, view);
    for (int y = 0; y < 12; ++y) {
        for (int x = 0; x < 16; ++x) {
            const std::size_t here = image.pixelIndex(x, y);
            for (std::size_t c = 0; c < kCorners; ++c) {
                EXPECT_NEAR(cells.corners[here][c],
                            inverse(x + 0.5 + kCornerOffsets[c][0], y + 0.5 + kCornerOffsets[c][1]),
                            1e-7);
            }
            if (x == 0 || y == 0) continue;
            EXPECT_EQ(cells.corners[here][kUpperLeft],
                      cells.corners[image.pixelIndex(x - 1, y)][kUpperRight]);
            EXPECT_EQ(cells.corners[here][kUpperLeft],
                      cells.corners[image.pixelIndex(x - 1, y - 1)][kLowerRight]);
        }
    }
}

}  // namespace
}  // namespace peeler::test
