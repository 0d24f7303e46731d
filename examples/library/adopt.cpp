// SPDX-License-Identifier: Apache-2.0
// Renders layers with the program's own GL context: adopt SCENE
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <peeler/error.h>
#include <peeler/files.h>
#include <peeler/renderer.h>

#include <cstdio>

int main(int count, char** arguments) try {
    if (count < 2) return 2;
    const auto get_display = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
        eglGetProcAddress("eglGetPlatformDisplayEXT"));
    const EGLDisplay display =
        get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    eglInitialize(display, nullptr, nullptr);
    eglBindAPI(EGL_OPENGL_API);
    const EGLint wanted[] = {EGL_CONTEXT_MAJOR_VERSION,
                             4,
                             EGL_CONTEXT_MINOR_VERSION,
                             5,
                             EGL_CONTEXT_OPENGL_PROFILE_MASK,
                             EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                             EGL_NONE};
    const EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, wanted);
    if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
        std::fprintf(stderr, "there is no OpenGL 4.5\n");
        return 5;
    }
    {
        peeler::RendererOptions options;
        options.adopt = [](const char* name) {
            return reinterpret_cast<void*>(eglGetProcAddress(name));
        };
        peeler::Renderer renderer(options);
        const peeler::Shown shown{peeler::readScene(arguments[1])};
        peeler::CameraChoice camera;
        camera.size = {320, 180};
        const auto image = renderer.layers(shown, peeler::viewOf(shown, camera));
        std::printf("%s: %zu fragments by the program's own context\n", arguments[1],
                    image.fragments());
    }
    const bool still = eglGetCurrentContext() == context;
    eglDestroyContext(display, context);
    return still ? 0 : 1;
} catch (const peeler::Error& error) {
    std::fprintf(stderr, "%s (%s) %s\n", error.what(), error.where().c_str(), error.hint().c_str());
    return static_cast<int>(error.kind());
}
