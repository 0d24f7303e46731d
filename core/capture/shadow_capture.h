// SPDX-License-Identifier: Apache-2.0
// Midpoint shadow maps, from layers that the renderer captures from the lights.
#pragma once

#include <vector>

#include <peeler/capture_settings.h>
#include "core/capture/gl_renderer.h"
#include "core/gl/context.h"
#include "core/scene/lights.h"
#include "core/shading/lighting.h"

namespace peeler {

/// Captures the shadow maps of directional and spot lights with `renderer`. `settings` gives the
/// maps' size and the memory budget. Throws like GlRenderer, and Error (kUsage) if the device does
/// not support textures of this size, (kInput) if there are too many maps for a texture array,
/// (kMemory) if the maps alone exceed the budget.
ShadowMaps captureShadowMaps(GlRenderer& renderer, const gl::Context& context,
                             const std::vector<PlacedLight>& lights,
                             const CaptureSettings& settings);

}  // namespace peeler
