// SPDX-License-Identifier: Apache-2.0
// Labels without a font file: machines of a farm have none.
#pragma once

#include <array>
#include <string_view>

#include "core/image/composite.h"

namespace peeler::cmd {

/// Of a glyph of printable ASCII, in dots; an advance holds the gap to the next one.
inline constexpr int kTextHeight = 7, kTextAdvance = 6;

/// Draws one line with its upper left corner at (x, y) of the picture's window, a dot being `scale`
/// pixels wide and high. What lies outside the window is left out; a character that is not
/// printable ASCII is shown as '?'.
void drawText(CompositeImage& picture, int x, int y, int scale, const std::array<float, 4>& color,
              std::string_view text);

}  // namespace peeler::cmd
