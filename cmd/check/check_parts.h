// SPDX-License-Identifier: Apache-2.0
// Printability checks of a scene's parts.
#pragma once

#include <functional>
#include <optional>

#include "cmd/check/part_report.h"
#include "core/scene/posed_scene.h"

namespace peeler::cmd {

struct CheckSettings {
    bool together = false;             ///< whether to weld all parts into one
    double metres = 1;                 ///< metres per scene unit
    std::optional<double> least_wall;  ///< scene units
    /// Welding distance for points of open edges, scene units; default: kTouching times the part's
    /// size.
    std::optional<double> weld;
};

/// Checks the visible parts of a scene. Calls `progress` with the share of work done.
CheckReport checkParts(const PosedScene& posed, const CheckSettings& settings,
                       const std::function<void(double)>& progress);

}  // namespace peeler::cmd
