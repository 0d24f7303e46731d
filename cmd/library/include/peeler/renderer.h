// SPDX-License-Identifier: Apache-2.0
// The renderer: captures layers, composites and ray hits into memory or sinks.
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
#include <peeler/gl_layers.h>
#include <peeler/layered_image.h>
#include <peeler/scene.h>
#include <peeler/sink.h>
#include <peeler/view.h>
#include <peeler/work.h>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// A scene and its pose. Do not change the scene after a Renderer has used it, because the Renderer
/// caches it. Make a new Scene for every change.
struct Shown {
    std::shared_ptr<const Scene> scene;
    int index = -1;  ///< index into Scene::scenes; −1 = Scene::default_scene
    /// Animations to play, as indices into Scene::animations; empty = at rest.
    std::vector<int> animations{};
    double time = 0;  ///< seconds
    /// Coloured opacity (LayeredImage::tinted) if the scene has coloured glass. If false, the
    /// opacity of glass is a single alpha.
    bool colored_glass = true;
};

/// Returns the bounding box of the visible geometry, or nothing if there are no vertices.
std::optional<Bounds> boundsOf(const Shown& shown);

/// Returns the view of a camera. Throws Error (kUsage) if the scene lacks the camera (the message
/// lists the cameras), the crop is outside the picture, or the choice is invalid. Throws Error
/// (kInput) if the scene gives the camera no direction or no extent.
View viewOf(const Shown& shown, const CameraChoice& camera = {});

/// Returns settings for ray hits: refined Z, both faces, no clipping at the near and far planes.
CaptureSettings raySettings();

/// The choice of a Renderer's device, and its memory limit.
struct RendererOptions {
    std::string backend = "auto";  ///< "egl", "osmesa", or "auto" (the first of these that works)
    /// A GPU in the list of `peeler devices`: "3", "cuda:1", "uuid:8932f937"; "" = the first GPU
    /// that works or, if none works, the CPU.
    std::string device;
    bool require_gpu = false;  ///< whether to throw an Error instead of falling back to the CPU
    /// Maximum number of bytes by which a call may increase the memory of the process; 0 = no
    /// limit.
    std::uint64_t memory = 0;
    /// A function that returns GL functions by name (eglGetProcAddress, glfwGetProcAddress). If
    /// set, the Renderer borrows the context that is current in its constructor instead of creating
    /// one. The context must be OpenGL 4.5 core. The constructor throws Error (kUsage) if no
    /// context is current, and Error (kDevice) if the context cannot be used. The same context must
    /// be current during every call, on any thread; otherwise, calls that render throw Error
    /// (kUsage). If the context is not current in the destructor, the Renderer's GL objects stay in
    /// the context.
    ///
    /// A call sets all GL state that it depends on and restores the previous state, even if the
    /// call throws. Sinks and progress functions run with peeler's state and must leave or restore
    /// it. Calls throw Error (kUsage) while an occlusion, counting or timer query, conditional
    /// rendering, or unpaused transform feedback is active, because a call cannot restore them. A
    /// call cannot restore some bindings either: a program or pipeline that was deleted while in
    /// use, and a texture or buffer that another context deleted while it was bound here. Pending
    /// GL errors move to takePendingErrors(). The debug callback of the context's owner gets the
    /// messages that peeler's calls cause. State of extensions that peeler does not know must have
    /// its initial value.
    void* (*adopt)(const char* function) = nullptr;
};

enum class RayEngine : std::uint8_t {
    kAuto,  ///< GL if there is a GPU or RendererOptions choose a device; else the CPU
    kCpu,   ///< CPU rasteriser, which needs no GL
    kGl
};

/// Captures pictures of scenes, one call at a time. May be used from any thread; concurrent calls
/// wait for each other. GL objects are created on first use, and the last captured scene stays
/// uploaded. Without RendererOptions::adopt, the Renderer's GL context is current on the Renderer's
/// own thread, and the caller's context is never touched. A call blocks until its work is done and
/// calls the progress function on the caller's thread, every few hundredths of a second. The
/// Renderer stays usable after an error or a cancelled call.
class Renderer {
  public:
    explicit Renderer(const RendererOptions& options = {});
    ~Renderer();
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;

    /// Returns the GL_RENDERER string of the device. Throws Error (kDevice) if there is no device.
    std::string device();

    /// Returns and clears the GL errors that were pending in a borrowed context when calls began:
    /// each code once, oldest first. GL errors cannot be put back, so a call removes them from the
    /// context and keeps them here for the context's owner. Empty without RendererOptions::adopt.
    std::vector<unsigned> takePendingErrors();

    /// Returns all fragments of the view's crop. Throws Error (kUsage) if the settings contradict
    /// each other, Error (kDevice) if the device fails, Error (kMemory) if the call exceeds the
    /// budget or there are 2^32 fragments or more.
    LayeredImage layers(const Shown& shown, const View& view, const CaptureSettings& settings = {},
                        const Progress& progress = {});

    /// Returns the composite, front to back, in linear light, without a background. Any method
    /// works, including the approximate ones. Throws like layers().
    CompositeImage composite(const Shown& shown, const View& view,
                             const CaptureSettings& settings = {}, const Progress& progress = {});

    /// Writes the picture into a sink, band by band. Calls begin(), write() and finish() of the
    /// sink on the Renderer's thread, or on the calling thread if the context is borrowed. Throws
    /// like layers(), and passes on the sink's exceptions.
    Plan capture(const Shown& shown, const View& view, const CaptureSettings& settings, Sink& sink,
                 const Progress& progress = {});

    /// Captures the view's layers into GL buffers of the borrowed context and returns the first
    /// band, top to bottom:
    ///
    ///     for (GlLayers band = renderer.glLayers(shown, view); !band.window.empty();
    ///          band = renderer.nextGlLayers())
    ///         draw(band);
    ///
    /// The whole crop is one band if its fragments fit `settings.band_bytes`, the memory limit and
    /// GL_MAX_SHADER_STORAGE_BLOCK_SIZE. The Renderer owns the buffers: you may read them and bind
    /// them, and must not change or delete them. They are valid until the next call of this
    /// Renderer; a call that frees a bound buffer unbinds it.
    ///
    /// A band can be read in the borrowed context at once, by shaders and by commands: the call
    /// issues all memory barriers. Another context of its share group must first wait for a fence
    /// (glFenceSync) that you place behind the call, then bind the buffers.
    ///
    /// Throws Error (kUsage) without RendererOptions::adopt, and if the settings ask for a
    /// composite, hits, channels or several samples, which the CPU computes. Otherwise throws like
    /// layers().
    GlLayers glLayers(const Shown& shown, const View& view, const CaptureSettings& settings = {},
                      const Progress& progress = {});

    /// Returns the next band of glLayers() or, after the last band, a band with an empty window.
    /// Throws Error (kUsage) if another call has rendered or thrown since glLayers(). Otherwise
    /// throws like layers().
    GlLayers nextGlLayers(const Progress& progress = {});

    /// Returns all hits of a bundle of rays. Z is camera Z. For parallel rays, camera Z is the
    /// distance from the plane where the rays start. The first extra array holds the keys of the
    /// hit primitives. Base `settings` on raySettings(). Among Gaussian splats, which rays of
    /// lenses and lists do not hit, hits have colours (LayeredImage::color).
    LayeredImage rays(const Shown& shown, const Bundle& bundle, const CaptureSettings& settings,
                      RayEngine engine = RayEngine::kAuto, const Progress& progress = {});

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
