// SPDX-License-Identifier: Apache-2.0
// Tests area averages against analytic answers.
#include "core/image/box_filter.h"

#include <gtest/gtest.h>

#include <random>

namespace peeler {
namespace {

using Pixel = BoxFilter::Pixel;

Pixel tinted(float value) {
    return {value, 2 * value, 3 * value, 1};
}

/// Reduces a picture with these values (row-major) to width x height pixels.
std::vector<Pixel> reduce(const std::vector<float>& values, int columns, int width, int height) {
    const int rows = static_cast<int>(values.size()) / columns;
    BoxFilter filter(columns, rows, width, height);
    std::vector<Pixel> row;
    for (const float value : values) {
        row.push_back(tinted(value));
        if (static_cast<int>(row.size()) < columns) continue;
        filter.addRow(row);
        row.clear();
    }
    return filter.pixels();
}

TEST(BoxFilter, AveragesWholeBlocks) {
    const auto out = reduce({1, 3, 10, 20, 5, 7, 30, 40}, 4, 2, 1);
    ASSERT_EQ(out.size(), 2U);
    EXPECT_FLOAT_EQ(out[0][0], 4);
    EXPECT_FLOAT_EQ(out[0][2], 12);
    EXPECT_FLOAT_EQ(out[1][0], 25);
    EXPECT_FLOAT_EQ(out[1][3], 1);
}

TEST(BoxFilter, SharesAPixelOnAnEdgeByArea) {
    const auto columns = reduce({2, 8, 5}, 3, 2, 1);  // (2 + 8 / 2) / 1.5, (8 / 2 + 5) / 1.5
    EXPECT_FLOAT_EQ(columns[0][0], 4);
    EXPECT_FLOAT_EQ(columns[1][0], 6);
    const auto rows = reduce({2, 8, 5}, 1, 1, 2);
    EXPECT_FLOAT_EQ(rows[0][0], 4);
    EXPECT_FLOAT_EQ(rows[1][0], 6);
}

TEST(BoxFilter, SameSizeIsTheSamePicture) {
    const auto out = reduce({1, 2, 3, 4, 5, 6}, 3, 3, 2);
    for (std::size_t i = 0; i < 6; ++i)
        EXPECT_EQ(out[i], tinted(static_cast<float>(i + 1)));
}

TEST(BoxFilter, KeepsTheAverageAtAnyRatio) {
    constexpr unsigned kSeed = 7;
    std::mt19937 random(kSeed);
    for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {64, 41}, {100, 61}}) {
        std::vector<float> values(101 * 61);
        double sum = 0;
        for (float& value : values)
            sum += value = static_cast<float>(random() % 1000U) / 1000;
        double reduced = 0, alpha = 0;
        for (const Pixel& pixel : reduce(values, 101, width, height)) {
            reduced += pixel[0];
            alpha += pixel[3];
        }
        EXPECT_NEAR(reduced / (width * height), sum / static_cast<double>(values.size()), 1e-5);
        EXPECT_NEAR(alpha / (width * height), 1, 1e-5) << "seed " << kSeed;
    }
}

}  // namespace
}  // namespace peeler
