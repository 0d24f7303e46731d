// SPDX-License-Identifier: Apache-2.0
#include "core/capture/band_buffers.h"

#include <algorithm>

#include "shaders/interface.glsl"

namespace peeler {
void BandBuffers::bindClip() {
    // Clip half-spaces need no lists, but their shader programs also support clip meshes, so all
    // bindings must have buffers.
    reserve(clip_first_, sizeof(std::uint32_t));
    reserve(clip_depths_, sizeof(float));
    clip_first_.bindStorage(PEELER_CLIP_FIRST);
    clip_depths_.bindStorage(PEELER_CLIP_DEPTHS);
}

void BandBuffers::bindForLayers() {
    if (list_heads_) list_heads_.bindStorage(PEELER_LIST_HEADS);
    if (fragments_) fragments_.bindStorage(PEELER_FRAGMENTS);
    if (channels_) channels_.bindStorage(PEELER_CHANNELS);
    bindClip();
}

void BandBuffers::bindForSorting() {
    list_heads_.bindStorage(PEELER_LIST_HEADS);
    fragments_.bindStorage(PEELER_FRAGMENTS);
    layer_offsets_.bindStorage(PEELER_LAYER_OFFSETS);
    layer_counts_.bindStorage(PEELER_LAYER_COUNTS);
    layer_depths_.bindStorage(PEELER_LAYER_DEPTHS);
    layer_colors_.bindStorage(PEELER_LAYER_COLORS);
}

void BandBuffers::bindForComposite() {
    list_heads_.bindStorage(PEELER_LIST_HEADS);
    depths_.bindStorage(PEELER_DEPTHS);
    stamps_.bindStorage(PEELER_STAMPS);
    colors_.bindStorage(PEELER_COLORS);
    counts_.bindStorage(PEELER_COUNTS);
    bindClip();
}

void BandBuffers::reserveClip(std::span<const std::uint32_t> first) {
    reserve(clip_first_, first.size_bytes());
    reserve(clip_depths_, first.back() * sizeof(float));
    const auto mapping = clip_first_.overwrite(first.size_bytes());
    std::copy(first.begin(), first.end(), mapping.as<std::uint32_t>());
}

void BandBuffers::reserveLayers(std::span<const std::uint32_t> offsets, std::size_t color_bytes) {
    reserve(layer_offsets_, offsets.size_bytes());
    reserve(layer_counts_, offsets.size_bytes() - sizeof(std::uint32_t));
    reserve(layer_depths_, offsets.back() * sizeof(float));
    reserve(layer_colors_, offsets.back() * color_bytes);
    const auto mapping = layer_offsets_.overwrite(offsets.size_bytes());
    std::copy(offsets.begin(), offsets.end(), mapping.as<std::uint32_t>());
}

void BandBuffers::clearForComposite(std::span<const std::uint32_t> counts, bool tinted) {
    const std::size_t words = counts.size() * sizeof(std::uint32_t);
    reserveListHeads(counts.size());
    reserve(depths_, words);
    reserve(stamps_, 2 * words);
    reserve(colors_, storedComponents(tinted) * words);
    reserve(counts_, words);
    list_heads_.clearToZero(words);
    depths_.clearToZero(words);
    stamps_.clearToZero(2 * words);
    const auto mapping = counts_.overwrite(words);
    std::copy(counts.begin(), counts.end(), mapping.as<std::uint32_t>());
}

namespace {

/// Returns the index at which a row of `area` begins in an array with one value per pixel of
/// `band`. Rows of `area` are counted from below.
std::size_t rowInBand(const Window& area, const Window& band, int row) {
    const auto y = static_cast<std::size_t>(area.y1 - 1 - row - band.y0);
    return y * static_cast<std::size_t>(band.width()) + static_cast<std::size_t>(area.x0 - band.x0);
}

}  // namespace

bool ListHeadTarget::supported(const gl::Context& context) {
    return context.device().limits.framebuffer_fetch;
}

void ListHeadTarget::reserve(const gl::Functions& gl, int tile_width, int tile_height) {
    if (texture_ && tile_width == width_ && tile_height == height_) return;
    free();
    width_ = tile_width;
    height_ = tile_height;
    texture_ = gl::makeTexture2D(gl, GL_R32UI, width_, height_);
    framebuffer_ = gl::makeFramebuffer(gl, {texture_.name()}, 0);
}

void ListHeadTarget::free() {
    framebuffer_ = {};
    texture_ = {};
    rows_ = {};
}

void ListHeadTarget::write(const gl::Functions& gl, const Window& tile, const Window& area,
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

void ListHeadTarget::read(const gl::Functions& gl, const Window& tile, const Window& area,
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

void OpaqueTarget::reserve(const gl::Functions& gl, const Window& tile, PixelType color) {
    const Window size{0, 0, tile.width(), tile.height()};
    if (framebuffer_ && size == size_ && color == color_) return;
    free();
    size_ = size;
    color_ = color;
    depth_ = gl::makeTexture2D(gl, GL_DEPTH_COMPONENT32F, size.x1, size.y1);
    fragments_ = gl::makeTexture2D(gl, GL_RGBA32UI, size.x1, size.y1);
    std::vector<GLuint> targets = {fragments_.name()};
    if (color == PixelType::kFloat) {
        colors_ = gl::makeTexture2D(gl, GL_RGBA32UI, size.x1, size.y1);
        targets.push_back(colors_.name());
    }
    framebuffer_ = gl::makeFramebuffer(gl, targets, depth_.name());
}

void OpaqueTarget::read(const gl::Functions& gl, const Window& tile, const Window& area,
                        std::vector<std::uint32_t>& pixels) {
    constexpr std::size_t kWords = 4;
    pixels.resize(area.pixels() * words(color_));
    std::uint32_t* to = pixels.data();
    gl.PixelStorei(GL_PACK_ALIGNMENT, 4);
    for (const gl::Texture* texture : {&fragments_, &colors_}) {
        if (!*texture) continue;
        gl.GetTextureSubImage(texture->name(), 0, area.x0 - tile.x0, tile.y1 - area.y1, 0,
                              area.width(), area.height(), 1, GL_RGBA_INTEGER, GL_UNSIGNED_INT,
                              static_cast<GLsizei>(area.pixels() * kWords * sizeof(std::uint32_t)),
                              to);
        to += area.pixels() * kWords;
    }
}

void OpaqueTarget::bindForReading(const gl::Functions& gl) const {
    gl.BindTextureUnit(PEELER_OPAQUE_FRAGMENT_UNIT, fragments_.name());
}

}  // namespace peeler
