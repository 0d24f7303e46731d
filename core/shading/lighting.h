// SPDX-License-Identifier: Apache-2.0
// The lights of a scene, its environment and its shadows as the shaders see them.
#pragma once

#include <vector>

#include <peeler/clip.h>
#include <peeler/scene.h>
#include <peeler/view.h>
#include "core/gl/objects.h"
#include "core/scene/lights.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// What surfaces reflect of a scene's own environment, as textures: two cube maps (prefilter()),
/// the albedo table and the lobe table. A scene without an environment has none of them, since the
/// shaders work out the built-in one themselves; it has the albedo table if one of its materials
/// has a sheen.
class EnvironmentTextures {
  public:
    /// Uploads what is needed. An environment is prefiltered, unless it is the built-in studio, not
    /// turned: its maps are part of the program, as the tables are (constants.h). Throws Error
    /// (kMemory) if the driver has no room.
    EnvironmentTextures(const gl::Functions& gl, const Scene& scene);

    /// The scene has an environment of its own.
    bool present() const { return static_cast<bool>(radiance_); }
    /// From PEELER_ENVIRONMENT_UNIT on.
    void bind() const;

  private:
    const gl::Functions& gl_;
    gl::Texture radiance_, irradiance_, albedo_, lobes_;
    gl::SamplerObject linear_;
};

/// For every directional and spot light a map of the depth midway between the two surfaces nearest
/// to it (midpoints() of core/image/statistics.h; the use of depth peeling that Everitt names,
/// "Interactive Order-Independent Transparency", 2001, section 4). What is farther than that is in
/// shadow. A lit surface lies in front of the midpoint by half its distance from the next, so
/// nothing needs a bias. OPAQUE and MASK surfaces cast shadows, with both faces; those of BLEND
/// materials and those that transmit light do not. Point lights cast none.
struct ShadowMaps {
    struct Map {
        int layer = -1;  ///< of the texture array; −1 = the light casts no shadows
        View view;
    };

    int size = 0;           ///< texels a side
    ClipVolume clip;        ///< what casts shadows was clipped to it
    std::vector<Map> maps;  ///< of each light
    gl::Texture texture;    ///< an array of R32F layers, rows top to bottom; none if nothing casts
};

/// A storage buffer with a record for every light, in the space of the camera.
class Lighting {
  public:
    Lighting(const gl::Functions& gl, const PosedScene& posed);

    /// Takes the lights of the same scene in another pose.
    void setPose(const PosedScene& posed) { lights_ = placedLights(posed); }

    /// The shadows that the lights cast from the next setView() on; must outlive their use. None:
    /// light goes through everything.
    void setShadows(const ShadowMaps* shadows) { shadows_ = shadows; }

    const std::vector<PlacedLight>& lights() const { return lights_; }
    /// The scene has lights of its own; the built-in key light is off then, and the built-in
    /// environment dimmed.
    bool punctual() const { return punctual_; }
    /// The scene has an environment of its own, in place of everything built-in.
    bool environment() const { return environment_.present(); }
    /// Some of the lights cast shadows.
    bool shadowed() const { return shadows_ && shadows_->texture; }

    /// Uploads the records, shadow maps included. The GPU must not be using them.
    void setView(const glm::dmat4& camera_to_world);
    /// Binds the records as PEELER_LIGHTS and the shadow maps.
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
