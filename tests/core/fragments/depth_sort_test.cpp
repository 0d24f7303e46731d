// SPDX-License-Identifier: Apache-2.0
#include "core/fragments/depth_sort.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdio>
#include <numeric>
#include <random>
#include <tuple>

#include "core/image/composite.h"
#include "formats/exr/synthetic_image.h"

namespace peeler {
namespace {

TEST(Gather, SortsByDepthThenKeyThenPlaceAndKeepsTheNearest) {
    const unsigned seed = std::random_device{}();
    std::printf("seed %u\n", seed);
    std::mt19937 random(seed);
    const Window window{0, 0, 31, 17};
    for (const std::uint32_t limit : {0U, 3U}) {
        std::vector<std::uint32_t> first{0};
        for (std::size_t p = 0; p < window.pixels(); ++p)
            first.push_back(first.back() +
                            (p % 50 == 0 ? 120U : static_cast<std::uint32_t>(random() % 9)));
        const std::size_t n = first.back();
        std::vector<float> depth(n);
        std::vector<std::uint32_t> primitive(n);
        std::vector<std::uint64_t> color(n);
        std::iota(primitive.begin(), primitive.end(), 1U);
        for (std::size_t p = 0; p < window.pixels(); ++p)
            std::shuffle(primitive.begin() + first[p], primitive.begin() + first[p + 1], random);
        for (std::uint32_t& key : primitive)
            key /= 4;  // some keys are equal
        for (std::size_t i = 0; i < n; ++i) {
            // Only five different depths, so that many coincide.
            depth[i] = 0.1F + 0.1F * static_cast<float>(random() % 5);
            color[i] = i;
        }
        LayeredImage image;
        image.window = window;
        image.color.channels = {"R", "G", "B", "A"};
        image.color.type = PixelType::kHalf;
        Projection projection;
        std::vector<std::uint32_t> words;
        for (std::size_t i = 0; i < n; ++i) {
            words.insert(words.end(), {std::bit_cast<std::uint32_t>(depth[i]), primitive[i],
                                       static_cast<std::uint32_t>(color[i]), 0});
        }
        depthSort({first, words.data(), 4}, projection, limit, image);

        const auto colors = image.color.as<std::uint64_t>();
        for (std::size_t p = 0; p < window.pixels(); ++p) {
            std::vector<std::size_t> order;
            for (std::size_t i = first[p]; i < first[p + 1]; ++i)
                order.push_back(i);
            std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
                return depth[a] != depth[b] ? depth[a] > depth[b] : primitive[a] < primitive[b];
            });
            if (limit) order.resize(std::min<std::size_t>(order.size(), limit));
            ASSERT_EQ(image.count(p), order.size());
            for (std::size_t k = 0; k < order.size(); ++k) {
                EXPECT_EQ(colors[image.offsets[p] + k], order[k]);
                EXPECT_EQ(image.z[image.offsets[p] + k],
                          static_cast<float>(projection.linearZ(double(depth[order[k]]))));
            }
        }
    }
}

/// Lists of fragments with random colours, many of them at the same depth. Colours are half or
/// float, with or without per-channel opacity.
struct Captured {
    Captured(const Window& window, PixelType type, bool tinted, std::mt19937& random) {
        std::uniform_real_distribution<float> component(0, 1);
        for (std::size_t p = 0; p < window.pixels(); ++p) {
            first.push_back(first.back() + static_cast<std::uint32_t>(random() % 9));
            for (std::uint32_t i = first[p]; i < first[p + 1]; ++i) {
                const float depth = 0.1F + 0.1F * static_cast<float>(random() % 5);
                words.insert(words.end(), {std::bit_cast<std::uint32_t>(depth), i});
                FragmentArray color{colorNames(tinted), type, {}};
                // The eighth number is padding, not an opacity.
                for (int c = 0; c < (tinted ? 8 : 4); ++c)
                    test::appendColor(color, component(random));
                const auto stored = color.as<std::uint32_t>();
                words.insert(words.end(), stored.begin(), stored.end());
            }
        }
    }

    std::vector<std::uint32_t> first{0}, words{};
};

TEST(Gather, CompositesWhatTheListsComposite) {
    const unsigned seed = std::random_device{}();
    std::printf("seed %u\n", seed);
    std::mt19937 random(seed);
    const Window window{3, 5, 40, 24};
    for (const auto& [type, tinted, stride] : {std::tuple(PixelType::kHalf, false, std::size_t{4}),
                                               {PixelType::kFloat, false, 6},
                                               {PixelType::kHalf, true, 6},
                                               {PixelType::kFloat, true, 10}}) {
        const Captured captured(window, type, tinted, random);
        const CapturedFragments fragments{captured.first, captured.words.data(), stride};
        for (const std::uint32_t layers : {0U, 1U, 3U}) {
            for (const Tail tail : {Tail::kDrop, Tail::kBlend}) {
                LayeredImage lists;
                lists.window = window;
                lists.color = {colorNames(tinted), type, {}};
                depthSort(fragments, {}, 0, lists);
                CompositeImage expected, found;
                compositeNearest(lists, layers, tail, expected);
                found.window = window;
                const FragmentArray like{colorNames(tinted), type, {}};
                depthSortComposite(fragments, {}, layers, tail, like, found);
                EXPECT_EQ(found.rgba, expected.rgba);
                EXPECT_EQ(found.opacity, expected.opacity);
                EXPECT_EQ(found.tinted(), tinted);
                EXPECT_EQ(found.z, expected.z);
            }
        }
    }
}

}  // namespace
}  // namespace peeler
