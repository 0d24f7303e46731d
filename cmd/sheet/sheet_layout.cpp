// SPDX-License-Identifier: Apache-2.0
#include "cmd/sheet/sheet_layout.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <peeler/error.h>
#include "cmd/cli/parse.h"
#include "core/base/color.h"
#include "core/base/parallel.h"
#include "core/scene/camera_choice.h"
#include "formats/image/display.h"
#include "formats/image/font.h"

namespace peeler::cmd {

namespace {

using Pixel = std::array<float, 4>;

/// Returns the opaque linear colour of an sRGB grey (0 to 255).
Pixel grey(int byte) {
    const float value = linearFromSrgb(static_cast<float>(byte) / 255);
    return {value, value, value, 1};
}

const Pixel kPage = grey(255), kLabel = grey(20), kDetail = grey(100);
const Pixel kLightSquare = grey(238), kDarkSquare = grey(218);

/// The dimensions of a page, in pixels.
struct Layout {
    int columns = 1, rows = 1;
    int cell_width = 0, cell_height = 0;
    int scale = 1;  ///< pixels per dot of the font
    int gap = 0, caption = 0;

    int x(int column) const { return gap + column * (cell_width + gap); }
    int y(int row) const { return gap + row * (cell_height + caption + 2 * gap); }
    int width() const { return x(columns); }
    int height() const { return y(rows) - gap; }
};

std::size_t longestLine(const std::vector<SheetCell>& cells) {
    std::size_t longest = 1;
    for (const SheetCell& cell : cells)
        longest = std::max({longest, cell.label.size(), cell.detail.size()});
    return longest;
}

Layout plan(const std::vector<SheetCell>& cells, int columns) {
    const int count = static_cast<int>(cells.size());
    Layout layout;
    layout.columns =
        columns > 0 ? std::min(columns, count) : static_cast<int>(std::ceil(std::sqrt(count)));
    layout.rows = (count + layout.columns - 1) / layout.columns;
    layout.cell_width = cells.front().picture.window.width();
    layout.cell_height = cells.front().picture.window.height();
    // Lines of more than about 27 characters get smaller text, but never below one pixel per dot.
    const int dots = static_cast<int>(longestLine(cells)) * kTextAdvance;
    layout.scale =
        std::clamp(std::min(layout.cell_width / 160, layout.cell_width / dots), 1, kMostTextScale);
    layout.gap = 4 * std::max(1, layout.cell_width / 160);
    layout.caption = (2 * kTextHeight + 7) * layout.scale;
    return layout;
}

Pixel backgroundAt(const SheetStyle& style, int square, int x, int y) {
    const Pixel& board = (x / square + y / square) % 2 == 0 ? kLightSquare : kDarkSquare;
    if (!style.background) return board;
    return over(*style.background, board);
}

void drawPicture(const SheetCell& cell, const SheetStyle& style, const Window& place, int square,
                 CompositeImage& page) {
    const Display display(style.exposure, style.tone_map);
    const auto width = static_cast<std::size_t>(place.width());
    const auto page_width = static_cast<std::size_t>(page.window.width());
    parallelFor(static_cast<std::size_t>(place.height()), [&](std::size_t row) {
        Pixel* out = page.rgba.data() + (static_cast<std::size_t>(place.y0) + row) * page_width +
                     static_cast<std::size_t>(place.x0);
        for (std::size_t x = 0; x < width; ++x) {
            const Pixel back =
                backgroundAt(style, square, static_cast<int>(x), static_cast<int>(row));
            out[x] = display.shownOver(cell.picture, row * width + x, back);
            out[x][3] = 1;
        }
    });
}

/// Returns the beginning of `text` that fits into the width of a cell.
std::string_view fitting(std::string_view text, const Layout& layout) {
    const int room = layout.cell_width / (kTextAdvance * layout.scale);
    return text.substr(0, static_cast<std::size_t>(std::max(0, room)));
}

}  // namespace

CompositeImage layOut(const std::vector<SheetCell>& cells, const SheetStyle& style) {
    const Layout layout = plan(cells, style.columns);
    try {
        checkPixels({layout.width(), layout.height()});
    } catch (const Error& error) {
        throw Error(error.kind(), error.what(), "the sheet",
                    "use a smaller --cell-width, or fewer --cells");
    }
    CompositeImage page;
    page.window = {0, 0, layout.width(), layout.height()};
    page.rgba.assign(page.window.pixels(), kPage);
    page.z.assign(page.window.pixels(), std::numeric_limits<float>::infinity());
    for (std::size_t i = 0; i < cells.size(); ++i) {
        const int x = layout.x(static_cast<int>(i) % layout.columns);
        const int y = layout.y(static_cast<int>(i) / layout.columns);
        const int below = y + layout.scale * (kTextHeight + 3);
        const int top = y + layout.caption;
        drawText(page, x, y, layout.scale, kLabel, fitting(cells[i].label, layout));
        drawText(page, x, below, layout.scale, kDetail, fitting(cells[i].detail, layout));
        drawPicture(cells[i], style, {x, top, x + layout.cell_width, top + layout.cell_height},
                    2 * layout.gap, page);
    }
    return page;
}

}  // namespace peeler::cmd
