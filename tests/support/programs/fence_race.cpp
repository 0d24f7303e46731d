// SPDX-License-Identifier: Apache-2.0
// A minimal program for the race that cmd/mutex_destroy.cpp fixes. Clears two framebuffers in turn
// without waiting, and prints the renderer.
//   fence_race BACKEND SCENES
#include <array>
#include <cstdio>
#include <cstdlib>

#include <peeler/error.h>
#include "core/gl/context.h"
#include "core/gl/functions.h"

namespace {

void clearInTurn(const peeler::gl::Functions& gl, int scenes) {
    std::array<GLuint, 2> textures{}, framebuffers{};
    gl.CreateTextures(GL_TEXTURE_2D, 2, textures.data());
    gl.CreateFramebuffers(2, framebuffers.data());
    for (std::size_t i = 0; i < 2; ++i) {
        gl.TextureStorage2D(textures[i], 1, GL_RGBA8, 64, 64);
        gl.NamedFramebufferTexture(framebuffers[i], GL_COLOR_ATTACHMENT0, textures[i], 0);
    }
    for (int i = 0; i < scenes; ++i) {
        const std::array<GLfloat, 4> color{static_cast<GLfloat>(i & 3), 0, 0, 0};
        const GLuint framebuffer = framebuffers[static_cast<std::size_t>(i & 1)];
        gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
        gl.ClearNamedFramebufferfv(framebuffer, GL_COLOR, 0, color.data());
    }
    gl.Finish();
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 3) return 2;
    try {
        const auto context = peeler::gl::createContext({.backend = arguments[1]});
        std::printf("%s\n%s\n", context->device().renderer.c_str(),
                    context->device().version.c_str());
        std::fflush(stdout);
        clearInTurn(context->functions(), std::atoi(arguments[2]));
        return 0;
    } catch (const peeler::Error& error) {
        std::printf("%s\n", error.what());
        return static_cast<int>(error.kind());
    }
}
