// SPDX-License-Identifier: Apache-2.0
// What a band's fragments are captured into: storage buffers, and list heads as a render target.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <peeler/capture_settings.h>
#include <peeler/layered_image.h>
#include <peeler/window.h>
#include "core/gl/context.h"
#include "core/gl/objects.h"

namespace peeler {

/// For layers: per pixel a list head; per fragment its key and what is stored of it, side by side
/// (shaders/stored_fragments.glsl). For a composite: per pixel a list head, a count, a depth, two
/// stamps and a colour in 32-bit float. Grown on demand and reused from band to band: fresh memory
/// costs more than rasterising into it.
class BandBuffers {
  public:
    explicit BandBuffers(const gl::Functions& gl) : gl_(gl) {}

    /// Words of one fragment in these buffers: depth, primitive, colour.
    static std::size_t fragmentWords(std::size_t color_bytes) {
        return 2 + color_bytes / sizeof(std::uint32_t);
    }

    /// Bytes of one pixel of a composite.
    static std::size_t compositeBytes(bool tinted) {
        return 5 * sizeof(std::uint32_t) + storedComponents(tinted) * sizeof(float);
    }

    void reserveListHeads(std::size_t pixels) {
        reserve(list_heads_, pixels * sizeof(std::uint32_t));
    }
    void reserveFragments(std::size_t words) { reserve(fragments_, words * sizeof(std::uint32_t)); }
    /// Room for what channels.frag yields, all 0.
    void clearForChannels(std::size_t floats) {
        reserve(channels_, floats * sizeof(float));
        channels_.clearToZero(floats * sizeof(float));
    }
    /// Room for the boundary of a clip mesh: of each pixel where its surfaces begin, and one more.
    void reserveClip(std::span<const std::uint32_t> first);
    /// Room for a composite of so many pixels: the counts are these, all else is 0. `tinted`: with
    /// coloured opacity.
    void clearForComposite(std::span<const std::uint32_t> counts, bool tinted);
    /// Frees all.
    void free() {
        for (gl::Buffer* buffer : {&list_heads_, &fragments_, &depths_, &stamps_, &colors_,
                                   &counts_, &clip_first_, &clip_depths_, &channels_})
            *buffer = {};
    }
    /// Binds all at their PEELER_ binding points, for layers or for a composite.
    void bindForLayers();
    void bindForComposite();

    const gl::Buffer& listHeads() const { return list_heads_; }
    const gl::Buffer& fragments() const { return fragments_; }
    const gl::Buffer& depths() const { return depths_; }
    const gl::Buffer& colors() const { return colors_; }
    const gl::Buffer& channels() const { return channels_; }

  private:
    void reserve(gl::Buffer& buffer, std::size_t bytes) {
        if (buffer && buffer.size() >= bytes) return;
        buffer = {};  // free first: never hold both
        buffer = gl::Buffer(gl_, bytes);
    }

    void bindClip();

    const gl::Functions& gl_;
    gl::Buffer list_heads_, fragments_, channels_;  // of layers
    gl::Buffer depths_, stamps_, colors_, counts_;  // of a composite, and the list heads
    gl::Buffer clip_first_, clip_depths_;
};

/// Where a driver's fragment shaders can read what they are about to overwrite
/// (GL_EXT_shader_framebuffer_fetch), a pixel's list head needs no atomic counter in a storage
/// buffer; on llvmpipe those are the most expensive instruction there is. Values go in and out row
/// by row, y down, like all arrays of a band.
class ListHeadTarget {
  public:
    static bool supported(const gl::Context& context);
    /// Bytes for a raster tile of so many pixels.
    static std::uint64_t bytes(std::uint64_t tile_pixels) {
        return tile_pixels * sizeof(std::uint32_t);
    }

    void free();

    /// Sets the list heads of `area`, of which `values` has those of `band` around it; empty: 0.
    /// Allocates for the tile first, if it must.
    void write(const gl::Functions& gl, const Window& tile, const Window& area, const Window& band,
               std::span<const std::uint32_t> values);
    /// Reads the list heads of `area` into those of `band`. Waits for the GPU.
    void read(const gl::Functions& gl, const Window& tile, const Window& area, const Window& band,
              std::span<std::uint32_t> values);

    GLuint framebuffer() const { return framebuffer_.name(); }
    GLuint texture() const { return texture_.name(); }

  private:
    void reserve(const gl::Functions& gl, int tile_width, int tile_height);

    gl::Texture texture_;
    gl::Framebuffer framebuffer_;
    int width_ = 0, height_ = 0;
    std::vector<std::uint32_t> rows_;  ///< of an area, y up
};

/// The nearest opaque fragment of every pixel of a raster tile: render targets with a depth buffer,
/// so that what is behind what has been drawn is not shaded (shaders/opaque.frag).
class OpaqueTarget {
  public:
    /// Words of a pixel as they are read: depth (0 = there is none), key, colour.
    static std::size_t words(PixelType color) { return color == PixelType::kFloat ? 8 : 4; }
    /// Bytes for a raster tile of so many pixels.
    static std::uint64_t bytes(std::uint64_t tile_pixels, PixelType color) {
        return tile_pixels * (sizeof(float) + words(color) * sizeof(std::uint32_t));
    }

    void free() { *this = {}; }

    /// (Re)allocates for a tile.
    void reserve(const gl::Functions& gl, const Window& tile, PixelType color);
    /// Empties what the scissor of `state` shows, which must be that of its framebuffer.
    void clear(const gl::Functions& gl, gl::PassState state) const;
    /// Reads the pixels of `area`, row by row, y up. Waits for the GPU.
    void read(const gl::Functions& gl, const Window& tile, const Window& area,
              std::vector<std::uint32_t>& pixels);
    /// Makes it what passes with GeometryPass::in_front read.
    void bindForReading(const gl::Functions& gl) const;

    GLuint framebuffer() const { return framebuffer_.name(); }
    GLuint depth() const { return depth_.name(); }

  private:
    gl::Texture depth_, fragments_, colors_;  // the last one of float colours alone
    gl::Framebuffer framebuffer_;
    Window size_;
    PixelType color_ = PixelType::kHalf;
};

}  // namespace peeler
