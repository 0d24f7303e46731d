// SPDX-License-Identifier: Apache-2.0
// A fake libEGL.so.1 with simulated GPUs. It precedes the real library in LD_LIBRARY_PATH, and
// forwards to it. It has only the EGL functions that peeler loads. Variables:
//
//   PEELER_FAKE_EGL_DEVICES=N    N devices like those of NVIDIA's driver, before the real ones. The
//                                i-th of them, counted from 0, is CUDA device N-1-i, has the UUID
//                                GPU-abcd0i00-0000-0000-0000-000000000000 and makes a context whose
//                                renderer is "Fake GPU i".
//   PEELER_FAKE_EGL_REMAPS=1     CUDA numbers count only the devices in CUDA_VISIBLE_DEVICES, as in
//                                a driver that also reads it; it must be a list of numbers.
//   PEELER_FAKE_EGL_FORBIDDEN=i  the string of this device is not available: another user's GPU.
//   PEELER_FAKE_EGL_LOST=N       the N-th call of glGetGraphicsResetStatus in the process, counted
//                                from 1, reports a lost context; with "N+", all later calls do,
//                                too. Contexts of all devices count, including real ones.
//
// Querying a device's attribute before its string aborts the process, as in some drivers under
// cgroups.
#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/glcorearb.h>
#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <vector>

namespace {

constexpr int kMostDevices = 8;

/// A fake device. Its address is the handle of the device and of the device's display.
struct FakeDevice {
    int index = 0;
    bool string_queried = false;
    EGLDisplay display = EGL_NO_DISPLAY;  ///< the real display, if opened
};
std::array<FakeDevice, kMostDevices> devices;
thread_local const FakeDevice* current = nullptr;
int status_calls = 0;

const char* variable(const char* name) {
    const char* text = std::getenv(name);
    return text ? text : "";
}

int deviceCount() {
    return std::clamp(std::atoi(variable("PEELER_FAKE_EGL_DEVICES")), 0, kMostDevices);
}

/// Value of CUDA_VISIBLE_DEVICES when the process started, before any change.
const std::string visible_at_start = [] {
    const char* text = std::getenv("CUDA_VISIBLE_DEVICES");
    return std::string(text ? text : "all");
}();

/// Returns the fake device with this handle (of the device or its display); null for a real handle.
FakeDevice* fake(void* handle) {
    for (FakeDevice& device : devices)
        if (handle == &device) return &device;
    return nullptr;
}

void* realLibrary() {
    static void* const handle = [] {
        for (const char* path : {PEELER_REAL_EGL_FOLDER "/libEGL.so.1", "/usr/lib64/libEGL.so.1",
                                 "/usr/lib/libEGL.so.1", "/lib/libEGL.so.1"})
            if (void* library = dlopen(path, RTLD_NOW | RTLD_LOCAL)) return library;
        std::fputs("fake EGL: there is no real libEGL.so.1\n", stderr);
        std::abort();
    }();
    return handle;
}

template <class Function>
Function real(const char* name) {
    if (void* symbol = dlsym(realLibrary(), name)) return reinterpret_cast<Function>(symbol);
    const auto lookup =
        reinterpret_cast<PFNEGLGETPROCADDRESSPROC>(dlsym(realLibrary(), "eglGetProcAddress"));
    return reinterpret_cast<Function>(lookup(name));
}

EGLDisplay behind(EGLDisplay display) {
    const FakeDevice* device = fake(display);
    return device ? device->display : display;
}

EGLBoolean queryDevices(EGLint most, EGLDeviceEXT* list, EGLint* count) {
    const int fakes = deviceCount();
    std::vector<EGLDeviceEXT> all;
    for (int i = 0; i < fakes; ++i) {
        devices[static_cast<std::size_t>(i)].index = i;
        all.push_back(&devices[static_cast<std::size_t>(i)]);
    }
    std::array<EGLDeviceEXT, 64> others{};
    EGLint found = 0;
    const auto query = real<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
    if (query && query(static_cast<EGLint>(others.size()), others.data(), &found))
        all.insert(all.end(), others.begin(), others.begin() + found);
    *count = static_cast<EGLint>(all.size());
    if (!list) return EGL_TRUE;
    *count = std::min(*count, most);
    std::copy_n(all.begin(), *count, list);
    return EGL_TRUE;
}

const char* queryDeviceString(EGLDeviceEXT handle, EGLint name) {
    FakeDevice* device = fake(handle);
    if (!device)
        return real<PFNEGLQUERYDEVICESTRINGEXTPROC>("eglQueryDeviceStringEXT")(handle, name);
    device->string_queried = true;
    const std::string forbidden = variable("PEELER_FAKE_EGL_FORBIDDEN");
    if (forbidden == std::to_string(device->index)) return nullptr;
    return name == EGL_EXTENSIONS ? "EGL_NV_device_cuda EGL_EXT_device_persistent_id" : nullptr;
}

void demandString(const FakeDevice& device) {
    if (device.string_queried) return;
    std::fputs("fake EGL: an attribute was queried before the string\n", stderr);
    std::abort();
}

/// Returns the value of the driver's attribute EGL_CUDA_DEVICE_NV; -1: hidden from CUDA.
int cudaOrdinal(const FakeDevice& device) {
    const int ordinal = deviceCount() - 1 - device.index;
    if (*variable("PEELER_FAKE_EGL_REMAPS") == '\0' || visible_at_start == "all") return ordinal;
    // When the attribute is queried, a real driver initialises CUDA, which reads the variable.
    const char* now = std::getenv("CUDA_VISIBLE_DEVICES");
    if (!now) return ordinal;
    int position = 0;
    for (const char* at = now; *at; ++position) {
        char* end = nullptr;
        if (std::strtol(at, &end, 10) == ordinal) return position;
        at = *end == ',' ? end + 1 : "";
    }
    return -1;
}

EGLBoolean queryDeviceAttrib(EGLDeviceEXT handle, EGLint name, EGLAttrib* value) {
    const FakeDevice* device = fake(handle);
    if (!device)
        return real<PFNEGLQUERYDEVICEATTRIBEXTPROC>("eglQueryDeviceAttribEXT")(handle, name, value);
    demandString(*device);
    const int ordinal = cudaOrdinal(*device);
    if (name != EGL_CUDA_DEVICE_NV || ordinal < 0) return EGL_FALSE;
    *value = ordinal;
    return EGL_TRUE;
}

EGLBoolean queryDeviceBinary(EGLDeviceEXT handle, EGLint name, EGLint most, void* value,
                             EGLint* size) {
    const FakeDevice* device = fake(handle);
    if (!device) {
        const auto query = real<PFNEGLQUERYDEVICEBINARYEXTPROC>("eglQueryDeviceBinaryEXT");
        return query ? query(handle, name, most, value, size) : EGL_FALSE;
    }
    demandString(*device);
    std::array<unsigned char, 16> uuid{0xab, 0xcd, static_cast<unsigned char>(device->index)};
    if (name != EGL_DEVICE_UUID_EXT) return EGL_FALSE;
    *size = static_cast<EGLint>(uuid.size());
    if (value) std::memcpy(value, uuid.data(), std::min(uuid.size(), static_cast<size_t>(most)));
    return EGL_TRUE;
}

EGLDisplay getPlatformDisplay(EGLenum platform, void* native, const EGLint* attributes) {
    const auto open = real<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
    FakeDevice* device = fake(native);
    if (!device) return open(platform, native, attributes);
    device->display = open(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    return device->display == EGL_NO_DISPLAY ? EGL_NO_DISPLAY : device;
}

const GLubyte* APIENTRY getString(GLenum name) {
    static std::array<std::string, kMostDevices> names;
    if (!current || name != GL_RENDERER) return real<PFNGLGETSTRINGPROC>("glGetString")(name);
    std::string& text = names[static_cast<std::size_t>(current->index)];
    text = "Fake GPU " + std::to_string(current->index);
    return reinterpret_cast<const GLubyte*>(text.c_str());
}

GLenum APIENTRY getGraphicsResetStatus() {
    ++status_calls;
    const std::string lost = variable("PEELER_FAKE_EGL_LOST");
    const int from = std::atoi(lost.c_str());
    if (from > 0 && (status_calls == from || (lost.back() == '+' && status_calls > from)))
        return GL_GUILTY_CONTEXT_RESET;
    return GL_NO_ERROR;
}

using Procedure = __eglMustCastToProperFunctionPointerType;

}  // namespace

extern "C" {

Procedure EGLAPIENTRY eglGetProcAddress(const char* name) {
    static const std::map<std::string, Procedure> own = {
        {"eglQueryDevicesEXT", reinterpret_cast<Procedure>(queryDevices)},
        {"eglQueryDeviceStringEXT", reinterpret_cast<Procedure>(queryDeviceString)},
        {"eglQueryDeviceAttribEXT", reinterpret_cast<Procedure>(queryDeviceAttrib)},
        {"eglQueryDeviceBinaryEXT", reinterpret_cast<Procedure>(queryDeviceBinary)},
        {"eglGetPlatformDisplayEXT", reinterpret_cast<Procedure>(getPlatformDisplay)},
        {"glGetString", reinterpret_cast<Procedure>(getString)},
        {"glGetGraphicsResetStatus", reinterpret_cast<Procedure>(getGraphicsResetStatus)},
    };
    const auto entry = own.find(name);
    return entry != own.end() ? entry->second
                              : real<PFNEGLGETPROCADDRESSPROC>("eglGetProcAddress")(name);
}

const char* EGLAPIENTRY eglQueryString(EGLDisplay display, EGLint name) {
    return real<PFNEGLQUERYSTRINGPROC>("eglQueryString")(behind(display), name);
}

EGLBoolean EGLAPIENTRY eglInitialize(EGLDisplay display, EGLint* major, EGLint* minor) {
    return real<PFNEGLINITIALIZEPROC>("eglInitialize")(behind(display), major, minor);
}

EGLBoolean EGLAPIENTRY eglTerminate(EGLDisplay display) {
    return real<PFNEGLTERMINATEPROC>("eglTerminate")(behind(display));
}

EGLBoolean EGLAPIENTRY eglBindAPI(EGLenum api) {
    return real<PFNEGLBINDAPIPROC>("eglBindAPI")(api);
}

EGLBoolean EGLAPIENTRY eglChooseConfig(EGLDisplay display, const EGLint* attributes,
                                       EGLConfig* configs, EGLint size, EGLint* count) {
    return real<PFNEGLCHOOSECONFIGPROC>("eglChooseConfig")(behind(display), attributes, configs,
                                                           size, count);
}

EGLContext EGLAPIENTRY eglCreateContext(EGLDisplay display, EGLConfig config, EGLContext shared,
                                        const EGLint* attributes) {
    return real<PFNEGLCREATECONTEXTPROC>("eglCreateContext")(behind(display), config, shared,
                                                             attributes);
}

EGLBoolean EGLAPIENTRY eglDestroyContext(EGLDisplay display, EGLContext context) {
    return real<PFNEGLDESTROYCONTEXTPROC>("eglDestroyContext")(behind(display), context);
}

EGLBoolean EGLAPIENTRY eglMakeCurrent(EGLDisplay display, EGLSurface draw, EGLSurface read,
                                      EGLContext context) {
    current = context == EGL_NO_CONTEXT ? nullptr : fake(display);
    return real<PFNEGLMAKECURRENTPROC>("eglMakeCurrent")(behind(display), draw, read, context);
}

EGLint EGLAPIENTRY eglGetError(void) {
    return real<PFNEGLGETERRORPROC>("eglGetError")();
}

}  // extern "C"
