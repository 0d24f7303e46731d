// SPDX-License-Identifier: Apache-2.0
// The render targets that peel one layer at a time: ping-ponged keys, and a colour.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "core/gl/objects.h"
#include "core/scene_rasterizer.h"

namespace peeler {

/// Two sides of (depth, primitive) textures as large as a raster tile: the layer being peeled is
/// rendered into one while the previous layer is read from the other. One colour texture serves
/// both.
class LayerTargets {
  public:
    /// From which end layers are peeled.
    struct Direction {
        std::string_view shader;   ///< compares with the previous layer and shades
        gl::DepthTest depth_test;  ///< which of the fragments beyond it is next
        float first_depth;         ///< the key before any layer
        GLuint first_primitive;
        float empty_depth;  ///< of a pixel without the layer; with primitive 0 nothing is beyond it
    };

    enum Attachments { kKey, kKeyAndColor, kColor };

    /// Bytes of all textures.
    static std::uint64_t bytes(std::uint64_t tile_pixels, bool float_color);

    /// (Re)allocates for the rasterizer's tile.
    void allocate(const SceneRasterizer& rasterizer);

    /// Peels `layers` layers of `area`, one geometry pass each, and stores them; returns the
    /// passes.
    int peel(SceneRasterizer& rasterizer, const Window& area, std::uint32_t layers,
             const Direction& direction);

    /// Sets the key of side `i` in `area`. Primitive 0 means to store(): no fragment.
    void clear(const SceneRasterizer& rasterizer, const Window& area, int i, float depth,
               GLuint primitive) const;
    GLuint framebuffer(int i, Attachments attachments) const;
    /// Makes side `i` what the shaders read as the previous layer.
    void bindForReading(const gl::Functions& gl, int i) const;
    /// Appends the layer of side `i` to the lists of the band: one fragment of every pixel of
    /// `area` that has one.
    void store(SceneRasterizer& rasterizer, const Window& area, int i) const;

  private:
    struct Side {
        gl::Texture depth, primitive;
        gl::Framebuffer key, key_and_color;
    };
    std::array<Side, 2> sides_;
    gl::Texture color_;
    gl::Framebuffer color_only_;
    Window size_;
};

}  // namespace peeler
