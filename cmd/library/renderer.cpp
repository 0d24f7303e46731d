// SPDX-License-Identifier: Apache-2.0
#include "cmd/library/renderer.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "cmd/library/worker.h"
#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/base/process_memory.h"
#include "core/capture/gl_renderer.h"
#include "core/gl/adopted_context.h"
#include "core/gl/borrowed_state.h"
#include "core/gl/context.h"
#include "core/image/image_sink.h"
#include "core/raster/hit_rasterizer.h"
#include "core/scene/framing.h"
#include "core/scene/posed_scene.h"

namespace peeler::inline v0 {
namespace {

PosedScene posed(const Shown& shown) {
    if (!shown.scene) throw Error(ErrorKind::kUsage, "there is no scene to show");
    const Scene& scene = *shown.scene;
    checkScene(scene);
    const int index = shown.index < 0 ? scene.default_scene : shown.index;
    if (shown.animations.empty()) return {scene, index};
    for (const int animation : shown.animations)
        if (animation < 0 || static_cast<std::size_t>(animation) >= scene.animations.size())
            throw Error(ErrorKind::kUsage, "the scene has no such animation",
                        "`animations` " + std::to_string(animation),
                        "it has " + std::to_string(scene.animations.size()));
    return {scene, index, poseAt(scene, shown.animations, shown.time)};
}

/// Puts composited bands together.
class CompositeSink final : public Sink {
  public:
    void begin(const Plan& plan) override {
        image.window = plan.view.crop;
        image.rgba.reserve(image.window.pixels());
        image.z.reserve(image.window.pixels());
    }
    void write(LayeredImage&& band) override {
        compositeOver(band, {}, part_);
        image.appendRows(part_, band.window.y0, band.window.y1);
    }
    void finish() override {}
    SinkMemory memory(const Plan& plan) const override {
        return {.bytes = plan.view.crop.pixels() * CompositeImage::pixelBytes(true)};
    }

    CompositeImage image;

  private:
    CompositeImage part_;
};

}  // namespace

std::optional<Bounds> boundsOf(const Shown& shown) {
    return posed(shown).bounds();
}

View viewOf(const Shown& shown, const CameraChoice& camera) {
    checkCamera(camera);
    const PosedScene scene = posed(shown);
    if (shown.animations.empty()) return makeView(scene, SceneExtent(scene), camera);
    // What moves is framed once for all times.
    const int index = shown.index < 0 ? shown.scene->default_scene : shown.index;
    return makeView(scene, SceneExtent(*shown.scene, index, shown.animations), camera);
}

CaptureSettings raySettings() {
    CaptureSettings settings;
    settings.faces = Faces::kBoth;
    settings.hit_mode = HitMode::kRefined;
    settings.color_type = PixelType::kFloat;
    settings.depth_clamp = true;
    return settings;
}

/// What lives on the worker's thread. The context outlives what needs it.
struct Renderer::State {
    explicit State(const RendererOptions& wanted) : options(wanted), worker(!wanted.adopt) {
        if (options.adopt) adopt();
    }
    ~State() {
        worker.run(
            [this](const Progress&) {
                if (adopted && !adopted->current()) adopted->abandonObjects();
                close();
            },
            {});
    }

    void adopt();
    /// The adopted context, its state peeler's until the call ends.
    gl::Context& borrow();
    gl::Context& openContext();
    GlRenderer& openRenderer(const Shown& shown, const PosedScene& posed);
    HitSource& openHits(const Shown& shown, const PosedScene& posed, RayEngine engine);
    void close() {
        gl.reset();
        gl_scene.reset();
        borrowed.reset();
        adopted = nullptr;
        context.reset();
    }
    /// Ends a call that has thrown.
    void giveUp(bool device_lost);
    /// Does the work; what it throws may have left the scene's GL objects in any state.
    void run(const Worker::Work& work, const Progress& progress);
    void capture(HitSource& source, const View& view, CaptureSettings settings, Sink& sink,
                 Plan& plan, const Progress& progress) const;

    RendererOptions options;
    std::unique_ptr<gl::Context> context;
    gl::AdoptedContext* adopted = nullptr;      ///< the context, if it is one
    std::optional<gl::BorrowedState> borrowed;  ///< during a call that uses an adopted context
    std::vector<unsigned> pending_errors;       ///< its owner's
    std::shared_ptr<const Scene> gl_scene;      ///< what `gl` has uploaded
    int gl_index = 0;
    std::optional<GlRenderer> gl;
    std::shared_ptr<const Scene> cpu_scene;
    std::unique_ptr<HitRasterizer> rasterizer;  ///< of the call at hand
    Worker worker;                              // last: it ends first
};

void Renderer::State::adopt() {
    auto found = std::make_unique<gl::AdoptedContext>(options.adopt);
    adopted = found.get();
    context = std::move(found);
}

gl::Context& Renderer::State::borrow() {
    if (borrowed) return *context;
    if (!context) adopt();  // it was lost
    adopted->requireCurrent();
    const gl::Functions& functions = adopted->functions();
    for (const unsigned code : gl::takeErrors(functions))
        if (std::ranges::find(pending_errors, code) == pending_errors.end())
            pending_errors.push_back(code);
    gl::requireNothingBegun(functions);
    borrowed.emplace(functions);
    return *context;
}

gl::Context& Renderer::State::openContext() {
    if (options.adopt) return borrow();
    if (context) return *context;
    gl::ContextRequest request;
    request.backend = options.backend;
    if (!options.device.empty()) request.device = gl::parseDeviceChoice(options.device);
    request.require_gpu = options.require_gpu;
    context = gl::createContext(request);
    return *context;
}

GlRenderer& Renderer::State::openRenderer(const Shown& shown, const PosedScene& posed) {
    gl::Context& opened = openContext();
    const int index = shown.index < 0 ? shown.scene->default_scene : shown.index;
    if (gl && gl_scene == shown.scene && gl_index == index) {
        gl->setPose(posed);
        return *gl;
    }
    gl.reset();
    gl_scene = shown.scene;
    gl_index = index;
    return gl.emplace(opened, posed);
}

HitSource& Renderer::State::openHits(const Shown& shown, const PosedScene& posed,
                                     RayEngine engine) {
    if (engine == RayEngine::kAuto) {
        if (!context && !options.adopt && options.device.empty() && options.backend == "auto")
            context = gl::findGpuContext();
        const bool on_gpu = options.adopt || (context && !context->device().software) ||
                            !options.device.empty() || options.backend != "auto";
        engine = on_gpu ? RayEngine::kGl : RayEngine::kCpu;
    }
    if (engine == RayEngine::kGl) return openRenderer(shown, posed);
    rasterizer = std::make_unique<HitRasterizer>(posed);
    return *rasterizer;
}

void Renderer::State::giveUp(bool device_lost) {
    rasterizer.reset();
    // Where nothing was borrowed, the scene's objects are as they were, and may not be those of the
    // context that is current.
    if (options.adopt && !borrowed) return;
    gl.reset();
    borrowed.reset();
    if (device_lost) close();
}

void Renderer::State::run(const Worker::Work& work, const Progress& progress) {
    worker.run(
        [&](const Progress& report) {
            try {
                work(report);
                rasterizer.reset();
                borrowed.reset();
            } catch (const Error& error) {
                giveUp(error.kind() == ErrorKind::kDevice);
                throw;
            } catch (...) {
                giveUp(false);
                throw;
            }
        },
        progress);
}

void Renderer::State::capture(HitSource& source, const View& view, CaptureSettings settings,
                              Sink& sink, Plan& plan, const Progress& progress) const {
    if (options.memory != 0) {
        settings.memory = options.memory;
        settings.memory.base = residentBytes();
    }
    const CapturePlan planned = source.plan(view, settings, progress);
    plan = planned;
    sink.begin(plan);
    source.capture(planned, sink, progress);
    sink.finish();
}

Renderer::Renderer(const RendererOptions& options) : state_(std::make_unique<State>(options)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

std::string Renderer::device() {
    std::string name;
    state_->run([&](const Progress&) { name = state_->openContext().device().renderer; }, {});
    return name;
}

std::vector<unsigned> Renderer::takePendingErrors() {
    std::vector<unsigned> errors;
    state_->worker.run([&](const Progress&) { errors.swap(state_->pending_errors); }, {});
    return errors;
}

Plan Renderer::capture(const Shown& shown, const View& view, const CaptureSettings& settings,
                       Sink& sink, const Progress& progress) {
    Plan plan;
    state_->run(
        [&](const Progress& report) {
            const PosedScene scene = posed(shown);
            CaptureSettings wanted = settings;
            wanted.tinted = wanted.tinted || (shown.colored_glass && scene.hasTintedGlass());
            state_->capture(state_->openRenderer(shown, scene), view, wanted, sink, plan, report);
        },
        progress);
    return plan;
}

LayeredImage Renderer::layers(const Shown& shown, const View& view, const CaptureSettings& settings,
                              const Progress& progress) {
    ImageSink sink;
    capture(shown, view, settings, sink, progress);
    return std::move(sink.image);
}

CompositeImage Renderer::composite(const Shown& shown, const View& view,
                                   const CaptureSettings& settings, const Progress& progress) {
    CaptureSettings wanted = settings;
    wanted.composite = true;
    CompositeSink sink;
    capture(shown, view, wanted, sink, progress);
    return std::move(sink.image);
}

LayeredImage Renderer::rays(const Shown& shown, const Bundle& bundle,
                            const CaptureSettings& settings, RayEngine engine,
                            const Progress& progress) {
    ImageSink sink;
    Plan plan;
    state_->run(
        [&](const Progress& report) {
            const PosedScene scene = posed(shown);
            state_->capture(state_->openHits(shown, scene, engine), bundle.view, settings, sink,
                            plan, report);
        },
        progress);
    return std::move(sink.image);
}

}  // namespace peeler::inline v0
