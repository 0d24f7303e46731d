// SPDX-License-Identifier: Apache-2.0
#include "core/image/layers.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <random>

namespace peeler {
namespace {

TEST(DepthComplexity, AgreesWithBruteForceOnRandomCounts) {
    const unsigned seed = std::random_device{}();
    std::printf("seed %u\n", seed);
    std::mt19937 random(seed);
    for (int trial = 0; trial < 200; ++trial) {
        const Window crop{3, 5, 3 + 1 + static_cast<int>(random() % 20),
                          5 + 1 + static_cast<int>(random() % 9)};
        const std::uint32_t limit = random() % 3 ? 0 : 1 + random() % 4;
        std::vector<std::uint32_t> counts(crop.pixels());
        for (auto& c : counts)
            c = random() % 3 ? 0 : random() % 8;

        DepthComplexity complexity(crop);
        std::vector<LayerPlan> expected;
        std::uint64_t counted = 0, stored = 0;
        const auto width = static_cast<std::size_t>(crop.width());
        for (int y = crop.y0; y < crop.y1; ++y) {
            const std::uint32_t* row =
                counts.data() + static_cast<std::size_t>(y - crop.y0) * width;
            // Rows may arrive in parts and in any order: here the right part comes first.
            const std::size_t left = random() % (width + 1);
            complexity.addRow(crop.x0 + static_cast<int>(left), y, {row + left, width - left});
            complexity.addRow(crop.x0, y, {row, left});
            std::uint64_t row_total = 0;
            for (int x = crop.x0; x < crop.x1; ++x) {
                const std::uint32_t count = row[x - crop.x0];
                const std::uint32_t kept = limit ? std::min(count, limit) : count;
                row_total += count;
                stored += kept;
                if (kept > expected.size()) expected.resize(kept);
                for (std::uint32_t k = 0; k < kept; ++k) {
                    expected[k].data_window = unite(expected[k].data_window, {x, y, x + 1, y + 1});
                    ++expected[k].pixels;
                }
            }
            counted += row_total;
            EXPECT_EQ(complexity.rowFragments(y), row_total);
        }
        const auto layers = complexity.layers(limit);
        ASSERT_EQ(layers.size(), expected.size());
        for (std::size_t k = 0; k < layers.size(); ++k) {
            EXPECT_EQ(layers[k].data_window, expected[k].data_window) << k;
            EXPECT_EQ(layers[k].pixels, expected[k].pixels) << k;
        }
        for (int rows = 0; rows < 12; ++rows) {
            std::uint64_t most = 0;
            for (int y0 = crop.y0; y0 < crop.y1; ++y0) {
                std::uint64_t sum = 0;
                for (int y = y0; y < std::min(y0 + rows, crop.y1); ++y)
                    sum += complexity.rowFragments(y);
                most = std::max(most, sum);
            }
            EXPECT_EQ(complexity.mostFragments(rows), most);
        }
        EXPECT_EQ(complexity.counted(), counted);
        std::uint64_t in_layers = 0;
        for (const LayerPlan& layer : layers)
            in_layers += layer.pixels;
        EXPECT_EQ(in_layers, stored);
    }
}

}  // namespace
}  // namespace peeler
