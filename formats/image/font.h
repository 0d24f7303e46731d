// SPDX-License-Identifier: Apache-2.0
// Text in pictures, in DejaVu Sans Mono.
//
// FreeType rasterises the font when peeler is built, because the machines of render farms have no
// fonts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include <peeler/composite.h>

namespace peeler {

/// The height of capitals, and the distance between characters, in dots.
inline constexpr int kTextHeight = 7, kTextAdvance = 6;
/// The maximum scale of text, in pixels per dot.
inline constexpr int kMostTextScale = 4;

/// Draws a line of text. The upper left corner of its capitals is at (x, y) in the picture's
/// window. A dot is `scale` pixels wide, 1 to kMostTextScale. Clips the text to the window.
/// Characters that are not printable ASCII become '?'.
void drawText(CompositeImage& picture, int x, int y, int scale, const std::array<float, 4>& color,
              std::string_view text);

/// The first and last character of the font.
inline constexpr char kFirstGlyph = ' ', kLastGlyph = '~';
/// The number of rows of a glyph above the capitals, and in total, in dots. Brackets extend above
/// the capitals, and some letters below the baseline.
inline constexpr int kGlyphTop = 1, kGlyphRows = 11;

/// The coverage of each pixel of a glyph at S pixels per dot, row by row, 0 to 255.
template <std::size_t S>
using Glyph = std::array<std::array<std::uint8_t, S * kTextAdvance>, S * kGlyphRows>;
template <std::size_t S>
using Glyphs = std::array<Glyph<S>, kLastGlyph - kFirstGlyph + 1>;

/// The font as a memory image, written by write_font.cpp.
struct Font {
    Glyphs<1> one;
    Glyphs<2> two;
    Glyphs<3> three;
    Glyphs<4> four;
};

}  // namespace peeler
