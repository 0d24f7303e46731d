// SPDX-License-Identifier: Apache-2.0
// Results of ray outputs as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "formats/rays/ray_output.h"

namespace peeler::cmd {

/// Adds the run's "maps", "voxels" and "points", if any, to a result (cmd/README.md, "JSON").
void addRayResults(const RayResults& results, nlohmann::ordered_json& json);

}  // namespace peeler::cmd
