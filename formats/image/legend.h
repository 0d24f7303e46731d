// SPDX-License-Identifier: Apache-2.0
// Legends of pictures with false colours.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/composite.h>

namespace peeler {

/// The size of a white strip below a picture.
struct LegendSize {
    int scale = 1;              ///< pixels per text dot
    int width = 0, height = 0;  ///< pixels; may be wider than the picture
};

/// The legend of false colours.
struct ColorBar {
    std::string title;                                    ///< quantity and unit
    double low = 0, high = 1;                             ///< values at both ends
    std::array<float, 3> (*ramp)(float share) = nullptr;  ///< linear; share from 0 to 1
};

/// Returns the size of the legend with this title below a picture `width` pixels wide.
LegendSize colorBarSize(std::string_view title, int width);
/// Draws the bar with its title above and values below: both ends, and round ones between. The
/// window is (0, 0) to the size.
CompositeImage drawColorBar(const ColorBar& bar, const LegendSize& size);

/// A line of a legend: a colour square and its meaning.
struct LegendLine {
    std::array<float, 3> color{1, 1, 1};  ///< linear; white = no square
    std::string text;
};
/// Returns the size of these lines, one below the other, for a picture `width` pixels wide.
LegendSize legendSize(const std::vector<LegendLine>& lines, int width);
CompositeImage drawLegend(const std::vector<LegendLine>& lines, const LegendSize& size);

}  // namespace peeler
