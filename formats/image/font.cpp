// SPDX-License-Identifier: Apache-2.0
#include "formats/image/font.h"

#include <algorithm>
#include <cstddef>

namespace peeler {
namespace {

// The font, a file written by write_font.cpp.
asm(".pushsection .rodata\n"
    ".globl peeler_font\n"
    "peeler_font:\n"
    ".incbin \"" PEELER_FONT_IMAGE
    "\"\n"
    ".popsection\n");

}  // namespace

extern "C" const Font peeler_font;

namespace {

/// Returns a character's coverage, pixel by pixel, row by row.
const std::uint8_t* glyphOf(char character, int scale) {
    const char known = character < kFirstGlyph || character > kLastGlyph ? '?' : character;
    const auto index = static_cast<std::size_t>(known - kFirstGlyph);
    switch (scale) {
        case 1:
            return peeler_font.one[index].front().data();
        case 2:
            return peeler_font.two[index].front().data();
        case 3:
            return peeler_font.three[index].front().data();
        default:
            return peeler_font.four[index].front().data();
    }
}

}  // namespace

void drawText(CompositeImage& picture, int x, int y, int scale, const std::array<float, 4>& color,
              std::string_view text) {
    const Window& window = picture.window;
    const int columns = scale * kTextAdvance, rows = scale * kGlyphRows;
    for (const char character : text) {
        const std::uint8_t* const glyph = glyphOf(character, scale);
        const Window cell{x, y - scale * kGlyphTop, x + columns, y - scale * kGlyphTop + rows};
        const Window inside = intersect(cell, window);
        for (int row = inside.y0; row < inside.y1; ++row) {
            for (int column = inside.x0; column < inside.x1; ++column) {
                const float coverage =
                    static_cast<float>(glyph[(row - cell.y0) * columns + column - cell.x0]) / 255;
                auto& pixel = picture.rgba[static_cast<std::size_t>(row - window.y0) *
                                               static_cast<std::size_t>(window.width()) +
                                           static_cast<std::size_t>(column - window.x0)];
                for (std::size_t c = 0; c < 4; ++c)
                    pixel[c] += (color[c] - pixel[c]) * coverage;
            }
        }
        x += columns;
    }
}

}  // namespace peeler
