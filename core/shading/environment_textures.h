// SPDX-License-Identifier: Apache-2.0
// The environment of a scene, and the table that lobes need, as textures.
#pragma once

#include "core/gl/objects.h"
#include "core/scene/scene.h"

namespace peeler {

class EnvironmentTextures {
  public:
    /// Prefilters the scene's environment, if it has one, and computes the table if that or a
    /// material needs it. Throws Error (kMemory) if the driver has no room.
    EnvironmentTextures(const gl::Functions& gl, const Scene& scene);

    /// The scene has an environment of its own.
    bool present() const { return static_cast<bool>(radiance_); }
    /// As PEELER_ENVIRONMENT_UNIT, PEELER_IRRADIANCE_UNIT and PEELER_ALBEDO_UNIT.
    void bind() const;

  private:
    const gl::Functions& gl_;
    gl::Texture radiance_, irradiance_, albedo_;
    gl::SamplerObject linear_;
};

}  // namespace peeler
