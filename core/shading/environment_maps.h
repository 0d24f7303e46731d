// SPDX-License-Identifier: Apache-2.0
// What shaders look up instead of integrating: an environment prefiltered for surfaces of every
// roughness, and how much a lobe reflects in all.
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

/// The built-in studio, with what metal and glass can reflect: a large soft box and smaller ones, a
/// floor, a horizon, and a dark side. A white surface that faces the key light comes out at 1.2,
/// one that looks up at 1.1, one that faces a viewer in front at 0.7. Without a hash. Calculated
/// when peeler is built; what runs takes embeddedStudio().
Environment studioEnvironment();
// Every edge is several pixels wide, so that more of them would show no more.
inline constexpr int kStudioWidth = 256, kStudioHeight = 128;

/// The same numbers whatever the number of threads. A white environment gives exactly white maps,
/// up to rounding.
EnvironmentMaps prefilter(const Environment& environment);

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
