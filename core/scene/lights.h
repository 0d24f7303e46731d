// SPDX-License-Identifier: Apache-2.0
// The lights that shine on a scene, in their places.
#pragma once

#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "core/scene/posed_scene.h"

namespace peeler {

struct PlacedLight {
    std::string name;       ///< its own, else its node's, else "light N" counting in draw order
    std::string node_name;  ///< may be empty
    Light light;
    glm::dmat4 to_world{1};  ///< rotation and translation; the light shines along −Z
};

/// The lights of the nodes, in draw order; the built-in key light (directional, named "key", above,
/// left and in front) if there are none.
/// Throws Error (kInput) if a node's matrix leaves a light no place or no direction.
std::vector<PlacedLight> placedLights(const PosedScene& posed);

}  // namespace peeler
