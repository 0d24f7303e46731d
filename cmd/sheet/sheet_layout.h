// SPDX-License-Identifier: Apache-2.0
// Contact sheet layout.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <peeler/composite.h>
#include "cmd/sheet/sheet_cells.h"

namespace peeler::cmd {

/// The style of a page.
struct SheetStyle {
    int columns = 0;                                 ///< 0 = equal to the rows, or one more
    std::optional<std::array<float, 4>> background;  ///< straight linear; none = a checkerboard
    float exposure = 0;                              ///< stops; of the cells
    std::string tone_map = "none";
};

/// Returns the page: linear, opaque, window from (0, 0). The cells have one size. Throws Error
/// (kUsage) if the page would exceed the maximum picture size.
CompositeImage layOut(const std::vector<SheetCell>& cells, const SheetStyle& style);

}  // namespace peeler::cmd
