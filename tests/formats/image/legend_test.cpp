// SPDX-License-Identifier: Apache-2.0
#include "formats/image/legend.h"

#include <gtest/gtest.h>

#include "core/base/color.h"
#include "formats/image/font.h"

namespace peeler {
namespace {

constexpr std::array<float, 4> kPaper{1, 1, 1, 1};

/// Returns the number of pixels with ink (not the paper's colour) in these rows.
int inked(const CompositeImage& picture, int y0, int y1) {
    int count = 0;
    const auto width = static_cast<std::size_t>(picture.window.width());
    for (auto i = static_cast<std::size_t>(y0) * width; i < static_cast<std::size_t>(y1) * width;
         ++i)
        count += picture.rgba[i] != kPaper ? 1 : 0;
    return count;
}

TEST(Legend, ABarHasItsTitleItsColoursAndItsNumbers) {
    for (const int width : {16, 256, 2000}) {
        const LegendSize size = colorBarSize("thickness, mm", width);
        EXPECT_GE(size.width, std::max(width, 100));
        const CompositeImage legend = drawColorBar({"thickness, mm", 0, 31, inferno}, size);
        EXPECT_EQ(legend.window, (Window{0, 0, size.width, size.height}));
        const int s = size.scale;
        EXPECT_GT(inked(legend, 4 * s, 11 * s), 0) << "the title";
        EXPECT_GT(inked(legend, size.height - 11 * s, size.height - 4 * s), 0) << "the numbers";
        EXPECT_EQ(inked(legend, 0, 3 * s) + inked(legend, size.height - 4 * s, size.height), 0);
        CompositeImage text;
        text.window = {0, 0, 2 * kTextAdvance * s, kTextHeight * s};
        text.rgba.resize(text.window.pixels());
        drawText(text, 0, 0, s, {0, 0, 0, 1}, "31");
        for (int y = 0; y < text.window.height(); ++y) {
            for (int x = 0; x < text.window.width(); ++x) {
                const int from = (size.height - 11 * s + y) * size.width + size.width - 4 * s -
                                 text.window.width() + x;
                const auto dot = static_cast<std::size_t>(y * text.window.width() + x);
                EXPECT_EQ(legend.rgba[static_cast<std::size_t>(from)] != kPaper,
                          text.rgba[dot][3] > 0)
                    << x << ", " << y;
            }
        }
        // The bar must show every colour of the ramp in order.
        const auto row = static_cast<std::size_t>(18 * s) * static_cast<std::size_t>(size.width);
        float before = -1;
        for (int x = 4 * s; x < size.width - 4 * s; ++x) {
            const float green = legend.rgba[row + static_cast<std::size_t>(x)][1];
            EXPECT_GE(green, before) << x;
            before = green;
        }
        EXPECT_EQ(before, inferno(1)[1]);
    }
}

TEST(Legend, OtherNumbersLookOtherwise) {
    const LegendSize size = colorBarSize("hits", 300);
    const auto rows = [&](double low, double high) {
        return drawColorBar({"hits", low, high, inferno}, size).rgba;
    };
    EXPECT_EQ(rows(0, 6), rows(0, 6));
    EXPECT_NE(rows(0, 6), rows(0, 8));
    EXPECT_NE(rows(0, 6), rows(1, 6));
    EXPECT_NO_THROW(rows(0, 0));
    EXPECT_NO_THROW(rows(-1e30, 1e30));
}

TEST(Legend, LinesHaveSquaresOfTheirColours) {
    const std::vector<LegendLine> lines = {{{1, 0, 0}, "3 open edges"}, {{0, 0, 1}, "a wall"}};
    const LegendSize size = legendSize(lines, 32);
    const CompositeImage legend = drawLegend(lines, size);
    const auto at = [&](int x, int y) {
        return legend.rgba[static_cast<std::size_t>(y * size.width + x)];
    };
    EXPECT_EQ(at(5, 5), (std::array<float, 4>{1, 0, 0, 1}));
    EXPECT_EQ(at(5, 15), (std::array<float, 4>{0, 0, 1, 1}));
    EXPECT_EQ(at(5, 12), kPaper);
}

}  // namespace
}  // namespace peeler
