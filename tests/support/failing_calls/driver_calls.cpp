// SPDX-License-Identifier: Apache-2.0
// Wrappers of EGL and GL: a wrapper for each function of the driver.
#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/glcorearb.h>
#include <string.h>

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <type_traits>

#include "core/gl/functions.h"
#include "failing_calls.h"

namespace failing {
namespace {

#define EGL_FUNCTIONS(X)                          \
    X(QUERYSTRING, QueryString)                   \
    X(INITIALIZE, Initialize)                     \
    X(TERMINATE, Terminate)                       \
    X(BINDAPI, BindAPI)                           \
    X(CHOOSECONFIG, ChooseConfig)                 \
    X(CREATECONTEXT, CreateContext)               \
    X(DESTROYCONTEXT, DestroyContext)             \
    X(MAKECURRENT, MakeCurrent)                   \
    X(GETERROR, GetError)                         \
    X(QUERYDEVICESEXT, QueryDevicesEXT)           \
    X(QUERYDEVICESTRINGEXT, QueryDeviceStringEXT) \
    X(QUERYDEVICEATTRIBEXT, QueryDeviceAttribEXT) \
    X(QUERYDEVICEBINARYEXT, QueryDeviceBinaryEXT) \
    X(GETPLATFORMDISPLAYEXT, GetPlatformDisplayEXT)

enum Place {
#define X(stem, name) egl##name##Place,
    EGL_FUNCTIONS(X)
#undef X
#define X(stem, name) gl##name##Place,
        PEELER_GL_FUNCTIONS(X)
#undef X
};

thread_local GLenum pending_error = GL_NO_ERROR;

/// Functions that also count as an additional kind of call.
constexpr struct {
    const char* name;
    Call call;
} kSpecial[] = {
    {"glNamedBufferStorage", k_gl_allocation},
    {"glTextureStorage2D", k_gl_allocation},
    {"glTextureStorage3D", k_gl_allocation},
    {"glMapNamedBufferRange", k_gl_mapping},
    {"glGetError", k_gl_error},
    {"glGetGraphicsResetStatus", k_gl_error},
};

/// Counts a call. Returns whether it must fail; the caller then skips the real function.
bool failsDriver(const char* name) {
    if (strncmp(name, "egl", 3) == 0) return fails(k_egl);
    bool failed = false;
    for (const auto& row : kSpecial)
        if (strcmp(row.name, name) == 0) failed = fails(row.call);
    // Queries need no memory, and deletions free memory, so neither fails.
    const bool asks = strncmp(name, "glGet", 5) == 0 || strncmp(name, "glCheck", 7) == 0;
    if (!asks && strncmp(name, "glDelete", 8) != 0) failed = fails(k_gl) || failed;
    if (failed && !asks) pending_error = GL_OUT_OF_MEMORY;
    return failed;
}

/// Returns the number of objects that a glCreate... call creates or a glDelete... call deletes: the
/// call's count argument, or one. Ignores objects with the name 0.
template <std::same_as<GLuint> Name>
std::int64_t objectsOf(Name name) {
    return name != 0 ? 1 : 0;
}
std::int64_t objectsOf(GLsizei count, const GLuint* names) {
    return std::count_if(names, names + count, [](GLuint name) { return name != 0; });
}
std::int64_t objectsOf(GLenum, GLsizei count, const GLuint* names) {
    return objectsOf(count, names);
}

/// Counts GL objects. `made` is the created object if the call returns it; otherwise 0.
template <class... Arguments>
void countObjects(const char* name, GLuint made, Arguments... arguments) {
    const bool makes = strncmp(name, "glCreate", 8) == 0;
    if (!makes && strncmp(name, "glDelete", 8) != 0) return;
    std::int64_t count = made != 0 ? 1 : 0;
    if constexpr (requires { objectsOf(arguments...); })
        if (made == 0) count = objectsOf(arguments...);
    record->counts[kGlObjects] += static_cast<std::uint64_t>(makes ? count : -count);
}

template <int place, class Function>
struct Before;
template <int place, class Result, class... Arguments>
struct Before<place, Result (*)(Arguments...)> {
    static inline Result (*real)(Arguments...) = nullptr;
    static inline const char* name = nullptr;

    static Result call(Arguments... arguments) {
        const bool failed = failsDriver(name);
        if constexpr (place == glGetErrorPlace) {
            if (failed) return GL_OUT_OF_MEMORY;
            if (pending_error != GL_NO_ERROR) {
                const GLenum error = pending_error;
                pending_error = GL_NO_ERROR;
                return error;
            }
        }
        if constexpr (place == glGetGraphicsResetStatusPlace)
            if (failed) return GL_GUILTY_CONTEXT_RESET;
        if (failed) return Result();
        const Uncounted inside;
        if constexpr (std::is_same_v<Result, void>) {
            real(arguments...);
            countObjects(name, 0, arguments...);
        } else {
            const Result result = real(arguments...);
            if constexpr (std::is_same_v<Result, GLuint>) countObjects(name, result, arguments...);
            return result;
        }
    }

    static void* instead(const char* own_name, void* found) {
        name = own_name;
        real = reinterpret_cast<Result (*)(Arguments...)>(found);
        return reinterpret_cast<void*>(call);
    }
};

constexpr struct {
    const char* name;
    void* (*instead)(const char* name, void* found);
} kFunctions[] = {
#define X(stem, name) {"egl" #name, Before<egl##name##Place, PFNEGL##stem##PROC>::instead},
    EGL_FUNCTIONS(X)
#undef X
#define X(stem, name) {"gl" #name, Before<gl##name##Place, PFNGL##stem##PROC>::instead},
        PEELER_GL_FUNCTIONS(X)
#undef X
};

/// The driver's eglGetProcAddress. findInstead() wraps the returned functions.
PFNEGLGETPROCADDRESSPROC find_in_driver = nullptr;
__eglMustCastToProperFunctionPointerType findInstead(const char* name) {
    const Uncounted inside;
    const auto found = find_in_driver(name);
    return reinterpret_cast<__eglMustCastToProperFunctionPointerType>(
        driverFunction(name, reinterpret_cast<void*>(found)));
}

}  // namespace

void* driverFunction(const char* name, void* found) {
    if (!found || (strncmp(name, "egl", 3) != 0 && strncmp(name, "gl", 2) != 0)) return found;
    if (strcmp(name, "eglGetProcAddress") == 0) {
        find_in_driver = reinterpret_cast<PFNEGLGETPROCADDRESSPROC>(found);
        return reinterpret_cast<void*>(findInstead);
    }
    for (const auto& row : kFunctions)
        if (strcmp(row.name, name) == 0) return row.instead(row.name, found);
    return found;
}

}  // namespace failing
