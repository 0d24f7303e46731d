// SPDX-License-Identifier: Apache-2.0
// A picture of the places where parts are faulty.
#pragma once

#include <vector>

#include <peeler/scene.h>
#include "cmd/check/part_report.h"
#include "formats/image/legend.h"

namespace peeler::cmd {

/// The parts, pale, and all places where something is wrong, in bright colours: a scene of its own.
Scene placesScene(const CheckReport& report);

/// What the colours of placesScene() stand for.
std::vector<LegendLine> placesLegend(const CheckReport& report);

}  // namespace peeler::cmd
