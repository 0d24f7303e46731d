// SPDX-License-Identifier: Apache-2.0
// The lights, environment and shadows of a scene as shader resources.
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
/// lobe table. A scene without an environment needs none of them, since shaders compute the
/// built-in light themselves; but it has the albedo table if one of its materials has a sheen.
class EnvironmentTextures {
  public:
    /// Uploads the textures needed. An environment is prefiltered, unless it is the built-in studio
    /// without rotation: its maps are embedded in the program, like the tables (constants.h).
    /// Throws Error (kMemory) if the driver has no room.
    EnvironmentTextures(const gl::Functions& gl, const Scene& scene);

    /// Whether the scene has an environment of its own.
    bool present() const { return static_cast<bool>(radiance_); }
    /// Binds the textures from PEELER_ENVIRONMENT_UNIT on.
    void bind() const;

  private:
    const gl::Functions& gl_;
    gl::Texture radiance_, irradiance_, albedo_, lobes_;
    gl::SamplerObject linear_;
};

/// Midpoint shadow maps for every directional and spot light: the depth midway between the two
/// surfaces nearest to the light (midpoints() of core/image/statistics.h; a use of depth peeling
/// from Everitt, "Interactive Order-Independent Transparency", 2001, section 4). Points farther
/// than that are in shadow. A lit surface lies in front of the midpoint by half the distance to the
/// next surface, so no bias is needed. OPAQUE and MASK surfaces cast shadows, with both faces;
/// BLEND and transmissive surfaces do not. Point lights cast no shadows.
struct ShadowMaps {
    struct Map {
        int layer = -1;  ///< index in the texture array; −1 = the light casts no shadows
        View view;
    };

    int size = 0;           ///< texels per side
    ClipVolume clip;        ///< the volume that shadow casters were clipped to
    std::vector<Map> maps;  ///< per light
    gl::Texture texture;    ///< an array of R32F layers, rows top to bottom; empty without shadow
                            ///< casters
};

/// A storage buffer with one record per light, in camera space.
class Lighting {
  public:
    Lighting(const gl::Functions& gl, const PosedScene& posed);

    /// Takes the lights of the same scene in another pose.
    void setPose(const PosedScene& posed) { lights_ = placedLights(posed); }

    /// Sets the shadow maps, from the next setView() on; they must outlive their use. Null: no
    /// shadows.
    void setShadows(const ShadowMaps* shadows) { shadows_ = shadows; }

    const std::vector<PlacedLight>& lights() const { return lights_; }
    /// Whether the scene has lights of its own; the built-in key light is off then, and the
    /// built-in environment dimmed.
    bool punctual() const { return punctual_; }
    /// Whether the scene has an environment of its own, replacing everything built-in.
    bool environment() const { return environment_.present(); }
    /// Whether some of the lights cast shadows.
    bool shadowed() const { return shadows_ && shadows_->texture; }

    /// Uploads the records, including those of shadow maps. The GPU must not be using them.
    void setView(const glm::dmat4& camera_to_world);
    /// Binds the records as PEELER_LIGHTS, the environment textures, and any shadow maps.
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
