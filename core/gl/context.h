// SPDX-License-Identifier: Apache-2.0
// A headless OpenGL 4.5 core context, from EGL or OSMesa, chosen at run time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/gl/device_choice.h"

namespace peeler::gl {

struct Functions;

/// The limits that decide how a picture is cut into bands, and what else a user may ask for.
struct Limits {
    std::int64_t shader_storage_block_size = 0;  ///< bytes
    int fragment_storage_blocks = 0;
    int framebuffer_width = 0, framebuffer_height = 0;
    int viewport_width = 0, viewport_height = 0;
    int texture_size = 0;
    int texture_layers = 0;  ///< of an array
    int texture_units = 0;   ///< of fragment shaders
    int subpixel_bits = 0;
    int point_size = 1;              ///< most pixels a side of a point
    bool framebuffer_fetch = false;  ///< fragment shaders can read what they are about to overwrite
};

/// One way to get a context, and what came of trying it.
struct Device {
    std::string backend;  ///< a name of the backend table: "egl", "osmesa"
    int index = 0;        ///< counts through all backends in the order they are tried
    std::string name;     ///< what the backend calls it: "device 0 (/dev/dri/card0)", "surfaceless"
    std::string uuid;     ///< "8932f937-d72c-4106-c12f-20bd9faed9f6"; "" = the driver does not say
    std::optional<int> cuda;  ///< its number in CUDA, under CUDA_VISIBLE_DEVICES
    bool software = false;    ///< renders on the CPU
    std::string version;      ///< GL_VERSION
    std::string renderer;     ///< GL_RENDERER
    std::string vendor;       ///< GL_VENDOR
    Limits limits;
    std::string problem;  ///< why it cannot be used, one sentence; empty if it can
};

/// A current context. Belongs to the thread that made it.
class Context {
  public:
    Context();
    virtual ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;
    const Functions& functions() const { return *functions_; }
    const Device& device() const { return device_; }
    void setDevice(const Device& device) { device_ = device; }

  protected:
    std::unique_ptr<Functions> functions_;
    Device device_;
};

/// Fills version and limits of the current context. Returns what it lacks, one sentence, or "".
std::string examine(const Functions& gl, Device& device);

/// Names of the backend table, in the order `auto` tries them.
std::vector<std::string> backendNames();

/// Tries every device of every backend and reports each. Never throws for a device that does not
/// work.
std::vector<Device> listDevices();

/// What a context is asked to be.
struct ContextRequest {
    std::string backend = "auto";  ///< or a backend's name
    DeviceChoice device{};         ///< of listDevices(), of any backend
    bool require_gpu = false;      ///< refuse software renderers
    bool core_only = false;        ///< use nothing beyond OpenGL 4.5 core, whatever the driver has

    /// Whether anything says which device it is to be.
    bool choosesDevice() const { return backend != "auto" || device.given() || require_gpu; }
    bool operator==(const ContextRequest&) const = default;
};

/// Makes a context current on this thread. A GPU that CUDA_VISIBLE_DEVICES hides is not used,
/// whoever asks for it. `failed_attempts` (may be null) receives one sentence for each device that
/// was tried before the one that worked. Throws Error (kDevice) that lists every attempt, or what
/// there is where the device is not; (kUsage) for an unknown backend.
std::unique_ptr<Context> createContext(const ContextRequest& request,
                                       std::vector<std::string>* failed_attempts = nullptr);

/// A context of the first GPU that can be used, current on this thread; null if there is none,
/// which is found out cheaply: what a backend lists as software is not opened. `failed_attempts` as
/// above.
std::unique_ptr<Context> findGpuContext(std::vector<std::string>* failed_attempts = nullptr);

}  // namespace peeler::gl
