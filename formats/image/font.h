// SPDX-License-Identifier: Apache-2.0
// Text in pictures: DejaVu Sans Mono, rasterised by FreeType when peeler is built, because render
// farm machines have no fonts.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include <peeler/composite.h>

namespace peeler {

/// Height of capitals, and the distance to the next character, in dots.
inline constexpr int kTextHeight = 7, kTextAdvance = 6;
/// The largest size of text: pixels per dot.
inline constexpr int kMostTextScale = 4;

/// Draws one line with the upper left corner of its capitals at (x, y) of the picture's window; a
/// dot is `scale` pixels, 1 to kMostTextScale. Clips to the window; characters outside printable
/// ASCII become '?'.
void drawText(CompositeImage& picture, int x, int y, int scale, const std::array<float, 4>& color,
              std::string_view text);

/// The first and last character of the font.
inline constexpr char kFirstGlyph = ' ', kLastGlyph = '~';
/// Rows of a glyph above capitals, and all rows, in dots: brackets rise above capitals, and
/// letters descend below the line.
inline constexpr int kGlyphTop = 1, kGlyphRows = 11;

/// The coverage of each pixel of a glyph at scale S, row by row, 0 to 255.
template <int S>
using Glyph = std::array<std::array<std::uint8_t, S * kTextAdvance>, S * kGlyphRows>;
template <int S>
using Glyphs = std::array<Glyph<S>, kLastGlyph - kFirstGlyph + 1>;

/// The memory image that write_font.cpp writes.
struct Font {
    Glyphs<1> one;
    Glyphs<2> two;
    Glyphs<3> three;
    Glyphs<4> four;
};

}  // namespace peeler
