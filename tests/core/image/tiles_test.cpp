// SPDX-License-Identifier: Apache-2.0
#include "core/image/merge.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <random>

#include "core/image/layers.h"
#include "formats/exr/cut_window.h"
#include "support/capture.h"

namespace peeler {
namespace {

TEST(Tiles, GapsAndOverlapsAgreeWithBruteForce) {
    const unsigned seed = std::random_device{}();
    std::printf("seed %u\n", seed);
    std::mt19937 random(seed);
    int with_gap = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        const Window whole{2, 3, 10, 9};
        std::vector<Window> tiles;
        for (unsigned i = 0; i < 1 + random() % 6; ++i) {
            const int x = 2 + static_cast<int>(random() % 8),
                      y = 3 + static_cast<int>(random() % 6);
            tiles.push_back({x == 3 ? 2 : x, y == 4 ? 3 : y, 10 - static_cast<int>(random() % 2),
                             9 - static_cast<int>(random() % 2)});
        }
        int covered_twice = 0, first_empty_row = whole.y1;
        for (int y = whole.y0; y < whole.y1; ++y) {
            for (int x = whole.x0; x < whole.x1; ++x) {
                int tiles_here = 0;
                for (const Window& t : tiles)
                    tiles_here += x >= t.x0 && x < t.x1 && y >= t.y0 && y < t.y1 ? 1 : 0;
                covered_twice += tiles_here > 1 ? 1 : 0;
                if (tiles_here == 0) first_empty_row = std::min(first_empty_row, y);
            }
        }
        const auto gap = findGap(tiles, whole);
        EXPECT_EQ(gap.has_value(), first_empty_row < whole.y1);
        EXPECT_EQ(overlap(tiles), covered_twice > 0);
        if (!gap) continue;
        ++with_gap;
        EXPECT_EQ(gap->y0, first_empty_row);
        EXPECT_FALSE(gap->empty());
        for (const Window& t : tiles)
            EXPECT_TRUE(intersect(t, *gap).empty());
    }
    EXPECT_GT(with_gap, 100);
    EXPECT_LT(with_gap, 1990);
}

class JoinTiles : public testing::Test {
  protected:
    LayeredImage whole_ =
        test::makePicture({.seed = 3, .width = 50, .height = 40, .extra = true}).image;
    const Window windows_[4] = {{0, 0, 20, 25}, {15, 0, 50, 25}, {0, 22, 50, 31}, {0, 31, 50, 40}};

    std::vector<LayeredImage> tiles() const {
        std::vector<LayeredImage> tiles;
        for (const Window& window : windows_)
            tiles.push_back(test::cutWindow(whole_, window));
        return tiles;
    }
};

TEST_F(JoinTiles, GiveTheWholeBack) {
    LayeredImage joined;
    ASSERT_FALSE(joinTiles(tiles(), whole_.window, whole_, joined));
    EXPECT_EQ(test::difference(joined, whole_), "");
    ASSERT_EQ(joined.extra.size(), 2U);
    EXPECT_EQ(joined.extra[0].data, whole_.extra[0].data);
    EXPECT_EQ(joined.extra[1].data, whole_.extra[1].data);
}

TEST_F(JoinTiles, PixelsWithoutATileAreEmpty) {
    const auto all = tiles();
    LayeredImage joined;
    ASSERT_FALSE(joinTiles({all.data(), 2}, whole_.window, whole_, joined));
    for (int y = 0; y < 40; ++y) {
        for (int x = 0; x < 50; ++x) {
            EXPECT_EQ(joined.count(joined.pixelIndex(x, y)),
                      y < 25 ? whole_.count(whole_.pixelIndex(x, y)) : 0);
        }
    }
}

TEST_F(JoinTiles, WhereTheyOverlapTheyMustAgree) {
    auto changed = tiles();
    LayeredImage& tile = changed[2];
    std::size_t pixel = tile.pixelIndex(12, 23);  // a pixel inside both tiles 0 and 2
    while (tile.count(pixel) == 0)
        ++pixel;
    const int x = static_cast<int>(pixel) - 50;  // column of `pixel` in the tile's second row
    ASSERT_LT(x, 20);
    LayeredImage joined;
    tile.extra[1].data[tile.offsets[pixel] * 4U] ^= std::byte{1};
    const auto disagreement = joinTiles(changed, whole_.window, whole_, joined);
    ASSERT_TRUE(disagreement);
    EXPECT_EQ(*disagreement, (Window{x, 23, x + 1, 24}));
}

TEST(MergeByDepth, ElementsOfAPictureAreThePicture) {
    const LayeredImage whole =
        test::makePicture({.seed = 17, .width = 40, .height = 30, .extra = true}).image;
    // Distributes the fragments among three elements. Coincident fragments go to the same element,
    // because merging keeps their order only within an element.
    std::vector<int> owners(whole.fragments());
    for (std::size_t p = 0; p < whole.window.pixels(); ++p) {
        for (std::size_t f = whole.offsets[p]; f < whole.offsets[p + 1]; ++f) {
            const bool coincident = f > whole.offsets[p] && whole.z[f] == whole.z[f - 1];
            owners[f] = coincident ? owners[f - 1] : static_cast<int>((f * 2654435761U >> 7U) % 3);
        }
    }
    std::vector<LayeredImage> elements;
    for (int e = 0; e < 3; ++e) {
        LayeredImage element = whole;
        element.extra.push_back({{"id.object", "id.material"}, PixelType::kUint, {}});
        element.extra.back().data.resize(whole.fragments() * 8);
        const auto ids = element.extra.back().as<std::uint32_t>();
        for (std::size_t f = 0; f < whole.fragments(); ++f)
            ids[2 * f] = static_cast<std::uint32_t>(owners[f]);
        keepObjects(element, {.objects = {{static_cast<std::uint32_t>(e)}, false}});
        element.extra.pop_back();
        EXPECT_GT(element.fragments(), 100U);
        elements.push_back(std::move(element));
    }
    LayeredImage merged;
    mergeByDepth(elements, whole.window, whole, merged);
    EXPECT_EQ(test::difference(merged, whole), "");
    EXPECT_EQ(merged.extra[0].data, whole.extra[0].data);
    EXPECT_EQ(merged.extra[1].data, whole.extra[1].data);
}

TEST(MergeByDepth, AtTheSameDepthTheOrderIsThatOfTheElements) {
    const LayeredImage whole = test::makePicture({.seed = 18, .width = 20, .height = 20}).image;
    const LayeredImage cut = test::cutWindow(whole, {5, 6, 12, 20});
    LayeredImage merged;
    mergeByDepth(std::vector{whole, cut}, whole.window, whole, merged);
    ASSERT_EQ(merged.fragments(), whole.fragments() + cut.fragments());
    for (int y = 0; y < 20; ++y) {
        for (int x = 0; x < 20; ++x) {
            const std::size_t p = whole.pixelIndex(x, y);
            const bool twice = x >= 5 && x < 12 && y >= 6;
            ASSERT_EQ(merged.count(p), whole.count(p) * (twice ? 2 : 1));
            EXPECT_TRUE(std::is_sorted(merged.z.data() + merged.offsets[p],
                                       merged.z.data() + merged.offsets[p + 1]));
        }
    }
    // The first picture has a and a', the second b, all at the same depth. The merged order must be
    // a, a', b.
    LayeredImage a, b;
    a.window = b.window = {0, 0, 1, 1};
    a.offsets = {0, 2};
    b.offsets = {0, 1};
    a.z = {1, 1};
    b.z = {1};
    for (LayeredImage* image : {&a, &b}) {
        image->color = {{"R", "G", "B", "A"}, PixelType::kFloat, {}};
        image->color.data.resize(image->fragments() * 16);
    }
    a.color.as<float>()[0] = 1;
    a.color.as<float>()[4] = 2;
    b.color.as<float>()[0] = 3;
    mergeByDepth(std::vector{a, b}, a.window, a, merged);
    const auto red = merged.color.as<float>();
    EXPECT_EQ(std::vector<float>({red[0], red[4], red[8]}), (std::vector<float>{1, 2, 3}));
}

}  // namespace
}  // namespace peeler
