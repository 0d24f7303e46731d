// SPDX-License-Identifier: Apache-2.0
// The minimal process that draws with OpenGL 4.5 without a display: makes a surfaceless EGL
// context, compiles and links a program, draws a triangle into a small buffer, and calls glFinish.
// Its time is the baseline for the start-up of `peeler render`. Prints nothing; exits with 1 on
// failure.
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/glcorearb.h>
#include <dlfcn.h>

#include <cstdio>

namespace {

constexpr const char* kVertexShader = R"(#version 450 core
void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1);
})";
constexpr const char* kFragmentShader = R"(#version 450 core
layout(location = 0) out vec4 color;
void main() { color = vec4(gl_FragCoord.xy / 16, 0, 1); })";

void* library = nullptr;

template <class Function>
Function egl(const char* name) {
    return reinterpret_cast<Function>(dlsym(library, name));
}

template <class Function>
Function gl(const char* name) {
    static const auto address = egl<decltype(&eglGetProcAddress)>("eglGetProcAddress");
    return reinterpret_cast<Function>(address(name));
}

bool makeContext() {
    library = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
    if (!library) return false;
    const auto display_of = gl<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
    const EGLDisplay display =
        display_of(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    constexpr EGLint kConfig[] = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                  EGL_NONE};
    constexpr EGLint kContext[] = {EGL_CONTEXT_MAJOR_VERSION,
                                   4,
                                   EGL_CONTEXT_MINOR_VERSION,
                                   5,
                                   EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                   EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                   EGL_NONE};
    EGLConfig config = nullptr;
    EGLint configs = 0;
    if (!egl<decltype(&eglInitialize)>("eglInitialize")(display, nullptr, nullptr)) return false;
    egl<decltype(&eglBindAPI)>("eglBindAPI")(EGL_OPENGL_API);
    egl<decltype(&eglChooseConfig)>("eglChooseConfig")(display, kConfig, &config, 1, &configs);
    const EGLContext context = egl<decltype(&eglCreateContext)>("eglCreateContext")(
        display, config, EGL_NO_CONTEXT, kContext);
    return egl<decltype(&eglMakeCurrent)>("eglMakeCurrent")(display, EGL_NO_SURFACE, EGL_NO_SURFACE,
                                                            context) == EGL_TRUE;
}

GLuint shader(GLenum type, const char* source) {
    const GLuint name = gl<PFNGLCREATESHADERPROC>("glCreateShader")(type);
    gl<PFNGLSHADERSOURCEPROC>("glShaderSource")(name, 1, &source, nullptr);
    gl<PFNGLCOMPILESHADERPROC>("glCompileShader")(name);
    return name;
}

bool draw() {
    GLuint program = gl<PFNGLCREATEPROGRAMPROC>("glCreateProgram")();
    const auto attach = gl<PFNGLATTACHSHADERPROC>("glAttachShader");
    attach(program, shader(GL_VERTEX_SHADER, kVertexShader));
    attach(program, shader(GL_FRAGMENT_SHADER, kFragmentShader));
    gl<PFNGLLINKPROGRAMPROC>("glLinkProgram")(program);
    GLint linked = 0;
    gl<PFNGLGETPROGRAMIVPROC>("glGetProgramiv")(program, GL_LINK_STATUS, &linked);

    GLuint target = 0, buffer = 0, arrays = 0;
    gl<PFNGLCREATERENDERBUFFERSPROC>("glCreateRenderbuffers")(1, &target);
    gl<PFNGLNAMEDRENDERBUFFERSTORAGEPROC>("glNamedRenderbufferStorage")(target, GL_RGBA8, 16, 16);
    gl<PFNGLCREATEFRAMEBUFFERSPROC>("glCreateFramebuffers")(1, &buffer);
    gl<PFNGLNAMEDFRAMEBUFFERRENDERBUFFERPROC>("glNamedFramebufferRenderbuffer")(
        buffer, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, target);
    gl<PFNGLBINDFRAMEBUFFERPROC>("glBindFramebuffer")(GL_FRAMEBUFFER, buffer);
    gl<PFNGLCREATEVERTEXARRAYSPROC>("glCreateVertexArrays")(1, &arrays);
    gl<PFNGLBINDVERTEXARRAYPROC>("glBindVertexArray")(arrays);
    gl<PFNGLVIEWPORTPROC>("glViewport")(0, 0, 16, 16);
    gl<PFNGLUSEPROGRAMPROC>("glUseProgram")(program);
    gl<PFNGLDRAWARRAYSPROC>("glDrawArrays")(GL_TRIANGLES, 0, 3);
    gl<PFNGLFINISHPROC>("glFinish")();
    return linked == GL_TRUE && gl<PFNGLGETERRORPROC>("glGetError")() == GL_NO_ERROR;
}

}  // namespace

int main() {
    if (makeContext() && draw()) return 0;
    std::fprintf(stderr, "bare_context: no surfaceless OpenGL 4.5\n");
    return 1;
}
