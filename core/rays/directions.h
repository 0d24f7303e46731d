// SPDX-License-Identifier: Apache-2.0
// Directions spread evenly.
#pragma once

#include <glm/glm.hpp>
#include <vector>

namespace peeler {

/// Unit vectors over the whole sphere, each for the same solid angle: the spherical Fibonacci
/// lattice (Swinbank & Purser 2006; Keinert et al., "Spherical Fibonacci Mapping", 2015).
std::vector<glm::dvec3> sphereDirections(int count);

/// Likewise over the half around +Y.
std::vector<glm::dvec3> hemisphereDirections(int count);

}  // namespace peeler
