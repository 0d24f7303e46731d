// SPDX-License-Identifier: Apache-2.0
#include "core/peel/layer_targets.h"

#include <vector>

#include "shaders/interface.glsl"

namespace peeler {

std::uint64_t LayerTargets::bytes(std::uint64_t tile_pixels, const CaptureSettings& settings) {
    constexpr std::uint64_t kKeys = 2 * (sizeof(float) + sizeof(std::uint32_t));
    return tile_pixels * (kKeys + settings.storedColorBytes());
}

void LayerTargets::allocate(const SceneRasterizer& rasterizer) {
    const auto& gl = rasterizer.functions();
    const Window size{0, 0, rasterizer.tile().width(), rasterizer.tile().height()};
    if (size == size_) return;
    color_ = {};
    opacity_ = {};
    sides_ = {};
    const GLenum format = rasterizer.floatColor() ? GL_RGBA32UI : GL_RG32UI;
    color_ = gl::makeTexture2D(gl, format, size.x1, size.y1);
    std::vector<GLuint> colors = {color_.name()};
    if (rasterizer.tinted()) {
        opacity_ = gl::makeTexture2D(gl, format, size.x1, size.y1);
        colors.push_back(opacity_.name());
    }
    color_only_ = gl::makeFramebuffer(gl, colors, 0);
    for (auto& side : sides_) {
        side.depth = gl::makeTexture2D(gl, GL_DEPTH_COMPONENT32F, size.x1, size.y1);
        side.primitive = gl::makeTexture2D(gl, GL_R32UI, size.x1, size.y1);
        side.key = gl::makeFramebuffer(gl, {side.primitive.name()}, side.depth.name());
        std::vector<GLuint> all = colors;
        all.insert(all.begin(), side.primitive.name());
        side.key_and_color = gl::makeFramebuffer(gl, all, side.depth.name());
    }
    size_ = size;
}

void LayerTargets::begin(const SceneRasterizer& rasterizer, const Window& area,
                         const PeelDirection& direction) {
    allocate(rasterizer);
    clear(rasterizer, area, 1, direction.first_depth, direction.first_primitive);
}

void LayerTargets::beginFinished(const SceneRasterizer& rasterizer, const Window& area) {
    allocate(rasterizer);
    clear(rasterizer, area, 1, 0, 0xFFFFFFFFU);  // no fragment lies behind this key
}

int LayerTargets::peel(SceneRasterizer& rasterizer, const Window& area, std::uint32_t layers,
                       const PeelDirection& direction, const Take& take) {
    for (int layer = 0; layer < static_cast<int>(layers); ++layer) {
        const int current = layer % 2, previous = 1 - current;
        clear(rasterizer, area, current, direction.empty_depth, 0);
        bindForReading(rasterizer.functions(), previous);
        rasterizer.draw({.fragment_shader = "peel_layer.frag",
                         .definitions = direction.definitions,
                         .shades = true,
                         .framebuffer = framebuffer(current, kKeyAndColor),
                         .depth_test = direction.depth_test},
                        area);
        take(layer, current);
    }
    return static_cast<int>(layers);
}

int LayerTargets::peelInTwo(SceneRasterizer& rasterizer, const Window& area, std::uint32_t layers,
                            const Take& take) {
    for (int layer = 0; layer < static_cast<int>(layers); ++layer) {
        const int current = layer % 2, previous = 1 - current;
        clear(rasterizer, area, current, kNearestFirst.empty_depth, 0);
        bindForReading(rasterizer.functions(), previous);
        rasterizer.draw({.fragment_shader = "peel_key.frag",
                         .framebuffer = framebuffer(current, kKey),
                         .depth_test = kNearestFirst.depth_test},
                        area);
        bindForReading(rasterizer.functions(), current);
        rasterizer.draw({.fragment_shader = "shade_layer.frag",
                         .shades = true,
                         .framebuffer = framebuffer(current, kColor)},
                        area);
        take(layer, current);
    }
    return 2 * static_cast<int>(layers);
}

void LayerTargets::clear(const SceneRasterizer& rasterizer, const Window& area, int i, float depth,
                         GLuint primitive) const {
    const auto& gl = rasterizer.functions();
    const GLuint framebuffer = sides_[static_cast<std::size_t>(i)].key.name();
    gl::PassState state = rasterizer.passState(framebuffer, area);
    state.depth_test = gl::DepthTest::kNearest;  // enables depth writes, which a clear needs
    gl::apply(gl, state);
    const std::array<GLuint, 4> key = {primitive, 0, 0, 0};
    gl.ClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &depth);
    gl.ClearNamedFramebufferuiv(framebuffer, GL_COLOR, 0, key.data());
}

GLuint LayerTargets::framebuffer(int i, Attachments attachments) const {
    const Side& side = sides_[static_cast<std::size_t>(i)];
    if (attachments == kColor) return color_only_.name();
    return attachments == kKey ? side.key.name() : side.key_and_color.name();
}

void LayerTargets::bindForReading(const gl::Functions& gl, int i) const {
    const Side& side = sides_[static_cast<std::size_t>(i)];
    gl.BindTextureUnit(PEELER_PREVIOUS_DEPTH_UNIT, side.depth.name());
    gl.BindTextureUnit(PEELER_PREVIOUS_PRIMITIVE_UNIT, side.primitive.name());
}

void LayerTargets::store(SceneRasterizer& rasterizer, const Window& area, int i) const {
    const auto& gl = rasterizer.functions();
    bindForReading(gl, i);
    gl.BindTextureUnit(PEELER_PREVIOUS_COLOR_UNIT, color_.name());
    if (opacity_) gl.BindTextureUnit(PEELER_LAYER_OPACITY_UNIT, opacity_.name());
    rasterizer.compute("store_layer.comp", "", area);
}

void LayerTargets::blend(SceneRasterizer& rasterizer, const Window& area, int i,
                         FullScreenPass pass) const {
    const auto& gl = rasterizer.functions();
    bindForReading(gl, i);
    gl.BindTextureUnit(PEELER_PREVIOUS_COLOR_UNIT, color_.name());
    pass.fragment_shader = "blend_layer.frag";
    rasterizer.drawFullScreen(pass, area);
    gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

}  // namespace peeler
