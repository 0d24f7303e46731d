// SPDX-License-Identifier: Apache-2.0
// The lights of a scene as the shaders see them.
#pragma once

#include <vector>

#include "core/gl/objects.h"
#include "core/lights.h"
#include "core/scene.h"
#include "shaders/interface.glsl"

namespace peeler {

/// A storage buffer with a record for every light, in the space of the camera.
class Lighting {
  public:
    Lighting(const gl::Functions& gl, const Scene& scene, const SceneContents& contents);

    const std::vector<PlacedLight>& lights() const { return lights_; }
    /// The scene has lights of its own; the built-in key light is off then, and the built-in
    /// environment dimmed.
    bool punctual() const { return punctual_; }

    /// Uploads the records. The GPU must not be using them.
    void setView(const glm::dmat4& camera_to_world);
    /// Binds the records as PEELER_LIGHTS.
    void bind() const { records_.bindStorage(PEELER_LIGHTS); }

  private:
    std::vector<PlacedLight> lights_;
    bool punctual_ = false;
    gl::Buffer records_;
};

}  // namespace peeler
