// SPDX-License-Identifier: Apache-2.0
// Headless OpenGL 4.5 core contexts, from EGL or OSMesa, chosen at run time.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/gl/device_choice.h"

namespace peeler::gl {

struct Functions;

/// Driver limits. They affect how a picture is divided into bands, and limit the settings that a
/// user may request.
struct Limits {
    std::int64_t shader_storage_block_size = 0;  ///< maximum size, in bytes
    int fragment_storage_blocks = 0;
    int framebuffer_width = 0, framebuffer_height = 0;
    int viewport_width = 0, viewport_height = 0;
    int texture_size = 0;
    int texture_layers = 0;  ///< maximum number of layers of an array texture
    int texture_units = 0;   ///< maximum number of texture units in a fragment shader
    int subpixel_bits = 0;
    int point_size = 1;              ///< maximum pixels per side of a point
    bool framebuffer_fetch = false;  ///< whether fragment shaders can read the pixel they overwrite
};

/// A device to open a context on, with the result of trying it.
struct Device {
    std::string backend;      ///< name in the backend table: "egl", "osmesa"
    int index = 0;            ///< index among the devices of all backends, in the order of trying
    std::string name;         ///< name in the backend: "device 0 (/dev/dri/card0)", "surfaceless"
    std::string uuid;         ///< "8932f937-d72c-4106-c12f-20bd9faed9f6"; "" if unknown
    std::optional<int> cuda;  ///< CUDA number under CUDA_VISIBLE_DEVICES
    bool software = false;    ///< whether the device renders on the CPU
    std::string version;      ///< GL_VERSION
    std::string renderer;     ///< GL_RENDERER
    std::string vendor;       ///< GL_VENDOR
    Limits limits;
    std::string problem;  ///< why the device is unusable, one sentence; empty if usable
};

/// A current context. Belongs to the thread that opened it.
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

/// Sets the version and limits from the current context. Returns the missing requirement as one
/// sentence, or "".
std::string examine(const Functions& gl, Device& device);

/// Returns the names in the backend table, in the order in which `auto` tries them.
std::vector<std::string> backendNames();

/// Tries every device of every backend and returns the results. Never throws for a failing device.
std::vector<Device> listDevices();

/// Requirements for a context.
struct ContextRequest {
    std::string backend = "auto";  ///< "auto", or the name of a backend
    DeviceChoice device{};         ///< choice among the devices of all backends
    bool require_gpu = false;      ///< whether to refuse software renderers
    bool core_only = false;        ///< whether to use OpenGL 4.5 core without extensions

    bool choosesDevice() const { return backend != "auto" || device.given() || require_gpu; }
    bool operator==(const ContextRequest&) const = default;
};

/// A hint for a machine without a usable device.
inline constexpr char kInstallDriver[] =
    "install a GPU's driver, or Mesa: libegl1 libgl1-mesa-dri (Debian, Ubuntu), mesa-libEGL "
    "mesa-dri-drivers (Fedora, Rocky), mesa (Arch)";

/// Makes a context current on this thread. Never uses a GPU that CUDA_VISIBLE_DEVICES hides, even
/// on request. `failed_attempts` (may be null) receives one sentence for each device tried before
/// the usable one. Throws Error (kDevice) with a list of all attempts or, if the requested device
/// does not exist, of the existing devices; (kUsage) if the backend is unknown.
std::unique_ptr<Context> createContext(const ContextRequest& request,
                                       std::vector<std::string>* failed_attempts = nullptr);

/// Returns a context of the first usable GPU, current on this thread; null if there is no usable
/// GPU. Fast, because devices that are listed as software are not opened. `failed_attempts` is as
/// in createContext().
std::unique_ptr<Context> findGpuContext(std::vector<std::string>* failed_attempts = nullptr);

}  // namespace peeler::gl
