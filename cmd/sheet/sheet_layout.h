// SPDX-License-Identifier: Apache-2.0
// The cells of a contact sheet side by side on a page, each under its label.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <peeler/composite.h>
#include "cmd/sheet/sheet_cells.h"

namespace peeler::cmd {

/// What a page looks like.
struct SheetStyle {
    int columns = 0;                                 ///< 0 = as many as rows, or one more
    std::optional<std::array<float, 4>> background;  ///< straight linear; none = a checkerboard
    float exposure = 0;                              ///< stops; of the cells
    std::string tone_map = "none";
};

/// The page: linear, opaque, window from (0, 0). The cells are of one size. Throws Error (kUsage)
/// if it would be larger than a picture may be.
CompositeImage layOut(const std::vector<SheetCell>& cells, const SheetStyle& style);

}  // namespace peeler::cmd
