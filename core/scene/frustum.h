// SPDX-License-Identifier: Apache-2.0
// The position of a scene relative to the sides of a view frustum.
#pragma once

#include <cstdint>
#include <optional>

#include <peeler/view.h>
#include "core/scene/framing.h"

namespace peeler {

enum class FrustumSide : std::uint8_t { kNear, kFar, kLeft, kRight, kBottom, kTop };

/// Returns a side of the frustum of the view's crop if the whole scene lies beyond this side;
/// nullopt if there is no such side.
std::optional<FrustumSide> sideBeyondWhich(const View& view, const SceneExtent& extent);

/// Whether a part of the scene lies beyond a side of the frustum of the view's crop, so that the
/// picture does not show all of the scene.
bool cutsOff(const View& view, const SceneExtent& extent);

}  // namespace peeler
