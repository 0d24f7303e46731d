// SPDX-License-Identifier: Apache-2.0
// An environment prefiltered for surfaces of every roughness: what shaders look up instead of
// integrating.
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

/// The unit direction (world) in which the middle of a texel is seen from the centre of the cube.
glm::vec3 cubeDirection(int face, int x, int y, int size);

/// The roughness that level i of n is filtered for: from 0 to 1, in steps that grow. The inverse,
/// i = (n - 1) * roughness * (1.4 - 0.4 * roughness), stands in shaders/environment.glsl.
double levelRoughness(int level, int levels);

struct EnvironmentMaps {
    /// Radiance, convolved with the GGX lobe of a surface seen head-on (the split sum of Karis,
    /// "Real Shading in Unreal Engine 4", 2013): each level for its levelRoughness(), level 0 as it
    /// is. Each has half the size of the one before.
    std::vector<CubeMap> radiance;
    CubeMap irradiance;  ///< divided by pi
};

/// What arrives from one of `count` directions that are spread evenly: the mean around it, so that
/// small bright lights count for what they are.
class EnvironmentSamples {
  public:
    EnvironmentSamples(const Environment& environment, int count);
    /// `direction` is where it comes from, unit, world.
    glm::vec3 radiance(const glm::dvec3& direction) const;

  private:
    Environment coarse_;
};

/// The same numbers whatever the number of threads. A white environment gives exactly white maps,
/// up to rounding.
EnvironmentMaps prefilter(const Environment& environment);

}  // namespace peeler
