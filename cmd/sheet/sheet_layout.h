// SPDX-License-Identifier: Apache-2.0
// Cells side by side on a page, each under its label.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cmd/sheet/sheet_cells.h"

namespace peeler::cmd {

struct SheetLook {
    int columns = 0;                                 ///< 0 = as many as rows, or one more
    std::optional<std::array<float, 4>> background;  ///< premultiplied; none = a checkerboard
    float exposure = 0;                              ///< stops; of the cells
    std::string tone_map = "none";
};

/// The page: linear, opaque, window from (0, 0). The cells are of one size. Throws Error (kUsage)
/// if it would be larger than a picture may be.
CompositeImage layOut(const std::vector<SheetCell>& cells, const SheetLook& look);

// Labels without a font file: machines of a farm have none.

/// Of a glyph of printable ASCII, in dots; an advance holds the gap to the next one.
inline constexpr int kTextHeight = 7, kTextAdvance = 6;

/// Draws one line with its upper left corner at (x, y) of the picture's window, a dot being `scale`
/// pixels wide and high. What lies outside the window is left out; a character that is not
/// printable ASCII is shown as '?'.
void drawText(CompositeImage& picture, int x, int y, int scale, const std::array<float, 4>& color,
              std::string_view text);

}  // namespace peeler::cmd
