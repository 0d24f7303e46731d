// SPDX-License-Identifier: Apache-2.0
#include "core/gl/context.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include <peeler/error.h>
#include "core/base/parallel.h"
#include "core/gl/backend.h"
#include "core/gl/functions.h"

namespace peeler::gl {
namespace {

// The table of backends, in the order in which `auto` tries them. OSMesa is last, because Mesa 25.1
// dropped it.
constexpr std::array<Backend, 2> kBackends = {{
    {"egl", eglCandidates},
    {"osmesa", osmesaCandidates},
}};

std::string text(const GLubyte* bytes) {
    return bytes ? reinterpret_cast<const char*>(bytes) : "";
}

}  // namespace

std::string examine(const Functions& gl, Device& device) {
    device.version = text(gl.GetString(GL_VERSION));
    device.renderer = text(gl.GetString(GL_RENDERER));
    device.vendor = text(gl.GetString(GL_VENDOR));
    const bool software_name = device.renderer.find("llvmpipe") != std::string::npos ||
                               device.renderer.find("softpipe") != std::string::npos ||
                               device.renderer.find("SWR") != std::string::npos;
    device.software = device.software || software_name;
    // On the surfaceless platform, Mesa chooses the driver, which is a GPU's driver if there is a
    // GPU. Only the renderer's name then shows whether the device is software.
    if (device.name.find("surfaceless") != std::string::npos) device.software = software_name;

    const auto integer = [&](GLenum name) {
        GLint value = 0;
        gl.GetIntegerv(name, &value);
        return value;
    };
    Limits& limits = device.limits;
    GLint64 block = 0;
    gl.GetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &block);
    limits.shader_storage_block_size = block;
    limits.fragment_storage_blocks = integer(GL_MAX_FRAGMENT_SHADER_STORAGE_BLOCKS);
    limits.framebuffer_width = integer(GL_MAX_FRAMEBUFFER_WIDTH);
    limits.framebuffer_height = integer(GL_MAX_FRAMEBUFFER_HEIGHT);
    std::array<GLint, 2> viewport{};
    gl.GetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport.data());
    limits.viewport_width = viewport[0];
    limits.viewport_height = viewport[1];
    limits.texture_size = integer(GL_MAX_TEXTURE_SIZE);
    limits.texture_layers = integer(GL_MAX_ARRAY_TEXTURE_LAYERS);
    limits.texture_units = integer(GL_MAX_TEXTURE_IMAGE_UNITS);
    limits.subpixel_bits = integer(GL_SUBPIXEL_BITS);
    std::array<GLint, 2> points{};
    gl.GetIntegerv(GL_POINT_SIZE_RANGE, points.data());
    limits.point_size = points[1];
    limits.framebuffer_fetch = hasExtension(gl, "GL_EXT_shader_framebuffer_fetch");

    const int major = integer(GL_MAJOR_VERSION), minor = integer(GL_MINOR_VERSION);
    if (major * 10 + minor < 45) {
        return "it has OpenGL " + std::to_string(major) + "." + std::to_string(minor) +
               ", but 4.5 core is needed";
    }
    // dual_composite.frag needs the most storage blocks: list heads, counts, depths, stamps,
    // lights, and two blocks for a clip mesh.
    constexpr int kStorageBlocks = 7;
    if (limits.fragment_storage_blocks < kStorageBlocks) {
        return "it has " + std::to_string(limits.fragment_storage_blocks) +
               " storage blocks in fragment shaders, but " + std::to_string(kStorageBlocks) +
               " are needed";
    }
    return {};
}

namespace {

#ifndef NDEBUG
void APIENTRY printMessage(GLenum, GLenum type, GLuint, GLenum, GLsizei, const GLchar* message,
                           const void*) {
    if (type == GL_DEBUG_TYPE_ERROR || type == GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR)
        std::fprintf(stderr, "GL: %s\n", message);
}
#endif

/// Throws Error (kMemory) if not all threads of the software rasteriser can be started. llvmpipe
/// waits forever for threads that it failed to start (Mesa 22.3.6 to 25.0.7: lp_rast_create()
/// starts fewer threads, but lp_setup_create() expects all of them to signal its fences).
void requireRasterizerThreads() {
    constexpr long kMost = 32;  // llvmpipe's LP_MAX_THREADS, which is 16 in Mesa 22.3
    const char* const set = std::getenv("LP_NUM_THREADS");
    const long all = set ? std::strtol(set, nullptr, 0) : sysconf(_SC_NPROCESSORS_ONLN);
    const int needed = static_cast<int>(std::clamp(all, 1L, kMost));
    // Tries again, since another process may hold the remaining threads only briefly.
    constexpr int kTries = 3;
    constexpr std::chrono::milliseconds kBetweenTries{20};
    int startable = 0;
    for (int attempt = 0; attempt < kTries && startable < needed; ++attempt) {
        if (attempt > 0) std::this_thread::sleep_for(kBetweenTries);
        startable = startableThreads(needed);
    }
    if (startable == needed) return;
    throw Error(ErrorKind::kMemory,
                startable == 0
                    ? "cannot start a thread"
                    : "only " + std::to_string(startable) + " of the " + std::to_string(needed) +
                          " threads of the software rasteriser can be started",
                "",
                std::string(kMoreThreads) +
                    (startable == 0 ? "" : ", or set LP_NUM_THREADS to a smaller number"));
}

/// Opens and examines a candidate. On failure, returns null and sets device.problem. Throws Error
/// (kMemory) if the driver would hang (requireRasterizerThreads()).
std::unique_ptr<Context> tryOpen(Candidate& candidate, Device& device) {
    device = candidate.device;
    if (!device.problem.empty()) return nullptr;
    if (device.software) requireRasterizerThreads();
    auto context = candidate.open(device.problem);
    if (!context) return nullptr;
    device.problem = examine(context->functions(), device);
    if (!device.problem.empty()) return nullptr;
#ifndef NDEBUG
    const Functions& gl = context->functions();
    gl.Enable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    gl.DebugMessageCallback(printMessage, nullptr);
#endif
    return context;
}

struct BackendCandidate {
    const Backend* backend;
    Candidate candidate;
};

std::vector<BackendCandidate> allCandidates() {
    std::vector<BackendCandidate> rows;
    for (const auto& backend : kBackends)
        for (auto& candidate : backend.candidates())
            rows.push_back({&backend, std::move(candidate)});
    for (std::size_t i = 0; i < rows.size(); ++i)
        rows[i].candidate.device.index = static_cast<int>(i);
    return rows;
}

std::string quotedList(const std::vector<std::string>& names) {
    std::string list;
    for (const auto& name : names)
        list += (list.empty() ? "" : ", ") + name;
    return list;
}

/// Returns "0 = egl, device 0 (/dev/dri/card0), cuda:0, uuid:8932f937-…".
std::string shortText(const Device& device) {
    std::string text = std::to_string(device.index) + " = " + device.backend + ", " + device.name;
    if (device.cuda) text += ", cuda:" + std::to_string(*device.cuda);
    if (!device.uuid.empty()) text += ", uuid:" + device.uuid;
    return text;
}

/// Returns the candidates to try. Throws Error (kDevice) if the requested device is not among them,
/// or if the request is ambiguous.
std::vector<BackendCandidate> requested(const ContextRequest& request) {
    std::vector<BackendCandidate> rows;
    std::string list;
    for (BackendCandidate& row : allCandidates()) {
        if (request.backend != "auto" && request.backend != row.backend->name) continue;
        const Device& device = row.candidate.device;
        list += "\n" + shortText(device);
        if (request.device.matches(device)) rows.push_back(std::move(row));
    }
    const bool ambiguous = request.device.given() && rows.size() > 1;
    if (!rows.empty() && !ambiguous) return rows;
    throw Error(ErrorKind::kDevice,
                ambiguous ? std::to_string(rows.size()) + " devices have a UUID with this beginning"
                          : "unknown device",
                Parameter::kDevice + " " + request.device.text(), "choose one of:" + list);
}

/// Opens the first usable candidate. Returns null if no candidate is usable. `attempts` receives a
/// sentence for each candidate that failed.
std::unique_ptr<Context> openFirst(std::vector<BackendCandidate> rows,
                                   const ContextRequest& request,
                                   std::vector<std::string>& attempts) {
    for (auto& row : rows) {
        Device device;
        auto context = tryOpen(row.candidate, device);
        if (context && request.require_gpu && device.software) {
            device.problem = "it renders in software (" + device.renderer + ")";
            context.reset();
        }
        if (context) {
            if (request.core_only) device.limits.framebuffer_fetch = false;
            context->setDevice(device);
            return context;
        }
        attempts.push_back(device.backend + ", " + device.name + ": " + device.problem);
    }
    return nullptr;
}

}  // namespace

Context::Context() = default;
Context::~Context() = default;

std::vector<std::string> backendNames() {
    std::vector<std::string> names;
    for (const auto& backend : kBackends)
        names.emplace_back(backend.name);
    return names;
}

std::vector<Device> listDevices() {
    std::vector<Device> devices;
    for (auto& row : allCandidates()) {
        Device device;
        try {
            tryOpen(row.candidate, device);
        } catch (const Error& error) {
            device.problem = error.what();
        }
        devices.push_back(std::move(device));
    }
    return devices;
}

std::unique_ptr<Context> createContext(const ContextRequest& request,
                                       std::vector<std::string>* failed_attempts) {
    bool known = request.backend == "auto";
    for (const auto& backend : kBackends)
        known = known || request.backend == backend.name;
    if (!known) {
        throw Error(ErrorKind::kUsage, "unknown backend '" + request.backend + "'",
                    Parameter::kBackend, "choose auto, " + quotedList(backendNames()));
    }
    std::vector<std::string> attempts;
    auto context = openFirst(requested(request), request, attempts);
    if (failed_attempts) *failed_attempts = attempts;
    if (context) return context;
    std::string reasons;
    for (const auto& attempt : attempts)
        reasons += (reasons.empty() ? "" : "; ") + attempt;
    throw Error(ErrorKind::kDevice, "no usable OpenGL 4.5 device: " + reasons, "",
                request.require_gpu
                    ? "leave out " + Parameter::kRequireGpu + " to render in software"
                    : kInstallDriver + std::string("; ") + Parameter::kListDevices +
                          " shows every attempt");
}

std::unique_ptr<Context> findGpuContext(std::vector<std::string>* failed_attempts) {
    std::vector<BackendCandidate> rows = allCandidates();
    for (BackendCandidate& row : rows) {
        Device& device = row.candidate.device;
        if (device.software && device.problem.empty()) device.problem = "it renders in software";
    }
    std::vector<std::string> attempts;
    auto context = openFirst(std::move(rows), {.require_gpu = true}, attempts);
    if (failed_attempts) *failed_attempts = std::move(attempts);
    return context;
}

}  // namespace peeler::gl
