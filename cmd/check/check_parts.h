// SPDX-License-Identifier: Apache-2.0
// Checks the parts of a scene.
#pragma once

#include <functional>
#include <optional>

#include "cmd/check/part_report.h"
#include "core/scene/posed_scene.h"

namespace peeler::cmd {

struct CheckSettings {
    bool together = false;             ///< all parts are one, welded
    double metres = 1;                 ///< a scene unit
    std::optional<double> least_wall;  ///< scene units
};

/// Checks all that a scene shows. `progress` is called with the share that is done.
CheckReport checkParts(const PosedScene& posed, const CheckSettings& settings,
                       const std::function<void(double)>& progress);

}  // namespace peeler::cmd
