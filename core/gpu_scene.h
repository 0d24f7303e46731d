// SPDX-License-Identifier: Apache-2.0
// The uploaded scene and its draw list.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "core/gl/context.h"
#include "core/gl/objects.h"
#include "core/scene.h"

namespace peeler {

/// One primitive of one node, ready to be drawn.
struct GpuDraw {
    std::size_t vertex_array = 0;  ///< index into GpuScene::vertexArrays()
    GLenum mode = GL_TRIANGLES;
    GLsizei count = 0;  ///< indices, or vertices if not indexed
    bool indexed = false;
    std::size_t index_offset = 0;  ///< bytes into the element buffer
    std::size_t material = 0;
    int node = 0;
    glm::dmat4 world{1};
    bool mirrored = false;              ///< negative scale: front faces are clockwise
    std::uint32_t first_primitive = 0;  ///< key of its first primitive; keys start at 1
    std::uint32_t flags = 0;            ///< PEELER_HAS_NORMALS …
    bool opaque = false;                ///< OPAQUE or MASK, and no light passes through
    bool alpha_tested = false;          ///< some of its fragments may be rejected by alpha
    bool textured_alpha = false;        ///< … and a texture decides
};

/// A material's record and the textures it binds, by unit (PEELER_BASE_COLOR_UNIT …).
struct GpuMaterial {
    struct Binding {
        GLuint texture = 0, sampler = 0;
    };
    Binding bindings[kMaterialTextures];
    bool textured = false, unlit = false, double_sided = false;
    unsigned features = 0;  ///< what its shader needs, a bit for each of materialFeatures()
};

/// Geometry in one buffer, one vertex array object a primitive, textures with mipmaps, material
/// records. The draw list is in draw order: depth-first over the nodes, then primitive.
class GpuScene {
  public:
    /// Throws Error (kMemory) if the driver has no room, (kInput) if an image is larger than it
    /// takes or the scene has 2^32 primitives or more.
    GpuScene(const gl::Context& context, const Scene& scene, const SceneContents& contents);

    const std::vector<GpuDraw>& draws() const { return draws_; }
    const std::vector<GpuMaterial>& materials() const { return materials_; }
    GLuint vertexArray(const GpuDraw& draw) const {
        return vertex_arrays_[draw.vertex_array].name();
    }
    /// Binds a material's record as PEELER_MATERIAL_BLOCK.
    void bindMaterialRecord(std::size_t material) const;

  private:
    void uploadGeometry(const gl::Functions& gl, const Scene& scene, const SceneContents& contents);
    void uploadMaterials(const gl::Context& context, const Scene& scene,
                         const SceneContents& contents);

    gl::Buffer geometry_, material_records_;
    std::vector<gl::VertexArray> vertex_arrays_;
    std::vector<gl::Texture> textures_;
    std::vector<gl::SamplerObject> samplers_;
    std::vector<GpuMaterial> materials_;
    std::vector<GpuDraw> draws_;
};

}  // namespace peeler
