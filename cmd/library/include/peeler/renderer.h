// SPDX-License-Identifier: Apache-2.0
// Captures layers, composites and hits of scenes into memory or into sinks.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/camera_choice.h>
#include <peeler/capture_settings.h>
#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include <peeler/scene.h>
#include <peeler/sink.h>
#include <peeler/view.h>
#include <peeler/work.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// A scene as it is to be seen. The scene must not change any more once it has been seen by a
/// Renderer, which keeps it: what is changed is another scene.
struct Shown {
    std::shared_ptr<const Scene> scene;
    int index = -1;                 ///< into Scene::scenes; −1 = Scene::default_scene
    std::vector<int> animations{};  ///< that play, indices into Scene::animations; none = at rest
    double time = 0;                ///< seconds
    /// Glass filters every channel of what is behind it by itself (LayeredImage::tinted), where
    /// there is coloured glass; else it has one alpha.
    bool colored_glass = true;
};

/// The box around what it shows; nothing if there is no vertex.
std::optional<Bounds> boundsOf(const Shown& shown);

/// How a camera sees it. Throws Error (kUsage) for a camera that is not there, with the list, for a
/// crop outside the picture, and for a camera that cannot be; (kInput) for one that the scene gives
/// no direction or no extent.
View viewOf(const Shown& shown, const CameraChoice& camera = {});

/// Settings that capture hits: refined, of both faces, without ends.
CaptureSettings raySettings();

/// Where a Renderer captures.
struct RendererOptions {
    std::string backend = "auto";  ///< "egl", "osmesa", or whichever works first
    /// A GPU of several, as `peeler devices` lists them: "3", "cuda:1", "uuid:8932f937"; "" = the
    /// first that works, the CPU if none does.
    std::string device;
    bool require_gpu = false;  ///< never the CPU
    /// Most bytes that a call takes beyond what the process holds when it begins; 0 = no limit.
    std::uint64_t memory = 0;
    /// The context that is current where the Renderer is made is borrowed instead of making one:
    /// OpenGL 4.5 core, with functions that this gives by name (eglGetProcAddress,
    /// glfwGetProcAddress). The constructor throws Error (kUsage) if no context is current,
    /// (kDevice) if it cannot be used. It has to be current in every call, on whichever thread:
    /// calls that render throw Error (kUsage) if another context is current, or none. The
    /// destructor then leaves its GL objects in the context.
    ///
    /// A call sets all state that its pictures depend on, and puts back what was there, also if it
    /// throws. Within sinks and progress functions the state is peeler's, and has to be left or put
    /// back. Calls throw Error (kUsage) while a query that counts or measures time, conditional
    /// rendering, or transform feedback that is not paused is begun: none of them can be put back.
    /// Nor can these: a program or pipeline that was deleted while it was in use, and a texture or
    /// buffer that another context deleted while it was bound here, are gone after a call; errors
    /// that are pending are taken (takePendingErrors()). The owner's debug callback gets the
    /// messages of peeler's calls. State of extensions that peeler does not know has to be as it is
    /// initially.
    void* (*adopt)(const char* function) = nullptr;
};

/// Which rasteriser finds the hits of rays.
enum class RayEngine : std::uint8_t {
    kAuto,  ///< GL on a GPU, or where RendererOptions choose a device; else the CPU
    kCpu,   ///< needs no GL
    kGl
};

/// Captures any number of pictures of any number of scenes, one call at a time; calls of several
/// threads wait for each other. What is needed of GL is made when it is first needed, and the scene
/// that was captured last stays uploaded. Its context is current on a thread of its own, so that
/// the caller's is never touched, and it may be used from any thread. A call waits for its work and
/// tells its progress on the caller's thread, every few hundredths of a second. After an error, or
/// work that was given up, it can be used on.
class Renderer {
  public:
    explicit Renderer(const RendererOptions& options = {});
    ~Renderer();
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;

    /// GL_RENDERER of the device. Throws Error (kDevice) if there is none.
    std::string device();

    /// The GL errors that were pending in a borrowed context when calls began: each code once,
    /// oldest first. GL cannot put errors back, so a call takes them from the context, keeps them
    /// here for its owner, and works on. Empty afterwards, and without RendererOptions::adopt.
    std::vector<unsigned> takePendingErrors();

    /// All fragments of the view's crop, in memory. Throws Error: (kUsage) for settings that
    /// contradict themselves, (kDevice), (kMemory) over the budget or for 2^32 fragments and more.
    LayeredImage layers(const Shown& shown, const View& view, const CaptureSettings& settings = {},
                        const Progress& progress = {});

    /// Their composite, front to back, in linear light over nothing; by any method, the
    /// approximations too. Throws likewise.
    CompositeImage composite(const Shown& shown, const View& view,
                             const CaptureSettings& settings = {}, const Progress& progress = {});

    /// Band after band into a sink, whose begin() and finish() are called, too, all on the
    /// Renderer's thread. Throws likewise, and what the sink throws.
    Plan capture(const Shown& shown, const View& view, const CaptureSettings& settings, Sink& sink,
                 const Progress& progress = {});

    /// All hits of a bundle of rays: Z is the distance from where parallel rays start, the first
    /// extra array the keys of what was hit. `settings` as raySettings() gives them.
    LayeredImage rays(const Shown& shown, const Bundle& bundle, const CaptureSettings& settings,
                      RayEngine engine = RayEngine::kAuto, const Progress& progress = {});

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
