// SPDX-License-Identifier: Apache-2.0
// The uploaded scene: its geometry, its materials, and its bounds on screen.
#pragma once

#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <vector>

#include <peeler/window.h>
#include "core/gl/context.h"
#include "core/gl/objects.h"
#include "core/scene/material.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// An axis-aligned bounding box of points; inverted while empty.
struct Box {
    glm::vec3 min{std::numeric_limits<float>::infinity()};
    glm::vec3 max{-std::numeric_limits<float>::infinity()};

    bool empty() const { return !(min.x <= max.x); }
    void add(std::span<const glm::vec3> points);
};

/// Returns the window, y up, of the pixels that the box can touch in a viewport of this size. The
/// window covers every touched pixel despite the GPU's single-precision rounding, and may cover
/// more. It covers all pixels if the box extends behind the eye.
Window screenBounds(const Box& box, const glm::dmat4& clip_from_model, int width, int height);

/// Uploaded geometry: one buffer of static data, one of deformed vertices, and a vertex array
/// object per geometry.
class GpuGeometry {
  public:
    /// Throws Error (kMemory) if the driver runs out of memory.
    GpuGeometry(const gl::Functions& gl, const PosedScene& posed);

    /// Uploads the deformed vertices of another pose of the same scene. The GPU must have finished
    /// all work that uses the old vertices.
    void setDeformed(const PosedScene& posed);

    GLuint vertexArray(const Draw& draw) const {
        return geometries_[draw.geometry].vertex_array.name();
    }
    /// Returns the bounding box of the draw's vertices, in mesh space.
    const Box& box(const Draw& draw) const { return geometries_[draw.geometry].box; }
    /// Returns the draw's offset in the element buffer, in bytes.
    std::size_t indexOffset(const Draw& draw) const {
        return geometries_[draw.geometry].index_offset;
    }

  private:
    struct StoredGeometry {
        gl::VertexArray vertex_array;
        std::size_t index_offset = 0;
        std::size_t deformed_offset = 0;
        Box box{};
    };

    std::vector<StoredGeometry> geometries_;
    gl::Buffer fixed_, deformed_;
};

/// A material's record and its texture bindings, by unit (PEELER_BASE_COLOR_UNIT …).
struct GpuMaterial {
    struct Binding {
        GLuint texture = 0, sampler = 0;
    };
    Binding bindings[kMaterialTextures];
    bool unlit = false, double_sided = false;
    /// Features that the material needs, one bit for each of materialFeatures().
    unsigned features = 0;
    glm::uvec4 flags{};  ///< `flags` of the material record
};

/// Geometry, textures with mipmaps, and material records.
class GpuScene {
  public:
    /// Throws Error (kMemory) if the driver runs out of memory, (kInput) if an image exceeds the
    /// driver's limit or the scene has 2^32 primitives or more.
    GpuScene(const gl::Context& context, const PosedScene& posed);

    /// Sets another pose of the same scene. The GPU must have finished all work that uses the
    /// scene.
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
