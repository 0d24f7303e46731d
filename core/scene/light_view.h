// SPDX-License-Identifier: Apache-2.0
// The picture that a light takes of the scene.
#pragma once

#include <optional>

#include "core/scene/lights.h"
#include "core/scene/posed_scene.h"
#include "core/scene/view.h"

namespace peeler {

/// The half angle, in radians, within which a spot light of wider cone sees, and casts shadows: a
/// half space has no perspective picture.
inline constexpr double kWidestCone = 1.4835298641951802;  // 85 degrees

/// Camera and projection of a light; its name is "light:" and the light's. Directional:
/// orthographic, fitted to the vertices in all three directions with a margin of 1 %. Spot:
/// perspective, square, the outer cone inscribed; near 1e-5 of how far the scene reaches, no far
/// plane. Width, height and crop are the caller's to set.
/// Nothing for a point light, which shines all around, and for a scene without vertices.
std::optional<View> lightView(const PlacedLight& light, const PosedScene& posed);

}  // namespace peeler
