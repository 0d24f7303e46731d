// SPDX-License-Identifier: Apache-2.0
#include "core/capture/sample_target.h"

#include <algorithm>

#include "shaders/interface.glsl"

namespace peeler {

bool SampleTarget::supported(const gl::Functions& gl, std::span<const glm::dvec2> positions) {
    constexpr GLenum kLimits[] = {GL_MAX_INTEGER_SAMPLES, GL_MAX_COLOR_TEXTURE_SAMPLES,
                                  GL_MAX_DEPTH_TEXTURE_SAMPLES};
    for (const GLenum limit : kLimits) {
        GLint most = 0;
        gl.GetIntegerv(limit, &most);
        if (most < static_cast<GLint>(kPixelSamples)) return false;
    }
    SampleTarget pixel;
    pixel.reserve(gl, {0, 0, 1, 1});
    return positions.size() == kPixelSamples &&
           std::ranges::is_permutation(pixel.positions(), positions);
}

void SampleTarget::reserve(const gl::Functions& gl, const Window& tile) {
    const Window size{0, 0, tile.width(), tile.height()};
    if (framebuffer_ && size == size_) return;
    free();
    size_ = size;
    constexpr int kSamples = kPixelSamples;
    depths_ = gl::makeTexture2DMultisample(gl, GL_DEPTH_COMPONENT32F, kSamples, size.x1, size.y1);
    keys_ = gl::makeTexture2DMultisample(gl, GL_R32UI, kSamples, size.x1, size.y1);
    framebuffer_ = gl::makeFramebuffer(gl, {keys_.name()}, depths_.name());
    gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
    for (GLuint i = 0; i < positions_.size(); ++i) {
        GLfloat at[2] = {};
        gl.GetMultisamplefv(GL_SAMPLE_POSITION, i, at);
        positions_[i] = {at[0], 1 - at[1]};
    }
}

void SampleTarget::bindForReading(const gl::Functions& gl) const {
    gl.TextureBarrier();  // the depths stay attached while passes read them
    gl.BindTextureUnit(PEELER_OPAQUE_DEPTH_UNIT, depths_.name());
    gl.BindTextureUnit(PEELER_OPAQUE_PRIMITIVE_UNIT, keys_.name());
}

}  // namespace peeler
