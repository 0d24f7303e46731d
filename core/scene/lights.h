// SPDX-License-Identifier: Apache-2.0
// The lights that shine on a scene, in their places, and the picture that each takes of it.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include <peeler/view.h>
#include "core/scene/posed_scene.h"

namespace peeler {

struct PlacedLight {
    std::string name;       ///< its own, else its node's, else "light N" counting in draw order
    std::string node_name;  ///< may be empty
    Light light;
    glm::dmat4 to_world{1};  ///< rotation and translation; the light shines along −Z
};

/// The lights of the nodes, in draw order; the built-in key light (directional, named "key", above,
/// left and in front) if there are none. Throws Error (kInput) if a node's matrix leaves a light no
/// place or no direction.
std::vector<PlacedLight> placedLights(const PosedScene& posed);

/// The half angle, in radians, within which a spot light of wider cone sees, and casts shadows: a
/// half space has no perspective picture.
inline constexpr double kWidestCone = 1.4835298641951802;  // 85 degrees

/// Camera and projection of a light; its name is "light:" and the light's. Directional:
/// orthographic, fitted to the vertices in all three directions with a margin of 1 %. Spot:
/// perspective, square, the outer cone inscribed; near 1e-5 of how far the scene reaches, no far
/// plane. Width, height and crop are the caller's to set. Nothing for a point light, which shines
/// all around, and for a scene without vertices.
std::optional<View> lightView(const PlacedLight& light, const PosedScene& posed);

}  // namespace peeler
