// SPDX-License-Identifier: Apache-2.0
// The capture buffers of a band: storage buffers, and a render target for list heads.
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

/// The buffers of a band. For layers: one list head per pixel and, interleaved, the key and stored
/// data of each fragment (shaders/stored_fragments.glsl). For a composite, per pixel: a list head,
/// a count, a depth, two stamps and a 32-bit float colour. Buffers grow on demand and are reused
/// between bands, because touching fresh memory costs more than rasterising into it.
class BandBuffers {
  public:
    explicit BandBuffers(const gl::Functions& gl) : gl_(gl) {}

    /// Returns the number of 32-bit words per fragment: depth, primitive, colour.
    static std::size_t fragmentWords(std::size_t color_bytes) {
        return 2 + color_bytes / sizeof(std::uint32_t);
    }

    /// Returns the bytes per pixel of a composite.
    static std::size_t compositeBytes(bool tinted) {
        return 5 * sizeof(std::uint32_t) + storedComponents(tinted) * sizeof(float);
    }

    void reserveListHeads(std::size_t pixels) {
        reserve(list_heads_, pixels * sizeof(std::uint32_t));
    }
    void reserveFragments(std::size_t words) { reserve(fragments_, words * sizeof(std::uint32_t)); }
    /// Reserves room for the output of channels.frag and clears it to 0.
    void clearForChannels(std::size_t floats) {
        reserve(channels_, floats * sizeof(float));
        channels_.clearToZero(floats * sizeof(float));
    }
    /// Reserves room for the boundary of a clip mesh. `first` holds the index of each pixel's first
    /// surface and, as its last element, the total number of surfaces.
    void reserveClip(std::span<const std::uint32_t> first);
    /// Reserves room for a composite. Sets the counts and clears everything else to 0. `tinted`:
    /// whether opacity is coloured.
    void clearForComposite(std::span<const std::uint32_t> counts, bool tinted);
    /// Reserves room for a band's sorted layers and sets their offsets. `color_bytes`: stored bytes
    /// of colour per fragment.
    void reserveLayers(std::span<const std::uint32_t> offsets, std::size_t color_bytes);
    void free() {
        for (gl::Buffer* buffer : {&list_heads_, &fragments_, &depths_, &stamps_, &colors_,
                                   &counts_, &clip_first_, &clip_depths_, &channels_,
                                   &layer_offsets_, &layer_counts_, &layer_depths_, &layer_colors_})
            *buffer = {};
    }
    /// Bind all buffers at their PEELER_ binding points, for layers, for sort_lists.comp, or for a
    /// composite.
    void bindForLayers();
    void bindForSorting();
    void bindForComposite();

    const gl::Buffer& listHeads() const { return list_heads_; }
    const gl::Buffer& fragments() const { return fragments_; }
    const gl::Buffer& depths() const { return depths_; }
    const gl::Buffer& colors() const { return colors_; }
    const gl::Buffer& channels() const { return channels_; }
    const gl::Buffer& layerOffsets() const { return layer_offsets_; }
    const gl::Buffer& layerCounts() const { return layer_counts_; }
    const gl::Buffer& layerDepths() const { return layer_depths_; }
    const gl::Buffer& layerColors() const { return layer_colors_; }

  private:
    void reserve(gl::Buffer& buffer, std::size_t bytes) { gl::reserve(gl_, buffer, bytes); }

    void bindClip();

    const gl::Functions& gl_;
    gl::Buffer list_heads_, fragments_, channels_;  // used for layers
    // Used for composites, together with list_heads_.
    gl::Buffer depths_, stamps_, colors_, counts_;
    gl::Buffer clip_first_, clip_depths_;
    gl::Buffer layer_offsets_, layer_counts_, layer_depths_, layer_colors_;  // sorted layers
};

/// A render target of list heads, for drivers whose fragment shaders can read the pixel that they
/// overwrite (GL_EXT_shader_framebuffer_fetch). List heads in a render target need no atomic
/// counters, which are the most expensive instructions on llvmpipe. Values are transferred row by
/// row, y down, like all arrays of a band.
class ListHeadTarget {
  public:
    static bool supported(const gl::Context& context);
    /// Returns the bytes for a raster tile with this many pixels.
    static std::uint64_t bytes(std::uint64_t tile_pixels) {
        return tile_pixels * sizeof(std::uint32_t);
    }

    void free();

    /// Sets the list heads of `area` from `values`, or to 0 if `values` is empty. `values` has one
    /// entry per pixel of `band`, which contains `area`. Allocates the tile's texture first if
    /// necessary.
    void write(const gl::Functions& gl, const Window& tile, const Window& area, const Window& band,
               std::span<const std::uint32_t> values);
    /// Reads the list heads of `area` into `values`, which has one entry per pixel of `band`. Waits
    /// for the GPU.
    void read(const gl::Functions& gl, const Window& tile, const Window& area, const Window& band,
              std::span<std::uint32_t> values);

    GLuint framebuffer() const { return framebuffer_.name(); }
    GLuint texture() const { return texture_.name(); }

  private:
    void reserve(const gl::Functions& gl, int tile_width, int tile_height);

    gl::Texture texture_;
    gl::Framebuffer framebuffer_;
    int width_ = 0, height_ = 0;
    std::vector<std::uint32_t> rows_;  ///< list heads of an area, row by row, y up
};

/// A render target that captures the nearest opaque fragment of every pixel of a raster tile. It
/// has a depth buffer, so that hidden fragments are not shaded (shaders/opaque.frag). gl::clear()
/// leaves float colours, which are read only where the depth is not 0.
class OpaqueTarget {
  public:
    /// Returns the number of 32-bit words per pixel in read(): depth (0 = no fragment), key,
    /// colour.
    static std::size_t words(PixelType color) { return color == PixelType::kFloat ? 8 : 4; }
    /// Returns the bytes for a raster tile with this many pixels.
    static std::uint64_t bytes(std::uint64_t tile_pixels, PixelType color) {
        return tile_pixels * (sizeof(float) + words(color) * sizeof(std::uint32_t));
    }

    void free() { *this = {}; }

    /// Allocates the targets for a tile if its size or the colour type has changed.
    void reserve(const gl::Functions& gl, const Window& tile, PixelType color);
    /// Reads the pixels of `area`, row by row, y up. Waits for the GPU.
    void read(const gl::Functions& gl, const Window& tile, const Window& area,
              std::vector<std::uint32_t>& pixels);
    /// Binds the opaque fragments for passes with GeometryPass::in_front.
    void bindForReading(const gl::Functions& gl) const;

    GLuint framebuffer() const { return framebuffer_.name(); }
    GLuint depth() const { return depth_.name(); }

  private:
    gl::Texture depth_, fragments_, colors_;  // colors_ exists only for float colours
    gl::Framebuffer framebuffer_;
    Window size_;
    PixelType color_ = PixelType::kHalf;
};

}  // namespace peeler
