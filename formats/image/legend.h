// SPDX-License-Identifier: Apache-2.0
// What is written on pictures: text without a font file (machines of a farm have none), and the
// legends of pictures whose colours are numbers.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/composite.h>

namespace peeler {

/// The height of a glyph of printable ASCII and its distance to the next one, in dots.
inline constexpr int kTextHeight = 7, kTextAdvance = 6;

/// Draws one line with its upper left corner at (x, y) of the picture's window, a dot being `scale`
/// pixels wide and high. What lies outside the window is left out; a character that is not
/// printable ASCII is shown as '?'.
void drawText(CompositeImage& picture, int x, int y, int scale, const std::array<float, 4>& color,
              std::string_view text);

/// A strip of white below a picture.
struct LegendSize {
    int scale = 1;              ///< pixels a dot of its text
    int width = 0, height = 0;  ///< pixels; it may have to be wider than the picture
};

/// The legend of a picture whose colours are numbers.
struct ColorBar {
    std::string title;                                    ///< what the numbers are, and their unit
    double low = 0, high = 1;                             ///< the numbers at both ends
    std::array<float, 3> (*ramp)(float share) = nullptr;  ///< linear; share from 0 to 1
};

/// The size of the legend with this title below a picture `width` pixels wide.
LegendSize colorBarSize(std::string_view title, int width);
/// The bar with its title above and numbers below: those at the ends, and round ones between. The
/// window is (0, 0) to the size.
CompositeImage drawColorBar(const ColorBar& bar, const LegendSize& size);

/// A line of a legend: a square of a colour, and what it stands for.
struct LegendLine {
    std::array<float, 3> color{1, 1, 1};  ///< linear; white = no square
    std::string text;
};
/// The size of these lines below each other, for a picture `width` pixels wide.
LegendSize legendSize(const std::vector<LegendLine>& lines, int width);
CompositeImage drawLegend(const std::vector<LegendLine>& lines, const LegendSize& size);

}  // namespace peeler
