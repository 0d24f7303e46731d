// SPDX-License-Identifier: Apache-2.0
// Tests the layout of a sheet's cells.
#include "cmd/sheet/sheet_cells.h"

#include <gtest/gtest.h>

#include <peeler/error.h>
#include "cmd/sheet/sheet_layout.h"

namespace peeler::cmd {
namespace {

using Pixel = std::array<float, 4>;

CompositeImage blank(int width, int height) {
    CompositeImage picture;
    picture.window = {0, 0, width, height};
    picture.rgba.resize(picture.window.pixels());
    return picture;
}

std::vector<SheetCell> cells(int count, int width, int height) {
    std::vector<SheetCell> all(static_cast<std::size_t>(count));
    for (SheetCell& cell : all) {
        cell.label = "x";
        cell.picture = blank(width, height);
    }
    return all;
}

TEST(SheetLayout, IsNearlySquareUnlessColumnsAreGiven) {
    struct Row {
        int cells, columns, across, down;
    };
    for (const Row& row : {Row{1, 0, 1, 1}, Row{4, 0, 2, 2}, Row{5, 0, 3, 2}, Row{10, 0, 4, 3},
                           Row{10, 5, 5, 2}, Row{3, 8, 3, 1}}) {
        SheetStyle style;
        style.columns = row.columns;
        const CompositeImage page = layOut(cells(row.cells, 40, 20), style);
        EXPECT_EQ(page.window.width(), 4 + row.across * 44) << row.cells;
        EXPECT_EQ(page.window.height(), row.down * (21 + 20 + 8)) << row.cells;
        EXPECT_EQ(page.rgba.size(), page.window.pixels());
        for (const Pixel& pixel : page.rgba)
            ASSERT_EQ(pixel[3], 1);
    }
}

TEST(SheetLayout, ExposureActsOnCellsAlone) {
    std::vector<SheetCell> one = cells(1, 40, 20);
    for (Pixel& pixel : one[0].picture.rgba)
        pixel = {0.1F, 0.1F, 0.1F, 0.5F};
    SheetStyle style;
    style.background = Pixel{0, 0, 0, 1};
    const CompositeImage plain = layOut(one, style);
    style.exposure = 1;
    const CompositeImage brighter = layOut(one, style);
    // The exposure does not affect the background.
    EXPECT_EQ(plain.rgba.front(), brighter.rgba.front());
    const std::size_t inside = plain.rgba.size() - 10 * 48 - 20;
    EXPECT_FLOAT_EQ(plain.rgba[inside][0], 0.1F);
    EXPECT_FLOAT_EQ(brighter.rgba[inside][0], 0.2F);
}

TEST(SheetLayout, AlphaAboveOneTakesAwayFromTheBackground) {
    std::vector<SheetCell> one = cells(1, 40, 20);
    for (Pixel& pixel : one[0].picture.rgba)
        pixel = {0.7F, 0, 0, 1.5F};
    SheetStyle style;
    style.background = Pixel{0.4F, 0, 0, 1};
    const CompositeImage page = layOut(one, style);
    EXPECT_FLOAT_EQ(page.rgba[page.rgba.size() - 10 * 48 - 20][0], 0.5F);
}

TEST(SheetLayout, RefusesAPageThatIsTooLarge) {
    EXPECT_THROW(layOut(cells(9, 30'000, 1), {}), Error);
}

}  // namespace
}  // namespace peeler::cmd
