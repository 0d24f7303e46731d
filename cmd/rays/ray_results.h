// SPDX-License-Identifier: Apache-2.0
// The results of outputs of rays as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "formats/rays/ray_output.h"

namespace peeler::cmd {

/// Adds "maps", "voxels" and "points" to a result, as far as there are any (cmd/README.md, "JSON").
void addRayResults(const RayResults& results, nlohmann::ordered_json& json);

}  // namespace peeler::cmd
