// SPDX-License-Identifier: Apache-2.0
// Placed lights, and the views that they cast shadows with.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include <peeler/view.h>
#include "core/scene/posed_scene.h"

namespace peeler {

struct PlacedLight {
    std::string name;       ///< its own, else its node's, else "light N" in draw order
    std::string node_name;  ///< may be empty
    Light light;
    glm::dmat4 to_world{1};  ///< rotation and translation; the light shines along −Z
};

/// Returns the lights of the nodes, in draw order; the built-in key light (directional, named
/// "key", above, left and in front) if the scene has neither lights nor an environment. Throws
/// Error (kInput) if a node's matrix leaves a light without a position or direction.
std::vector<PlacedLight> placedLights(const PosedScene& posed);

/// The largest half angle, in radians, of a spot light's view and shadows. It is limited because a
/// half space has no perspective projection.
inline constexpr double kWidestCone = 1.4835298641951802;  // 85 degrees

/// Returns the camera and projection of a light, named "light:" plus the light's name. Directional:
/// orthographic, fitted to the vertices in all three directions with a margin of 1 %. Spot:
/// perspective, square, with the outer cone inscribed; near plane at 1e-5 of the scene's reach, no
/// far plane. The caller sets width, height and crop. Returns nothing for a point light, which
/// shines all around, and for a scene without vertices.
std::optional<View> lightView(const PlacedLight& light, const PosedScene& posed);

}  // namespace peeler
