// SPDX-License-Identifier: Apache-2.0
// The layout of a contact sheet.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <peeler/composite.h>
#include "cmd/sheet/sheet_cells.h"

namespace peeler::cmd {

struct SheetStyle {
    int columns = 0;  ///< number of columns; 0 = chosen for a nearly square page
    std::optional<std::array<float, 4>> background;  ///< straight linear; none = a checkerboard
    float exposure = 0;                              ///< exposure of the cells, stops
    std::string tone_map = "none";
};

/// Returns the page as a linear, opaque picture whose window starts at (0, 0). All cells must have
/// the same size. Throws Error (kUsage) if the page would exceed the maximum picture size.
CompositeImage layOut(const std::vector<SheetCell>& cells, const SheetStyle& style);

}  // namespace peeler::cmd
