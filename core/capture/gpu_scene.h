// SPDX-License-Identifier: Apache-2.0
// The uploaded scene.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "core/capture/gpu_geometry.h"
#include "core/gl/context.h"
#include "core/gl/objects.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// A material's record and the textures it binds, by unit (PEELER_BASE_COLOR_UNIT …).
struct GpuMaterial {
    struct Binding {
        GLuint texture = 0, sampler = 0;
    };
    Binding bindings[kMaterialTextures];
    bool unlit = false, double_sided = false;
    unsigned features = 0;  ///< what its shader needs, a bit for each of materialFeatures()
    glm::uvec4 flags{};     ///< of its record
};

/// Geometry, textures with mipmaps, and material records.
class GpuScene {
  public:
    /// Throws Error (kMemory) if the driver has no room, (kInput) if an image is larger than it
    /// takes or the scene has 2^32 primitives or more.
    GpuScene(const gl::Context& context, const PosedScene& posed);

    /// Shows the same scene in another pose. The GPU must not be using it.
    void setPose(const PosedScene& posed);

    const PosedScene& posed() const { return posed_; }
    const GpuGeometry& geometry() const { return geometry_; }
    const std::vector<GpuMaterial>& materials() const { return materials_; }
    /// Binds a material's record as PEELER_MATERIAL_BLOCK.
    void bindMaterialRecord(std::size_t material) const;

  private:
    void uploadMaterials(const gl::Context& context);

    PosedScene posed_;
    GpuGeometry geometry_;
    gl::Buffer material_records_;
    std::vector<gl::Texture> textures_;
    std::vector<gl::SamplerObject> samplers_;
    std::vector<GpuMaterial> materials_;
};

}  // namespace peeler
