// SPDX-License-Identifier: Apache-2.0
// Visualisation of faulty places.
#pragma once

#include <vector>

#include <peeler/scene.h>
#include "cmd/check/part_report.h"
#include "formats/image/legend.h"

namespace peeler::cmd {

/// Returns a new scene with the parts in pale and all faulty places in bright colours.
Scene placesScene(const CheckReport& report);

/// Returns the legend of placesScene().
std::vector<LegendLine> placesLegend(const CheckReport& report);

}  // namespace peeler::cmd
