// SPDX-License-Identifier: Apache-2.0
// The lights of a scene as the shaders see them.
#pragma once

#include <vector>

#include "core/gl/objects.h"
#include "core/scene/lights.h"
#include "core/scene/posed_scene.h"
#include "core/shading/environment_textures.h"
#include "core/shading/shadow_maps.h"

namespace peeler {

/// A storage buffer with a record for every light, in the space of the camera.
class Lighting {
  public:
    Lighting(const gl::Functions& gl, const PosedScene& posed);

    /// Takes the lights of the same scene in another pose, and forgets the shadow maps.
    void setPose(const PosedScene& posed);

    /// Makes the shadow maps that `settings` ask for unless they are there already; without, light
    /// goes through everything. `renderer` is used for that, and its last plan forgotten.
    void castShadows(Renderer& renderer, const gl::Context& context,
                     const CaptureSettings& settings);

    const std::vector<PlacedLight>& lights() const { return lights_; }
    /// The scene has lights of its own; the built-in key light is off then, and the built-in
    /// environment dimmed.
    bool punctual() const { return punctual_; }
    /// The scene has an environment of its own, in place of everything built-in.
    bool environment() const { return environment_.present(); }
    /// Some of the lights cast shadows.
    bool shadowed() const { return shadowed_; }

    /// Uploads the records, shadow maps included. The GPU must not be using them.
    void setView(const glm::dmat4& camera_to_world);
    /// Binds the records as PEELER_LIGHTS and the shadow maps.
    void bind() const;

  private:
    const gl::Functions& gl_;
    PosedScene posed_;
    std::vector<PlacedLight> lights_;
    bool punctual_ = false, shadowed_ = false;
    EnvironmentTextures environment_;
    ShadowMaps maps_;
    gl::Buffer records_;
};

}  // namespace peeler
