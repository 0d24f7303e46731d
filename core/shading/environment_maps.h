// SPDX-License-Identifier: Apache-2.0
// Prefiltered environment maps, which shaders look up instead of integrating.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include <peeler/scene.h>

namespace peeler {

/// Six square faces in OpenGL's order (+X, −X, +Y, −Y, +Z, −Z) and orientation, one after the
/// other, rows as OpenGL stores them.
struct CubeMap {
    int size = 0;
    std::vector<glm::vec3> texels;
};

/// Returns the unit direction (world) from the centre of the cube to the centre of a texel.
glm::vec3 cubeDirection(int face, int x, int y, int size);

/// Returns the roughness that level i of n is filtered for: from 0 to 1, in growing steps. The
/// inverse, i = (n - 1) * roughness * (1.4 - 0.4 * roughness), is in shaders/environment.glsl.
double levelRoughness(int level, int levels);

struct EnvironmentMaps {
    /// Radiance, convolved with the GGX lobe of a surface seen head-on (the split sum of Karis,
    /// "Real Shading in Unreal Engine 4", 2013): each level for its levelRoughness(), level 0
    /// unfiltered. Each has half the size of the previous one.
    std::vector<CubeMap> radiance;
    CubeMap irradiance;  ///< divided by pi
};

/// Incident radiance for integrals over `count` evenly spread directions: the mean around each
/// direction, so that small bright lights keep their energy.
class EnvironmentSamples {
  public:
    EnvironmentSamples(const Environment& environment, int count);
    /// `direction` points toward the source; unit, world.
    glm::vec3 radiance(const glm::dvec3& direction) const;

  private:
    Environment coarse_;
};

/// Returns the prefiltered maps, independent of the number of threads. A white environment gives
/// exactly white maps, up to rounding.
EnvironmentMaps prefilter(const Environment& environment);

}  // namespace peeler
