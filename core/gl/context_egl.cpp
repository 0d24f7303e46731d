// SPDX-License-Identifier: Apache-2.0
// EGL without a window system: hardware devices, Mesa's software device, the surfaceless platform.
#define EGL_NO_X11  // keeps out X's headers and their macros
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>

#include "core/gl/backend.h"
#include "core/gl/cuda_devices.h"
#include "core/gl/functions.h"

namespace peeler::gl {
namespace {

struct EglLibrary {
    PFNEGLGETPROCADDRESSPROC proc_address = nullptr;
    PFNEGLQUERYSTRINGPROC query_string = nullptr;
    PFNEGLINITIALIZEPROC initialize = nullptr;
    PFNEGLTERMINATEPROC terminate = nullptr;
    PFNEGLBINDAPIPROC bind_api = nullptr;
    PFNEGLCHOOSECONFIGPROC choose_config = nullptr;
    PFNEGLCREATECONTEXTPROC create_context = nullptr;
    PFNEGLDESTROYCONTEXTPROC destroy_context = nullptr;
    PFNEGLMAKECURRENTPROC make_current = nullptr;
    PFNEGLGETERRORPROC get_error = nullptr;
    PFNEGLQUERYDEVICESEXTPROC query_devices = nullptr;             // null if EGL lacks the function
    PFNEGLQUERYDEVICESTRINGEXTPROC query_device_string = nullptr;  // null if EGL lacks the function
    PFNEGLQUERYDEVICEATTRIBEXTPROC query_device_attrib = nullptr;  // null if EGL lacks the function
    PFNEGLQUERYDEVICEBINARYEXTPROC query_device_binary = nullptr;  // null if EGL lacks the function
    PFNEGLGETPLATFORMDISPLAYEXTPROC get_platform_display = nullptr;
    std::string client_extensions;
    std::string problem;
};

template <class Function>
void load(void* handle, const char* name, Function& function) {
    function = reinterpret_cast<Function>(dlsym(handle, name));
}

bool hasWord(std::string_view list, std::string_view word) {
    for (std::size_t at = list.find(word); at != std::string_view::npos;
         at = list.find(word, at + 1)) {
        const bool starts = at == 0 || list[at - 1] == ' ';
        const std::size_t end = at + word.size();
        if (starts && (end == list.size() || list[end] == ' ')) return true;
    }
    return false;
}

const EglLibrary& eglLibrary() {
    static const EglLibrary loaded = [] {
        EglLibrary lib;
        // Never closed, since drivers keep threads and exit handlers.
        void* handle = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL);
        if (!handle) {
            lib.problem = std::string(dlerror()) + " (Debian: libegl1)";
            return lib;
        }
        load(handle, "eglGetProcAddress", lib.proc_address);
        load(handle, "eglQueryString", lib.query_string);
        load(handle, "eglInitialize", lib.initialize);
        load(handle, "eglTerminate", lib.terminate);
        load(handle, "eglBindAPI", lib.bind_api);
        load(handle, "eglChooseConfig", lib.choose_config);
        load(handle, "eglCreateContext", lib.create_context);
        load(handle, "eglDestroyContext", lib.destroy_context);
        load(handle, "eglMakeCurrent", lib.make_current);
        load(handle, "eglGetError", lib.get_error);
        if (!lib.proc_address || !lib.query_string || !lib.initialize || !lib.terminate ||
            !lib.bind_api || !lib.choose_config || !lib.create_context || !lib.destroy_context ||
            !lib.make_current || !lib.get_error) {
            lib.problem = "libEGL.so.1 lacks functions of EGL 1.4";
            return lib;
        }
        const char* extensions = lib.query_string(EGL_NO_DISPLAY, EGL_EXTENSIONS);
        lib.client_extensions = extensions ? extensions : "";
        const auto extension = [&](const char* name, auto& function) {
            function = reinterpret_cast<std::decay_t<decltype(function)>>(lib.proc_address(name));
        };
        extension("eglGetPlatformDisplayEXT", lib.get_platform_display);
        if (hasWord(lib.client_extensions, "EGL_EXT_device_enumeration") ||
            hasWord(lib.client_extensions, "EGL_EXT_device_base")) {
            extension("eglQueryDevicesEXT", lib.query_devices);
            extension("eglQueryDeviceStringEXT", lib.query_device_string);
            extension("eglQueryDeviceAttribEXT", lib.query_device_attrib);
            extension("eglQueryDeviceBinaryEXT", lib.query_device_binary);
        }
        if (!lib.get_platform_display)
            lib.problem =
                "EGL has no EGL_EXT_platform_base: it cannot work without a window system";
        return lib;
    }();
    return loaded;
}

class EglContext final : public Context {
  public:
    EglContext(EGLDisplay display, EGLContext context, const Device& device)
        : display_(display), context_(context) {
        device_ = device;
        functions_ = std::make_unique<Functions>();
    }
    ~EglContext() override {
        const auto& egl = eglLibrary();
        egl.make_current(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        egl.destroy_context(display_, context_);
        // The display stays initialised, because all contexts of the process share it.
    }
    Functions& mutableFunctions() { return *functions_; }

  private:
    EGLDisplay display_;
    EGLContext context_;
};

std::string eglError(const char* call) {
    constexpr std::array<std::pair<EGLint, const char*>, 6> kNames = {{
        {EGL_NOT_INITIALIZED, "EGL_NOT_INITIALIZED"},
        {EGL_BAD_ALLOC, "EGL_BAD_ALLOC"},
        {EGL_BAD_ATTRIBUTE, "EGL_BAD_ATTRIBUTE"},
        {EGL_BAD_MATCH, "EGL_BAD_MATCH"},
        {EGL_BAD_CONFIG, "EGL_BAD_CONFIG"},
        {EGL_BAD_PARAMETER, "EGL_BAD_PARAMETER"},
    }};
    const EGLint code = eglLibrary().get_error();
    for (const auto& [value, name] : kNames)
        if (value == code) return std::string(call) + " failed (" + name + ")";
    return std::string(call) + " failed (EGL error " + std::to_string(code) + ")";
}

std::unique_ptr<Context> openEglContext(EGLenum platform, void* native, const Device& device,
                                        std::string& problem) {
    const auto& egl = eglLibrary();
    EGLDisplay display = egl.get_platform_display(platform, native, nullptr);
    if (display == EGL_NO_DISPLAY) {
        problem = eglError("eglGetPlatformDisplayEXT");
        return nullptr;
    }
    if (!egl.initialize(display, nullptr, nullptr)) {
        problem = eglError("eglInitialize");
        return nullptr;
    }
    const char* text = egl.query_string(display, EGL_EXTENSIONS);
    const std::string extensions = text ? text : "";
    if (!hasWord(extensions, "EGL_KHR_surfaceless_context")) {
        problem = "EGL_KHR_surfaceless_context is missing";
        return nullptr;
    }
    if (!egl.bind_api(EGL_OPENGL_API)) {
        problem = eglError("eglBindAPI(EGL_OPENGL_API)");
        return nullptr;
    }
    EGLConfig config = nullptr;  // null = EGL_NO_CONFIG_KHR
    if (!hasWord(extensions, "EGL_KHR_no_config_context")) {
        const std::array<EGLint, 3> wanted = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
        EGLint found = 0;
        if (!egl.choose_config(display, wanted.data(), &config, 1, &found) || found < 1) {
            problem = "no EGL config renders OpenGL";
            return nullptr;
        }
    }
    std::vector<EGLint> attributes = {
        EGL_CONTEXT_MAJOR_VERSION,       4,
        EGL_CONTEXT_MINOR_VERSION,       5,
        EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT};
#ifndef NDEBUG
    attributes.insert(attributes.end(), {EGL_CONTEXT_OPENGL_DEBUG, EGL_TRUE});
#endif
    // Requests reset notification first, so that a lost GPU is noticed (glGetGraphicsResetStatus)
    // and leads to exit code 5. Not every driver accepts the attribute (Mesa 22.3's llvmpipe does
    // not).
    std::vector<EGLint> robust = attributes;
    robust.insert(robust.end(), {EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY,
                                 EGL_LOSE_CONTEXT_ON_RESET, EGL_NONE});
    attributes.push_back(EGL_NONE);
    EGLContext handle = egl.create_context(display, config, EGL_NO_CONTEXT, robust.data());
    if (handle == EGL_NO_CONTEXT)
        handle = egl.create_context(display, config, EGL_NO_CONTEXT, attributes.data());
    if (handle == EGL_NO_CONTEXT) {
        problem = eglError("eglCreateContext for OpenGL 4.5 core");
        return nullptr;
    }
    auto context = std::make_unique<EglContext>(display, handle, device);
    if (!egl.make_current(display, EGL_NO_SURFACE, EGL_NO_SURFACE, handle)) {
        problem = eglError("eglMakeCurrent");
        return nullptr;
    }
    const std::string missing = loadFunctions(
        context->mutableFunctions(),
        [&egl](const char* name) { return reinterpret_cast<void*>(egl.proc_address(name)); });
    if (!missing.empty()) {
        problem = "the function " + missing + " is missing";
        return nullptr;
    }
    return context;
}

Candidate candidate(Device device, EGLenum platform, void* native) {
    device.backend = "egl";
    return {device, [=](std::string& problem) {
                return openEglContext(platform, native, device, problem);
            }};
}

/// A device listed by EGL, with the CUDA ordinal that its driver reports.
struct Listed {
    EGLDeviceEXT handle = nullptr;
    Device device;
    bool has_number = false;  ///< whether the driver can report an ordinal
    std::optional<int> ordinal;
};

std::string uuidOf(EGLDeviceEXT device, std::string_view extensions) {
    const auto& egl = eglLibrary();
    std::array<unsigned char, 16> bytes{};
    EGLint size = 0;
    if (!egl.query_device_binary || !hasWord(extensions, "EGL_EXT_device_persistent_id") ||
        !egl.query_device_binary(device, EGL_DEVICE_UUID_EXT, static_cast<EGLint>(bytes.size()),
                                 bytes.data(), &size) ||
        size != static_cast<EGLint>(bytes.size()))
        return {};
    return uuidText(bytes.data());
}

std::optional<int> cudaOrdinal(EGLDeviceEXT device) {
    EGLAttrib value = 0;
    if (!eglLibrary().query_device_attrib(device, EGL_CUDA_DEVICE_NV, &value)) return std::nullopt;
    return static_cast<int>(value);
}

std::string deviceName(EGLDeviceEXT device, int index, std::string_view extensions) {
    const auto& egl = eglLibrary();
    std::string name = "device " + std::to_string(index);
    if (hasWord(extensions, "EGL_EXT_device_drm")) {
        if (const char* file = egl.query_device_string(device, EGL_DRM_DEVICE_FILE_EXT))
            name += std::string(" (") + file + ")";
    }
    return name;
}

Listed describe(EGLDeviceEXT handle, int index) {
    Listed listed;
    listed.handle = handle;
    Device& device = listed.device;
    // Queries attributes only of devices with an extension string. Some drivers also list devices
    // that the process's cgroup forbids, and crash if attributes of these devices are queried.
    const char* text = eglLibrary().query_device_string(handle, EGL_EXTENSIONS);
    if (!text) {
        device.name = "device " + std::to_string(index);
        device.problem = "the driver lists it without details: it may belong to another job";
        return listed;
    }
    device.software = hasWord(text, "EGL_MESA_device_software");
    device.name = device.software ? "Mesa's software device" : deviceName(handle, index, text);
    device.uuid = uuidOf(handle, text);
    listed.has_number = eglLibrary().query_device_attrib && hasWord(text, "EGL_NV_device_cuda");
    if (listed.has_number) listed.ordinal = cudaOrdinal(handle);
    return listed;
}

/// Assigns CUDA numbers, and marks devices hidden by CUDA_VISIBLE_DEVICES as unusable.
void numberForCuda(std::vector<Listed>& devices) {
    std::vector<CudaDevice> all;
    std::vector<std::size_t> positions;
    for (std::size_t i = 0; i < devices.size(); ++i) {
        if (!devices[i].has_number) continue;
        all.push_back({devices[i].ordinal, devices[i].device.uuid});
        positions.push_back(i);
    }
    // If no device has an ordinal, CUDA is not available.
    if (std::none_of(all.begin(), all.end(), [](const CudaDevice& gpu) { return gpu.ordinal; }))
        return;
    const auto variable = cudaVisibleDevices();
    const auto visible = visibleCudaDevices(variable, all);
    for (std::size_t number = 0; number < visible.size(); ++number)
        devices[positions[visible[number]]].device.cuda = static_cast<int>(number);
    for (const std::size_t position : positions) {
        Device& device = devices[position].device;
        if (variable && !device.cuda)
            device.problem = "CUDA_VISIBLE_DEVICES (" + *variable + ") hides it";
    }
}

std::vector<Listed> listedDevices() {
    const auto& egl = eglLibrary();
    std::vector<Listed> devices;
    if (!egl.query_devices || !egl.query_device_string ||
        !hasWord(egl.client_extensions, "EGL_EXT_platform_device"))
        return devices;
    std::array<EGLDeviceEXT, 64> handles{};
    EGLint count = 0;
    if (!egl.query_devices(static_cast<EGLint>(handles.size()), handles.data(), &count)) return {};
    for (int i = 0; i < count; ++i)
        devices.push_back(describe(handles[static_cast<std::size_t>(i)], i));
    numberForCuda(devices);
    return devices;
}

}  // namespace

std::vector<Candidate> eglCandidates() {
    const auto& egl = eglLibrary();
    if (!egl.problem.empty()) {
        Device device;
        device.backend = "egl";
        device.name = "EGL";
        device.problem = egl.problem;
        return {{device, nullptr}};
    }
    std::vector<Candidate> hardware, software;
    for (const Listed& listed : listedDevices()) {
        (listed.device.software ? software : hardware)
            .push_back(candidate(listed.device, EGL_PLATFORM_DEVICE_EXT, listed.handle));
    }
    if (hasWord(egl.client_extensions, "EGL_MESA_platform_surfaceless")) {
        Device device;
        device.name = "Mesa's surfaceless platform";
        device.software = true;
        software.push_back(candidate(std::move(device), EGL_PLATFORM_SURFACELESS_MESA,
                                     reinterpret_cast<void*>(EGL_DEFAULT_DISPLAY)));
    }
    hardware.insert(hardware.end(), software.begin(), software.end());
    if (hardware.empty()) {
        Device device;
        device.backend = "egl";
        device.name = "EGL";
        device.problem = "EGL lists no device and has no surfaceless platform";
        hardware.push_back({device, nullptr});
    }
    return hardware;
}

}  // namespace peeler::gl
