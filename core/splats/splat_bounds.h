// SPDX-License-Identifier: Apache-2.0
// The extent of Gaussian splats.
#pragma once

#include <optional>

#include <peeler/scene.h>
#include "core/scene/posed_scene.h"

namespace peeler {

/// Returns the box of all splats to three standard deviations, in world space; nullopt if there are
/// none.
std::optional<Bounds> splatBounds(const PosedScene& posed);

}  // namespace peeler
