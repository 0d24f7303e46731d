// SPDX-License-Identifier: Apache-2.0
// Prefiltered environment maps, for lookups by shaders instead of integration.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include <peeler/scene.h>

namespace peeler {

/// Six square faces, one after the other. Their order (+X, −X, +Y, −Y, +Z, −Z), orientation and
/// order of rows are those of OpenGL.
struct CubeMap {
    int size = 0;
    std::vector<glm::vec3> texels;
};

/// Returns the unit direction (world space) from the centre of the cube to the centre of a texel.
glm::vec3 cubeDirection(int face, int x, int y, int size);

/// Returns the filter roughness of level i of n. It grows from 0 to 1, in increasing steps.
/// shaders/environment.glsl has the inverse, i = (n - 1) * roughness * (1.4 - 0.4 * roughness).
double levelRoughness(int level, int levels);

struct EnvironmentMaps {
    /// Radiance, convolved with the GGX lobe of a surface seen head-on (the split sum of Karis,
    /// "Real Shading in Unreal Engine 4", 2013). Level i is filtered for its levelRoughness();
    /// level 0 is unfiltered. Each level has half the size of the previous one.
    std::vector<CubeMap> radiance;
    CubeMap irradiance;  ///< irradiance divided by pi
};

/// Incident radiance for integrals over `count` evenly distributed directions. Each value is the
/// mean radiance around its direction, so that small bright lights keep their energy.
class EnvironmentSamples {
  public:
    EnvironmentSamples(const Environment& environment, int count);
    /// `direction`: unit vector toward the source, world space.
    glm::vec3 radiance(const glm::dvec3& direction) const;

  private:
    Environment coarse_;
};

/// Returns the prefiltered maps. Independent of the number of threads. A white environment gives
/// white maps, up to rounding.
EnvironmentMaps prefilter(const Environment& environment);

}  // namespace peeler
