// SPDX-License-Identifier: Apache-2.0
// Placed lights, and their views for shadows.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include <peeler/view.h>
#include "core/scene/posed_scene.h"

namespace peeler {

struct PlacedLight {
    /// The name of the light; if it has none, the name of its node or "light N", where N counts in
    /// draw order.
    std::string name;
    std::string node_name;  ///< may be empty
    Light light;
    glm::dmat4 to_world{1};  ///< rotation and translation; the light shines along −Z
};

/// Returns the lights of the nodes, in draw order. If the scene has neither lights nor an
/// environment, returns the built-in key light (directional, named "key", from above, left and in
/// front). Throws Error (kInput) if a node's matrix gives its light no position or direction.
std::vector<PlacedLight> placedLights(const PosedScene& posed);

/// The maximum half angle, in radians, of a spot light's view and shadows. A limit is needed
/// because a perspective projection cannot show a half space.
inline constexpr double kWidestCone = 1.4835298641951802;  // 85 degrees in radians

/// Returns the camera and projection of a light, named "light:" plus the light's name. A
/// directional light has an orthographic view, fitted to the vertices in all three directions with
/// a margin of 1 %. A spot light has a square perspective view of its outer cone (at most
/// kWidestCone) with the same margin; the near plane is at 1e-5 of the farthest vertex's depth, and
/// there is no far plane. The caller sets width, height and crop. Returns nullopt for a point
/// light, which shines in all directions, and for a scene without vertices.
std::optional<View> lightView(const PlacedLight& light, const PosedScene& posed);

}  // namespace peeler
