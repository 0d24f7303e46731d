// SPDX-License-Identifier: Apache-2.0
#include <peeler/renderer.h>

#include <optional>
#include <utility>

#include <peeler/error.h>
#include <peeler/image_sink.h>
#include "cmd/library/worker.h"
#include "core/base/process_memory.h"
#include "core/capture/gl_session.h"
#include "core/raster/hit_rasterizer.h"
#include "core/scene/framing.h"
#include "core/scene/posed_scene.h"
#include "core/splats/projected_splats.h"
#include "core/splats/splat_hits.h"

namespace peeler::inline v0 {
namespace {

int indexOf(const Shown& shown) {
    return shown.index < 0 ? shown.scene->default_scene : shown.index;
}

PosedScene posed(const Shown& shown) {
    if (!shown.scene) throw Error(ErrorKind::kUsage, "there is no scene to show");
    const Scene& scene = *shown.scene;
    checkScene(scene);
    const int index = indexOf(shown);
    if (shown.animations.empty()) return {scene, index};
    for (const int animation : shown.animations)
        if (animation < 0 || static_cast<std::size_t>(animation) >= scene.animations.size())
            throw Error(ErrorKind::kUsage, "the scene has no such animation",
                        Parameter::kAnimations + " " + std::to_string(animation),
                        "the number of animations is " + std::to_string(scene.animations.size()));
    return {scene, index, poseAt(scene, shown.animations, shown.time)};
}

/// Returns the settings, with coloured opacity if the scene has coloured glass and `shown` requests
/// it.
CaptureSettings withTint(const Shown& shown, const PosedScene& scene, CaptureSettings settings) {
    settings.tinted = settings.tinted || (shown.colored_glass && scene.hasTintedGlass());
    return settings;
}

/// A sink that joins composited bands into one picture.
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

/// Throws Error (kUsage) if layers with these settings cannot stay in a borrowed context.
void checkOnGpu(const RendererOptions& options, const CaptureSettings& settings) {
    if (!options.adopt)
        throw Error(ErrorKind::kUsage, "only a borrowed GL context can show its owner the buffers",
                    "RendererOptions::adopt", "lend the Renderer a context, or call layers()");
    const std::pair<bool, Text> computed_by_cpu[] = {
        {settings.composite, Parameter::kComposite},
        {settings.hit_mode != HitMode::kNone, "CaptureSettings::hit_mode"},
        {!settings.channels.empty(), Parameter::kChannels},
        {settings.samples > 1, "CaptureSettings::samples"},
    };
    for (const auto& [asked, where] : computed_by_cpu)
        if (asked)
            throw Error(ErrorKind::kUsage,
                        "layers in GL buffers have colour and Z, of one sample per pixel", where,
                        "leave it out, or call layers()");
}

}  // namespace

std::optional<Bounds> boundsOf(const Shown& shown) {
    return posed(shown).bounds();
}

View viewOf(const Shown& shown, const CameraChoice& camera) {
    checkCamera(camera);
    const PosedScene scene = posed(shown);
    if (shown.animations.empty()) return makeView(scene, SceneExtent(scene), camera);
    // All times of an animated scene have the same framing.
    return makeView(scene, SceneExtent(*shown.scene, indexOf(shown), shown.animations), camera);
}

CaptureSettings raySettings() {
    CaptureSettings settings;
    settings.faces = Faces::kBoth;
    settings.hit_mode = HitMode::kRefined;
    settings.color_type = PixelType::kFloat;
    settings.depth_clamp = true;
    return settings;
}

struct Renderer::State {
    explicit State(const RendererOptions& wanted)
        : options(wanted), gl(std::in_place, wanted.adopt), worker(!wanted.adopt) {}
    ~State() {
        worker.run([this](const Progress&) { gl.reset(); }, {});
    }

    /// The bands of glLayers(), and the next one to capture.
    struct GlBands {
        GlRenderer* renderer = nullptr;
        CapturePlan plan;
        std::vector<Window> windows;
        std::size_t next = 0;
    };

    /// Throws Error (kUsage) if the device name has an unknown form.
    gl::ContextRequest request() const;
    GlRenderer& openRenderer(const Shown& shown, const PosedScene& posed);
    HitSource& openHits(const Shown& shown, const PosedScene& posed, RayEngine engine, bool splats);
    /// Runs the work. If the work throws, discards the scene's GL objects, because their state is
    /// unknown.
    void run(const Worker::Work& work, const Progress& progress);
    CapturePlan plan(HitSource& source, const View& view, CaptureSettings settings,
                     const Progress& progress) const;
    void capture(HitSource& source, const View& view, const CaptureSettings& settings, Sink& sink,
                 Plan& plan, const Progress& progress) const;
    GlLayers nextGlLayers(const Progress& progress);

    RendererOptions options;
    std::optional<GlSession> gl;
    std::unique_ptr<HitRasterizer> rasterizer;  ///< the CPU rasteriser of the current call
    std::unique_ptr<SplatHits> splat_hits;      ///< the splats of the current call
    std::optional<GlBands> gl_bands;            ///< set by glLayers(), until another call renders
    Worker worker;                              // last, so that it is destroyed first
};

gl::ContextRequest Renderer::State::request() const {
    gl::ContextRequest asked;
    asked.backend = options.backend;
    if (!options.device.empty()) asked.device = gl::parseDeviceChoice(options.device);
    asked.require_gpu = options.require_gpu;
    return asked;
}

GlRenderer& Renderer::State::openRenderer(const Shown& shown, const PosedScene& posed) {
    gl_bands.reset();
    return gl->renderer(request(), shown.scene, indexOf(shown), posed);
}

HitSource& Renderer::State::openHits(const Shown& shown, const PosedScene& posed, RayEngine engine,
                                     bool splats) {
    if (engine == RayEngine::kAuto) {
        std::string reasons;
        const bool on_gpu = options.adopt || request().choosesDevice() || gl->findGpu(reasons);
        engine = on_gpu ? RayEngine::kGl : RayEngine::kCpu;
    }
    HitSource* source = nullptr;
    if (engine == RayEngine::kGl) {
        source = &openRenderer(shown, posed);
    } else {
        rasterizer = std::make_unique<HitRasterizer>(posed);
        source = rasterizer.get();
    }
    if (!splats || !hasSplats(posed)) return *source;
    splat_hits = std::make_unique<SplatHits>(*source);
    return *splat_hits;
}

void Renderer::State::run(const Worker::Work& work, const Progress& progress) {
    worker.run(
        [&](const Progress& report) {
            const auto discard = [this](bool device_lost) {
                splat_hits.reset();
                rasterizer.reset();
                gl_bands.reset();
                gl->giveUp(device_lost);
            };
            try {
                work(report);
                splat_hits.reset();
                rasterizer.reset();
                gl->giveBack();
            } catch (const Error& error) {
                discard(error.kind() == ErrorKind::kDevice);
                throw;
            } catch (...) {
                discard(false);
                throw;
            }
        },
        progress);
}

CapturePlan Renderer::State::plan(HitSource& source, const View& view, CaptureSettings settings,
                                  const Progress& progress) const {
    if (options.memory != 0) {
        settings.memory = options.memory;
        settings.memory.base = residentBytes();
    }
    return source.plan(view, settings, progress);
}

void Renderer::State::capture(HitSource& source, const View& view, const CaptureSettings& settings,
                              Sink& sink, Plan& plan, const Progress& progress) const {
    const CapturePlan planned = this->plan(source, view, settings, progress);
    plan = planned;
    sink.begin(plan);
    source.capture(planned, sink, progress);
    sink.finish();
}

GlLayers Renderer::State::nextGlLayers(const Progress& progress) {
    if (!gl_bands)
        throw Error(ErrorKind::kUsage, "there is no capture to continue", "nextGlLayers()",
                    "call glLayers() first; every other call that renders ends its bands");
    GlBands& bands = *gl_bands;
    if (bands.next == bands.windows.size()) return {};
    return bands.renderer->captureOnGpu(bands.plan, bands.windows[bands.next++], progress);
}

Renderer::Renderer(const RendererOptions& options) : state_(std::make_unique<State>(options)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

std::string Renderer::device() {
    std::string name;
    state_->run(
        [&](const Progress&) { name = state_->gl->context(state_->request()).device().renderer; },
        {});
    return name;
}

std::vector<unsigned> Renderer::takePendingErrors() {
    std::vector<unsigned> errors;
    state_->worker.run([&](const Progress&) { errors = state_->gl->takePendingErrors(); }, {});
    return errors;
}

Plan Renderer::capture(const Shown& shown, const View& view, const CaptureSettings& settings,
                       Sink& sink, const Progress& progress) {
    Plan plan;
    state_->run(
        [&](const Progress& report) {
            const PosedScene scene = posed(shown);
            state_->capture(state_->openRenderer(shown, scene), view,
                            withTint(shown, scene, settings), sink, plan, report);
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

GlLayers Renderer::glLayers(const Shown& shown, const View& view, const CaptureSettings& settings,
                            const Progress& progress) {
    checkOnGpu(state_->options, settings);
    GlLayers layers;
    state_->run(
        [&](const Progress& report) {
            const PosedScene scene = posed(shown);
            GlRenderer& renderer = state_->openRenderer(shown, scene);
            const CapturePlan plan =
                state_->plan(renderer, view, withTint(shown, scene, settings), report);
            state_->gl_bands = {&renderer, plan, renderer.bandsOnGpu(plan)};
            layers = state_->nextGlLayers(report);
        },
        progress);
    return layers;
}

GlLayers Renderer::nextGlLayers(const Progress& progress) {
    GlLayers layers;
    state_->run(
        [&](const Progress& report) {
            if (state_->gl_bands) state_->gl->context(state_->request());
            layers = state_->nextGlLayers(report);
        },
        progress);
    return layers;
}

LayeredImage Renderer::rays(const Shown& shown, const Bundle& bundle,
                            const CaptureSettings& settings, RayEngine engine,
                            const Progress& progress) {
    ImageSink sink;
    Plan plan;
    state_->run(
        [&](const Progress& report) {
            const PosedScene scene = posed(shown);
            const bool splats = !bundle.view.rays && settings.hit_mode != HitMode::kSloped;
            state_->capture(state_->openHits(shown, scene, engine, splats), bundle.view, settings,
                            sink, plan, report);
        },
        progress);
    return std::move(sink.image);
}

}  // namespace peeler::inline v0
