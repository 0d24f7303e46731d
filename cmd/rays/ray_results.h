// SPDX-License-Identifier: Apache-2.0
// What rays tells of its files besides their names.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "formats/rays/ray_output.h"

namespace peeler::cmd {

/// Adds those that there are: "maps", "voxels" and "points" (cmd/README.md, "JSON").
void addRayResults(const RayResults& results, nlohmann::ordered_json& json);

}  // namespace peeler::cmd
