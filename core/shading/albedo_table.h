// SPDX-License-Identifier: Apache-2.0
// How much a lobe reflects in all, by roughness and the angle of the view: what prefiltered light
// is multiplied with.
#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace peeler {

/// Entries a side: row r for roughness r / (size − 1), column c for a cosine of c / (size − 1).
inline constexpr int kAlbedoTableSize = 64;

/// x, y: directional albedo of GGX (height-correlated Smith) as scale and bias of F0 (Karis, "Real
/// Shading in Unreal Engine 4", 2013); together at most 1. z: that of sheen (Estevez & Kulla,
/// "Production Friendly Microfacet Sheen BRDF", 2017), at most 1; 0 unless `sheen`, since it takes
/// long. Calculated once.
/// The same on any number of threads.
const std::vector<glm::vec3>& albedoTable(bool sheen);

}  // namespace peeler
