// SPDX-License-Identifier: Apache-2.0
// Legends of pictures with false colours.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/composite.h>

namespace peeler {

/// The size of a legend: a white strip below a picture.
struct LegendSize {
    int scale = 1;              ///< number of pixels per text dot
    int width = 0, height = 0;  ///< size in pixels; may be wider than the picture
};

/// The contents of a legend for false colours.
struct ColorBar {
    std::string title;         ///< name of the quantity with its unit
    double low = 0, high = 1;  ///< values at both ends
    /// Maps a share from 0 to 1 to a linear colour.
    std::array<float, 3> (*ramp)(float share) = nullptr;
};

/// Returns the size of a legend with this title for a picture that is `width` pixels wide.
LegendSize colorBarSize(std::string_view title, int width);
/// Draws the legend: the title, the bar, and below it the values at both ends and at round numbers
/// between the ends. The window is (0, 0) to `size`.
CompositeImage drawColorBar(const ColorBar& bar, const LegendSize& size);

/// A line of a legend: a coloured square and its meaning.
struct LegendLine {
    std::array<float, 3> color{1, 1, 1};  ///< linear colour of the square; white means no square
    std::string text;
};
/// Returns the size of a legend with these lines, one below the other, for a picture that is
/// `width` pixels wide.
LegendSize legendSize(const std::vector<LegendLine>& lines, int width);
CompositeImage drawLegend(const std::vector<LegendLine>& lines, const LegendSize& size);

}  // namespace peeler
