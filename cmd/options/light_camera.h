// SPDX-License-Identifier: Apache-2.0
// --camera light:NAME: a light of the scene as the camera.
#pragma once

#include <string>

#include "core/scene/posed_scene.h"
#include "core/scene/view.h"

namespace peeler::cmd {

/// Whether `camera` (the value of --camera) names a light rather than a camera.
bool namesLight(const std::string& camera);

/// What the light sees (lightView in core/scene/light_view.h): the projection as tight as that, the
/// size not set. NAME is the light's, its node's, or an index in draw order; "key" is the built-in
/// light of a scene without any. Throws Error (kUsage) for an unknown light, with the list, and for
/// a point light; (kInput) if there is nothing to fit a view to.
View lightCamera(const PosedScene& posed, const std::string& camera);

}  // namespace peeler::cmd
