// SPDX-License-Identifier: Apache-2.0
#include "core/capture/slot_target.h"

#include <algorithm>

namespace peeler {
namespace {

/// Where a row of `area`, counted from below, begins among the values of `band`.
std::size_t rowInBand(const Window& area, const Window& band, int row) {
    const auto y = static_cast<std::size_t>(area.y1 - 1 - row - band.y0);
    return y * static_cast<std::size_t>(band.width()) + static_cast<std::size_t>(area.x0 - band.x0);
}

}  // namespace

bool SlotTarget::supported(const gl::Context& context) {
    return context.device().limits.framebuffer_fetch;
}

void SlotTarget::reserve(const gl::Functions& gl, int tile_width, int tile_height) {
    if (texture_ && tile_width == width_ && tile_height == height_) return;
    free();
    width_ = tile_width;
    height_ = tile_height;
    texture_ = gl::makeTexture2D(gl, GL_R32UI, width_, height_);
    framebuffer_ = gl::makeFramebuffer(gl, {texture_.name()}, 0);
}

void SlotTarget::free() {
    framebuffer_ = {};
    texture_ = {};
    rows_ = {};
}

void SlotTarget::write(const gl::Functions& gl, const Window& tile, const Window& area,
                       const Window& band, std::span<const std::uint32_t> values) {
    reserve(gl, tile.width(), tile.height());
    const auto width = static_cast<std::size_t>(area.width());
    rows_.resize(area.pixels());
    for (int row = 0; row < area.height(); ++row) {
        const auto to = rows_.begin() + static_cast<std::ptrdiff_t>(width) * row;
        if (values.empty())
            std::fill_n(to, width, 0U);
        else
            std::copy_n(values.data() + rowInBand(area, band, row), width, to);
    }
    gl.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
    gl.TextureSubImage2D(texture_.name(), 0, area.x0 - tile.x0, tile.y1 - area.y1, area.width(),
                         area.height(), GL_RED_INTEGER, GL_UNSIGNED_INT, rows_.data());
}

void SlotTarget::read(const gl::Functions& gl, const Window& tile, const Window& area,
                      const Window& band, std::span<std::uint32_t> values) {
    const auto width = static_cast<std::size_t>(area.width());
    rows_.resize(area.pixels());
    gl.PixelStorei(GL_PACK_ALIGNMENT, 4);
    gl.GetTextureSubImage(texture_.name(), 0, area.x0 - tile.x0, tile.y1 - area.y1, 0, area.width(),
                          area.height(), 1, GL_RED_INTEGER, GL_UNSIGNED_INT,
                          static_cast<GLsizei>(rows_.size() * sizeof(std::uint32_t)), rows_.data());
    for (int row = 0; row < area.height(); ++row) {
        std::copy_n(rows_.begin() + static_cast<std::ptrdiff_t>(width) * row, width,
                    values.data() + rowInBand(area, band, row));
    }
}

}  // namespace peeler
