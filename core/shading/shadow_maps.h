// SPDX-License-Identifier: Apache-2.0
// Midpoint shadow maps: what the lights see, captured with the renderer's own layers.
#pragma once

#include <vector>

#include "core/capture/capture_settings.h"
#include "core/gl/context.h"
#include "core/gl/objects.h"
#include "core/scene/lights.h"
#include "core/scene/posed_scene.h"
#include "core/scene/view.h"

namespace peeler {

class Renderer;

/// For every directional and spot light a map of the depth midway between the two surfaces nearest
/// to it (core/image/midpoint.h; the use of depth peeling that Everitt names, "Interactive
/// Order-Independent Transparency", 2001, section 4). What is farther than that is in shadow. A lit
/// surface lies in front of the midpoint by half its distance from the next, so nothing needs a
/// bias. OPAQUE and MASK surfaces cast shadows, with both faces; those
/// of BLEND materials and those that transmit light do not. Point lights
/// cast none.
class ShadowMaps {
  public:
    struct Map {
        int layer = -1;  ///< of the texture array; −1 = the light casts no shadows
        View view;
    };

    ShadowMaps() = default;
    /// Captures them through `renderer`, whose last plan is forgotten. `settings` say how large
    /// they are and how much memory there is.
    /// Throws Error (kUsage) if the device takes no textures of this size, (kInput) if it takes no
    /// array of so many, (kMemory) if they alone pass the budget, and what Renderer throws.
    ShadowMaps(Renderer& renderer, const gl::Context& context,
               const std::vector<PlacedLight>& lights, const PosedScene& posed,
               const CaptureSettings& settings);

    /// Texels a side; 0 = there are none.
    int size() const { return size_; }
    /// What the casters were clipped to.
    const ClipVolume& clip() const { return clip_; }
    const Map& of(std::size_t light) const { return maps_[light]; }
    /// An array of R32F layers, rows top to bottom; 0 if no light casts shadows.
    GLuint texture() const { return texture_.name(); }

  private:
    int size_ = 0;
    ClipVolume clip_;
    std::vector<Map> maps_;
    gl::Texture texture_;
};

}  // namespace peeler
