// SPDX-License-Identifier: Apache-2.0
// JSON results of ray outputs.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "formats/rays/ray_output.h"

namespace peeler::cmd {

/// Adds "maps", "voxels" and "points" to a result if present (cmd/README.md, "JSON").
void addRayResults(const RayResults& results, nlohmann::ordered_json& json);

}  // namespace peeler::cmd
