// SPDX-License-Identifier: Apache-2.0
// A multisampled render target: the nearest opaque triangle of every sample of a raster tile.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include <peeler/window.h>
#include "core/fragments/pixel_places.h"
#include "core/gl/objects.h"

namespace peeler {

/// A target of kPixelSamples samples per pixel, each with a depth and the key of a triangle
/// (shaders/opaque_key.frag).
class SampleTarget {
  public:
    /// Whether the driver rasterises kPixelSamples samples of every pixel at `positions`
    /// (samplePositions(), in any order).
    static bool supported(const gl::Functions& gl, std::span<const glm::dvec2> positions);
    /// Returns the bytes for a raster tile with this many pixels.
    static std::uint64_t bytes(std::uint64_t tile_pixels) {
        return tile_pixels * kPixelSamples * (sizeof(float) + sizeof(std::uint32_t));
    }

    void free() { *this = {}; }

    /// Allocates the target for a tile if the tile's size has changed.
    void reserve(const gl::Functions& gl, const Window& tile);
    /// Binds depths and keys for multisampled passes with GeometryPass::in_front, and for
    /// sample_keys.comp.
    void bindForReading(const gl::Functions& gl) const;

    GLuint framebuffer() const { return framebuffer_.name(); }
    GLuint depth() const { return depths_.name(); }
    /// Returns the driver's sample positions in a pixel (0 to 1, y down).
    const std::array<glm::dvec2, kPixelSamples>& positions() const { return positions_; }

  private:
    gl::Texture depths_, keys_;
    gl::Framebuffer framebuffer_;
    Window size_;
    std::array<glm::dvec2, kPixelSamples> positions_{};
};

}  // namespace peeler
