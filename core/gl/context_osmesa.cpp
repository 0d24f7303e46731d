// SPDX-License-Identifier: Apache-2.0
// OSMesa: Mesa's off-screen rasteriser, which needs no window-system library.
#include <dlfcn.h>

#include <array>
#include <cstdint>

#include "core/gl/backend.h"
#include "core/gl/functions.h"

namespace peeler::gl {
namespace {

// Declarations from GL/osmesa.h, repeated here so that the build does not need OSMesa's package.
// The library is loaded at run time, if it exists (Mesa 25.1 dropped it).
using OSMesaContext = struct osmesa_context*;
constexpr int kOsmesaFormat = 0x22, kOsmesaRgba = 0x1908;
constexpr int kOsmesaDepthBits = 0x30, kOsmesaStencilBits = 0x31, kOsmesaProfile = 0x33;
constexpr int kOsmesaCoreProfile = 0x34, kOsmesaMajor = 0x36, kOsmesaMinor = 0x37;

struct OsmesaLibrary {
    OSMesaContext (*create)(const int*, OSMesaContext) = nullptr;
    void (*destroy)(OSMesaContext) = nullptr;
    unsigned char (*make_current)(OSMesaContext, void*, GLenum, GLsizei, GLsizei) = nullptr;
    void* (*proc_address)(const char*) = nullptr;
    std::string problem;
};

const OsmesaLibrary& osmesaLibrary() {
    static const OsmesaLibrary loaded = [] {
        OsmesaLibrary lib;
        void* handle = nullptr;
        // Loads with RTLD_LOCAL, because the library's gl* symbols would otherwise shadow libGL's.
        // Never closes the library, because Mesa keeps threads.
        for (const char* name : {"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"})
            if (!handle) handle = dlopen(name, RTLD_NOW | RTLD_LOCAL);
        if (!handle) {
            lib.problem = std::string(dlerror()) + " (Debian: libosmesa6)";
            return lib;
        }
        lib.create =
            reinterpret_cast<decltype(lib.create)>(dlsym(handle, "OSMesaCreateContextAttribs"));
        lib.destroy =
            reinterpret_cast<decltype(lib.destroy)>(dlsym(handle, "OSMesaDestroyContext"));
        lib.make_current =
            reinterpret_cast<decltype(lib.make_current)>(dlsym(handle, "OSMesaMakeCurrent"));
        lib.proc_address =
            reinterpret_cast<decltype(lib.proc_address)>(dlsym(handle, "OSMesaGetProcAddress"));
        if (!lib.create || !lib.destroy || !lib.make_current || !lib.proc_address)
            lib.problem = "libOSMesa is too old: OSMesaCreateContextAttribs is missing";
        return lib;
    }();
    return loaded;
}

class OsmesaContextHolder final : public Context {
  public:
    OsmesaContextHolder(OSMesaContext context, const Device& device) : context_(context) {
        device_ = device;
        functions_ = std::make_unique<Functions>();
    }
    ~OsmesaContextHolder() override {
        osmesaLibrary().make_current(nullptr, nullptr, 0, 0, 0);
        osmesaLibrary().destroy(context_);
    }
    bool makeCurrent() {
        return osmesaLibrary().make_current(context_, buffer_.data(), GL_UNSIGNED_BYTE, kSize,
                                            kSize);
    }
    Functions& mutableFunctions() { return *functions_; }

  private:
    /// Pixels per side of the colour buffer that OSMesa requires but peeler does not use.
    static constexpr int kSize = 4;
    OSMesaContext context_;
    std::array<std::uint32_t, static_cast<std::size_t>(kSize) * kSize> buffer_{};
};

/// Opens a context. Loads the OSMesa library only now, because the library loads LLVM, which a run
/// on a GPU does not need.
std::unique_ptr<Context> openOsmesaContext(const Device& device, std::string& problem) {
    problem = osmesaLibrary().problem;
    if (!problem.empty()) return nullptr;
    const std::array<int, 13> attributes = {kOsmesaFormat,
                                            kOsmesaRgba,
                                            kOsmesaDepthBits,
                                            0,
                                            kOsmesaStencilBits,
                                            0,
                                            kOsmesaProfile,
                                            kOsmesaCoreProfile,
                                            kOsmesaMajor,
                                            4,
                                            kOsmesaMinor,
                                            5,
                                            0};
    OSMesaContext handle = osmesaLibrary().create(attributes.data(), nullptr);
    if (!handle) {
        problem = "OSMesa has no OpenGL 4.5 core context";
        return nullptr;
    }
    auto context = std::make_unique<OsmesaContextHolder>(handle, device);
    if (!context->makeCurrent()) {
        problem = "OSMesaMakeCurrent failed";
        return nullptr;
    }
    const std::string missing = loadFunctions(context->mutableFunctions(), [](const char* name) {
        return osmesaLibrary().proc_address(name);
    });
    if (!missing.empty()) {
        problem = "the function " + missing + " is missing";
        return nullptr;
    }
    return context;
}

}  // namespace

std::vector<Candidate> osmesaCandidates() {
    Device device;
    device.backend = "osmesa";
    device.name = "off-screen Mesa";
    device.software = true;
    return {
        {device, [device](std::string& problem) { return openOsmesaContext(device, problem); }}};
}

}  // namespace peeler::gl
