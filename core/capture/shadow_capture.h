// SPDX-License-Identifier: Apache-2.0
// Midpoint shadow maps: what the lights see, captured with the renderer's own layers.
#pragma once

#include <vector>

#include <peeler/capture_settings.h>
#include "core/capture/gl_renderer.h"
#include "core/gl/context.h"
#include "core/scene/lights.h"
#include "core/shading/lighting.h"

namespace peeler {

/// Captures what directional and spot lights see through `renderer`. `settings` say how large the
/// maps are and how much memory there is. Throws Error (kUsage) if the device takes no textures of
/// this size, (kInput) if it takes no array of so many, (kMemory) if they alone pass the budget,
/// and what GlRenderer throws.
ShadowMaps captureShadowMaps(GlRenderer& renderer, const gl::Context& context,
                             const std::vector<PlacedLight>& lights,
                             const CaptureSettings& settings);

}  // namespace peeler
