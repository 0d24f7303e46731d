// SPDX-License-Identifier: Apache-2.0
// Tables of how much a lobe reflects in all, and where it looks prefiltered light up.
#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace peeler {

/// Entries a side of the tables: row r for roughness r / (size − 1), column c for a cosine of
/// c / (size − 1).
inline constexpr int kAlbedoTableSize = 64;

/// x, y: directional albedo of GGX (height-correlated Smith) as scale and bias of F0 (Karis, "Real
/// Shading in Unreal Engine 4", 2013); together at most 1. z: that of sheen (Estevez & Kulla,
/// "Production Friendly Microfacet Sheen BRDF", 2017), at most 1. w: 0. The same numbers on any
/// number of threads; calculated when peeler is built, as lobeTable() is (constants.h).
std::vector<glm::vec4> albedoTable();

/// Where to look up prefiltered light for GGX, so that what is linear in the direction comes out as
/// the lobe's own integral. x, y: of what F0 scales; z, w: of what F90 does, which Schlick's term
/// pushes away from the normal. x and z: the mean direction, as how far it has gone from the normal
/// (0) to the mirrored view (1) on the line between them; farther than 1 is possible. y and w: the
/// roughness of the level whose lobe has the same mean cosine with its axis, over the surface's;
/// somewhat less for a roughness below 0.4.
std::vector<glm::vec4> lobeTable();

}  // namespace peeler
