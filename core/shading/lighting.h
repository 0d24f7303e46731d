// SPDX-License-Identifier: Apache-2.0
// The lights, environment and shadows of a scene, as shader resources.
#pragma once

#include <vector>

#include <peeler/clip.h>
#include <peeler/scene.h>
#include <peeler/view.h>
#include "core/gl/objects.h"
#include "core/scene/lights.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// Textures of a scene's own environment: two cube maps (prefilter()), the albedo table and the
/// lobe table. Without an environment, shaders compute the built-in light and need at most the
/// albedo table, for materials with a sheen.
class EnvironmentTextures {
  public:
    /// Uploads the necessary textures. Prefilters the environment, except for the built-in studio
    /// without rotation: its maps are embedded in the program, like the tables (constants.h).
    /// Throws Error (kMemory) if the driver runs out of memory.
    EnvironmentTextures(const gl::Functions& gl, const Scene& scene);

    /// Whether the scene has an environment of its own.
    bool present() const { return static_cast<bool>(radiance_); }
    /// Binds the textures, from unit PEELER_ENVIRONMENT_UNIT on.
    void bind() const;

  private:
    const gl::Functions& gl_;
    gl::Texture radiance_, irradiance_, albedo_, lobes_;
    gl::SamplerObject linear_;
};

/// Midpoint shadow maps for every directional and spot light: the depth midway between the two
/// surfaces nearest to the light (midpoints() in core/image/statistics.h; a use of depth peeling
/// from Everitt, "Interactive Order-Independent Transparency", 2001, section 4). Points beyond this
/// depth are in shadow. A lit surface lies in front of the midpoint by half the distance to the
/// next surface, so no bias is needed. OPAQUE and MASK surfaces cast shadows, with both faces;
/// BLEND and transmissive surfaces do not. Point lights cast no shadows.
struct ShadowMaps {
    struct Map {
        int layer = -1;  ///< index in the texture array; −1: the light casts no shadows
        View view;
    };

    int size = 0;           ///< texels per side
    ClipVolume clip;        ///< volume that shadow casters were clipped to
    std::vector<Map> maps;  ///< one map per light
    /// Array of R32F layers with rows from top to bottom. Empty if no light casts shadows.
    gl::Texture texture;
};

/// A storage buffer with one record per light, in camera space.
class Lighting {
  public:
    Lighting(const gl::Functions& gl, const PosedScene& posed);

    /// Sets the lights to those of another pose of the same scene.
    void setPose(const PosedScene& posed) { lights_ = placedLights(posed); }

    /// Sets the shadow maps for later setView() calls; null means no shadows. The maps must exist
    /// as long as they are set.
    void setShadows(const ShadowMaps* shadows) { shadows_ = shadows; }

    const std::vector<PlacedLight>& lights() const { return lights_; }
    /// Whether the scene has lights of its own. If so, the built-in key light is off and the
    /// built-in environment is dimmed.
    bool punctual() const { return punctual_; }
    /// Whether the scene has an environment of its own, which replaces all built-in light.
    bool environment() const { return environment_.present(); }
    /// Whether any light casts shadows.
    bool shadowed() const { return shadows_ && shadows_->texture; }

    /// Uploads the records, including the shadow maps' transforms. The GPU must have finished all
    /// work that uses the old records.
    void setView(const glm::dmat4& camera_to_world);
    /// Binds the records as PEELER_LIGHTS, the environment textures, and the shadow maps, if any.
    void bind() const;

  private:
    const gl::Functions& gl_;
    std::vector<PlacedLight> lights_;
    bool punctual_ = false;
    EnvironmentTextures environment_;
    const ShadowMaps* shadows_ = nullptr;
    gl::Buffer records_;
};

}  // namespace peeler
