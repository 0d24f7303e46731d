// SPDX-License-Identifier: Apache-2.0
// The storage buffers a band's fragments are captured into, or its composite.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/gl/objects.h"
#include "core/layered_image.h"

namespace peeler {

/// For layers: per pixel a slot; per fragment a depth, a primitive index and a packed colour, each
/// in a buffer of its own. For a composite: per pixel a slot, a count, a depth, two stamps (in the
/// place of the primitives) and a colour in 32-bit float. Grown on demand and reused from band to
/// band: fresh memory costs more than rasterising into it.
class BandBuffers {
  public:
    explicit BandBuffers(const gl::Functions& gl) : gl_(gl) {}

    /// Bytes of one fragment in these buffers.
    static std::size_t fragmentBytes(std::size_t color_bytes) {
        return sizeof(float) + sizeof(std::uint32_t) + color_bytes;
    }

    /// Bytes of one pixel of a composite.
    static std::size_t compositeBytes() { return 5 * sizeof(std::uint32_t) + 4 * sizeof(float); }

    void reserveSlots(std::size_t pixels) { reserve(slots_, pixels * sizeof(std::uint32_t)); }
    void reserveFragments(std::size_t fragments, std::size_t color_bytes) {
        reserve(depths_, fragments * sizeof(float));
        reserve(primitives_, fragments * sizeof(std::uint32_t));
        if (color_bytes > 0) reserve(colors_, fragments * color_bytes);
    }
    /// Room for what channels.frag yields, all 0.
    void clearForChannels(std::size_t floats) {
        reserve(channels_, floats * sizeof(float));
        channels_.clearToZero(floats * sizeof(float));
    }
    /// Room for the boundary of a clip mesh: of each pixel where its surfaces begin, and one more.
    void reserveClip(std::span<const std::uint32_t> first);
    /// Room for a composite of so many pixels: the counts are these, all else is 0.
    void clearForComposite(std::span<const std::uint32_t> counts);
    /// Frees all.
    void free() {
        for (gl::Buffer* buffer : {&slots_, &depths_, &primitives_, &colors_, &counts_,
                                   &clip_first_, &clip_depths_, &channels_})
            *buffer = {};
    }
    /// Binds all at their PEELER_ binding points.
    void bind() const;

    const gl::Buffer& slots() const { return slots_; }
    const gl::Buffer& depths() const { return depths_; }
    const gl::Buffer& primitives() const { return primitives_; }
    const gl::Buffer& colors() const { return colors_; }
    const gl::Buffer& channels() const { return channels_; }

  private:
    void reserve(gl::Buffer& buffer, std::size_t bytes) {
        if (buffer && buffer.size() >= bytes) return;
        buffer = {};  // free first: never hold both
        buffer = gl::Buffer(gl_, bytes);
    }

    const gl::Functions& gl_;
    gl::Buffer slots_, depths_, primitives_, colors_, counts_, clip_first_, clip_depths_, channels_;
};

}  // namespace peeler
