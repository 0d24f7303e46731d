// SPDX-License-Identifier: Apache-2.0
// Tables for shading with GGX and sheen lobes: directional albedos, and parameters of lookups in
// prefiltered light.
#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace peeler {

/// Entries per side of the tables: row r is for roughness r / (size − 1), column c for a view
/// cosine of c / (size − 1).
inline constexpr int kAlbedoTableSize = 64;

/// Returns the albedo table. x, y: the directional albedo of GGX (height-correlated Smith) as scale
/// and bias of F0 (Karis, "Real Shading in Unreal Engine 4", 2013); their sum is at most 1. z: the
/// albedo of sheen (Estevez & Kulla, "Production Friendly Microfacet Sheen BRDF", 2017), at most 1.
/// w: 0. Independent of the number of threads. Computed at build time, like lobeTable()
/// (constants.h).
std::vector<glm::vec4> albedoTable();

/// Returns the parameters of lookups in prefiltered light for GGX. With them, lookups integrate the
/// lobe exactly if radiance is linear in the direction. x, y: for the F0 term. z, w: for the F90
/// term, whose mean direction is farther from the normal because of Schlick's factor. x and z: the
/// mean direction, as a position on the line from the normal (0) to the mirrored view (1); may
/// exceed 1. y and w: the roughness of the level to look up, divided by the surface's roughness.
/// The level's filter lobe has the same mean cosine with its axis as the term's part of the lobe.
/// Slightly reduced for a roughness below 0.4.
std::vector<glm::vec4> lobeTable();

}  // namespace peeler
