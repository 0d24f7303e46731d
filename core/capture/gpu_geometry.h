// SPDX-License-Identifier: Apache-2.0
// Vertices and indices in the GPU's memory.
#pragma once

#include <span>
#include <vector>

#include "core/capture/screen_bounds.h"
#include "core/gl/objects.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// One buffer for what never changes, one for deformed vertices, a vertex array object a geometry.
class GpuGeometry {
  public:
    /// Throws Error (kMemory) if the driver has no room.
    GpuGeometry(const gl::Functions& gl, const PosedScene& posed);

    /// Takes the deformed vertices of another moment of the same scene. The GPU must not be using
    /// them.
    void setDeformed(const PosedScene& posed);

    GLuint vertexArray(const Draw& draw) const { return slots_[draw.geometry].vertex_array.name(); }
    /// Around its vertices, in mesh space.
    const Box& box(const Draw& draw) const { return slots_[draw.geometry].box; }
    /// Bytes into the element buffer.
    std::size_t indexOffset(const Draw& draw) const { return slots_[draw.geometry].index_offset; }

  private:
    struct Slot {
        gl::VertexArray vertex_array;
        std::size_t index_offset = 0;
        std::size_t deformed_offset = 0;
        Box box{};
    };

    std::vector<Slot> slots_;  ///< of each geometry
    gl::Buffer fixed_, deformed_;
};

}  // namespace peeler
