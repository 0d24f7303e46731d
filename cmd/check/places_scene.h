// SPDX-License-Identifier: Apache-2.0
// A scene that shows faulty places.
#pragma once

#include <vector>

#include <peeler/scene.h>
#include "cmd/check/part_report.h"
#include "formats/image/legend.h"

namespace peeler::cmd {

/// Returns a new scene that shows the parts in pale colours and all faulty places in bright ones.
Scene placesScene(const CheckReport& report);

std::vector<LegendLine> placesLegend(const CheckReport& report);

}  // namespace peeler::cmd
