// SPDX-License-Identifier: Apache-2.0
// rays --points: the hits next to points of the user's, before and after them.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cmd/rays/hit_output.h"
#include "core/rays/bundle.h"

namespace peeler::cmd {

/// .npz, of d parallel bundles and n points: `t_before`, `t_after` (d, n; float, scene units, inf =
/// no hit), `geometry_ids_before`, `geometry_ids_after`, `primitive_ids_before`,
/// `primitive_ids_after` (d, n; uint32, 0xFFFFFFFF = no hit, Open3D's INVALID_ID), `points` (n, 3)
/// and `directions` (d, 3; unit vectors), double. Bundle after bundle is written; what is found
/// takes 32 bytes a point, however many bundles there are.
std::unique_ptr<RayOutput> makePointOutput(std::string path, const HitSources& sources,
                                           std::vector<glm::dvec3> points);

}  // namespace peeler::cmd
