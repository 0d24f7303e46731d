// SPDX-License-Identifier: Apache-2.0
// The slots of a raster tile's pixels as a render target.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/window.h"
#include "core/gl/context.h"
#include "core/gl/objects.h"

namespace peeler {

/// Where a driver's fragment shaders can read what they are about to overwrite
/// (GL_EXT_shader_framebuffer_fetch), a pixel's slot needs no atomic counter in a storage buffer;
/// on llvmpipe those are the most expensive instruction there is. Values go in and out row by row,
/// y down, like all arrays of a band.
class SlotTarget {
  public:
    static bool supported(const gl::Context& context);
    /// Bytes for a raster tile of so many pixels.
    static std::uint64_t bytes(std::uint64_t tile_pixels) {
        return tile_pixels * sizeof(std::uint32_t);
    }

    void free();

    /// Sets the slots of `area`, of which `values` has those of `band` around it; empty: 0.
    /// Allocates for the tile first, if it must.
    void write(const gl::Functions& gl, const Window& tile, const Window& area, const Window& band,
               std::span<const std::uint32_t> values);
    /// Reads the slots of `area` into those of `band`. Waits for the GPU.
    void read(const gl::Functions& gl, const Window& tile, const Window& area, const Window& band,
              std::span<std::uint32_t> values);

    GLuint framebuffer() const { return framebuffer_.name(); }

  private:
    void reserve(const gl::Functions& gl, int tile_width, int tile_height);

    gl::Texture texture_;
    gl::Framebuffer framebuffer_;
    int width_ = 0, height_ = 0;
    std::vector<std::uint32_t> rows_;  ///< of an area, y up
};

}  // namespace peeler
