// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/capture_job.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>
#include <utility>

#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/machine/resources.h"
#include "cmd/options/output_checks.h"
#include "cmd/options/output_options.h"
#include "core/base/printable.h"
#include "core/base/stage_times.h"
#include "core/capture/method.h"
#include "core/lens/picture_rays.h"
#include "core/raster/hit_rasterizer.h"
#include "core/scene/camera_choice.h"
#include "core/splats/projected_splats.h"
#include "core/splats/splat_hits.h"
#include "core/trace/traced_hits.h"
#include "formats/file/content_hash.h"
#include "formats/file/json_text.h"
#include "formats/image/display.h"

namespace peeler::cmd {

namespace {

/// A sink that meters the exposure of a picture.
struct MeterSink : Sink {
    ExposureMeter meter;

    void begin(const Plan& /*plan*/) override {}
    void write(LayeredImage&& band) override {
        compositeOver(band, {}, composite_);
        meter.add(composite_);
    }
    void finish() override {}

  private:
    CompositeImage composite_;
};

bool hasPrimitive(const Scene& scene, bool (*is)(const Primitive&)) {
    return std::ranges::any_of(
        scene.meshes, [&](const Mesh& mesh) { return std::ranges::any_of(mesh.primitives, is); });
}
bool isPoints(const Primitive& primitive) {
    return primitive.topology == Topology::kPoints && !primitive.splats;
}
bool isSplats(const Primitive& primitive) {
    return primitive.splats != nullptr;
}

/// Returns the view without its crop, scaled down to at most 256 pixels per side.
View small(View view) {
    constexpr int kSide = 256;
    const double scale =
        std::min(1.0, static_cast<double>(kSide) / std::max(view.width, view.height));
    const auto scaled = [&](int side) {
        return std::max(1, static_cast<int>(std::lround(side * scale)));
    };
    const glm::dvec2 before(view.width, view.height);
    view.width = scaled(view.width);
    view.height = scaled(view.height);
    if (view.rays)
        view.rays =
            mappedPicture(view.rays, glm::dvec2(0), before / glm::dvec2(view.width, view.height));
    view.crop = {0, 0, view.width, view.height};
    return view;
}

/// Whether the user chose the device, by options or by Mesa's environment variables.
bool isChosen(const gl::ContextRequest& request) {
    if (request.backend != "auto" || request.device.given()) return true;
    constexpr const char* kMesas[] = {"LIBGL_ALWAYS_SOFTWARE", "GALLIUM_DRIVER"};
    return std::ranges::any_of(kMesas, [](const char* name) { return std::getenv(name); });
}

}  // namespace

void chooseStudio(const CameraOptions& camera, CaptureJobOptions& options) {
    options.appearance.studio = !options.capture.shadows &&
                                options.capture.shading == Shading::kPbr &&
                                !(camera.camera && namesLight(*camera.camera));
}

void chooseForEyes(const VerbOptions& verb, const CameraOptions& camera,
                   CaptureJobOptions& options) {
    if (!verb.given("--point-size")) options.capture.point_size = kDisplayPointSize;
    chooseStudio(camera, options);
}

void addSceneArgument(VerbOptions& verb, CaptureJobOptions& options) {
    addFile(verb, "SCENE", "", options.scene.file,
            "a scene: glTF (.gltf, .glb), PLY, STL, OBJ, 3MF, SPZ or .splat")
        .files(sceneExtensions())
        .required();
}

void addShownOptions(VerbOptions& verb, CaptureJobOptions& options) {
    addSceneOptions(verb, options.scene);
    addTimeOptions(verb, options.animation);
}

void addRunOptions(VerbOptions& verb, CaptureJobOptions& options, const std::string& memory) {
    addMachineOptions(verb, options.device, options.threads, options.capture, memory);
    addReportOptions(verb, options.report);
}

CaptureJob::CaptureJob(const CaptureJobOptions& options, Session& session)
    : options_(options), session_(session), reporter_(session.reporter()) {
    options.report.applyTo(reporter_);
}

CaptureJob::~CaptureJob() {
    releaseHits();
}

void CaptureJob::checkOptions() const {
    checkAnimationOptions(options_.animation);
    checkAppearanceOptions(options_.appearance);
    checkEngine(options_.engine, options_.device);
    setThreads(options_.threads);
    takeVisibleGpus();
}

const OpenedScene& CaptureJob::openScene() {
    reporter_.detail("reading " + options_.scene.file.string());
    const AnimationOptions& animation = options_.animation;
    {
        const StageTimer timer(times_, "load");
        scene_ = session_.open({options_.scene, options_.appearance, animation,
                                options_.capture.shadows, options_.capture.memory});
        if (animation.moves() && scene_->animations().empty()) {
            if (options_.scene.reading.strict)
                refuse("the scene has no animation: it is the same at all times",
                       animation.frames ? "--frames" : "--time",
                       "leave it out, or leave --strict out");
            reporter_.warning("The scene has no animation; it is the same at all times.");
        }
    }
    const Scene& scene = scene_->scene();
    reporter_.detail("read " + countText(scene.files.size(), "file") + ": " +
                     countText(scene.nodes.size(), "node") + ", " +
                     countText(scene.meshes.size(), "mesh") + ", " +
                     countText(scene.materials.size() - 1, "material") + ", " +
                     countText(scene.images.size(), "image"));
    return *scene_;
}

void CaptureJob::noteUnit() const {
    if (!scene_->assumed()) return;
    reporter_.note(printable(options_.scene.file.string()) + " has no unit, so 1 counts as 1 m; " +
                   "for millimetres, add " + Parameter::kMetresPerUnit + " mm");
}

void CaptureJob::checkOutputs(std::vector<std::filesystem::path> outputs) const {
    if (options_.report.file) outputs.push_back(*options_.report.file);
    checkSceneFiles(scene_->scene(), outputs);
}

PosedScene CaptureJob::pose() {
    const StageTimer timer(times_, "load");
    return scene_->at(options_.animation.time.value_or(0));
}

GlRenderer& CaptureJob::openRenderer(const PosedScene& posed) {
    if (renderer_ && &renderer_->posed().scene() == &posed.scene() && renderer_->canShow(posed)) {
        renderer_->setPose(posed);
        return *renderer_;
    }
    const bool needs_gl = needsContext(options_.device, posed);
    if (needs_gl && !session_.hasContext()) {
        const StageTimer timer(times_, "context");
        session_.context(options_.device);
    }
    // The session must not keep a scene that belongs only to this run, such as the scene that
    // peeler check makes of faulty places.
    const bool is_opened = scene_ && &posed.scene() == &scene_->scene();
    renderer_ = &session_.renderer(options_.device, is_opened ? scene_ : nullptr, posed);
    device_.reset();
    if (!needs_gl) return *renderer_;
    device_ = session_.context(options_.device).device();
    if (device_->software && !isChosen(options_.device)) {
        reporter_.noteOnce("no GPU can be used, so " + device_->renderer +
                           " renders in software (" + device_->backend +
                           "); run peeler devices to see why");
    }
    reporter_.detail("GL: " + device_->renderer + " (" + device_->backend + "), OpenGL " +
                     device_->version);
    return *renderer_;
}

void CaptureJob::releaseRenderer() {
    renderer_ = nullptr;
    session_.release();
}

void CaptureJob::closeContext() {
    renderer_ = nullptr;
    session_.close();
}

RayEngine CaptureJob::chooseEngine() {
    if (engine_) return *engine_;
    if (options_.engine != RayEngine::kAuto) return engine_.emplace(options_.engine);
    if (options_.device.choosesDevice()) return engine_.emplace(RayEngine::kGl);
    const StageTimer timer(times_, "context");
    std::string reasons;
    if (session_.findGpu(reasons)) return engine_.emplace(RayEngine::kGl);
    reporter_.detail("no GPU can be used, so the CPU finds the hits: " + reasons);
    return engine_.emplace(RayEngine::kCpu);
}

void CaptureJob::warnOfSplats(const PosedScene& posed, const std::string& what) {
    if (!hasSplats(posed)) return;
    const std::string statement = what + " do not hit Gaussian splats";
    if (options_.scene.reading.strict)
        throw Error(ErrorKind::kInput, statement, options_.scene.file.string(),
                    "leave --strict out, or the splats (--exclude)");
    if (!std::exchange(told_of_splats_, true)) reporter_.warning(statement + "; results lack them");
}

HitSource& CaptureJob::openHits(const PosedScene& posed, bool splats) {
    if (!splats) warnOfSplats(posed);
    HitSource* pinholes = nullptr;
    if (chooseEngine() == RayEngine::kGl) {
        pinholes = &openRenderer(posed);
    } else {
        rasterizer_ = std::make_unique<HitRasterizer>(posed);
        pinholes = rasterizer_.get();
    }
    splat_hits_.reset();
    if (splats && hasSplats(posed)) {
        splat_hits_ = std::make_unique<SplatHits>(*pinholes);
        pinholes = splat_hits_.get();
    }
    traced_ = std::make_unique<TracedHits>(posed, pinholes);
    return *traced_;
}

HitSource& CaptureJob::openTracer(const PosedScene& posed) {
    warnOfSplats(posed);
    traced_ = std::make_unique<TracedHits>(posed);
    return *traced_;
}

void CaptureJob::traceOnCpu() {
    if (options_.engine == RayEngine::kGl)
        refuse("the rays of lenses and lists are traced on the CPU", "--engine gl", "leave it out");
    engine_ = RayEngine::kCpu;
}

void CaptureJob::releaseHits() {
    traced_.reset();
    splat_hits_.reset();
    rasterizer_.reset();
    releaseRenderer();
}

void CaptureJob::discard() {
    traced_.reset();
    splat_hits_.reset();
    rasterizer_.reset();
    closeContext();
    takeTimes();
}

float CaptureJob::meterExposure(const CaptureSettings& capture,
                                std::span<const CameraOptions> cameras) {
    CaptureSettings settings = capture;
    settings.method = peelMethods().front().name;
    settings.channels.clear();
    settings.samples = 1;
    settings.composite = true;
    settings.color_type = PixelType::kFloat;
    std::vector<double> times{options_.animation.time.value_or(0)};
    if (options_.animation.frames) {
        double end = 0;
        for (const int animation : scene_->animations())
            end = std::max(
                end, durationOf(scene_->scene().animations[static_cast<std::size_t>(animation)]));
        times = end > 0 ? std::vector<double>{0, end / 2, end} : std::vector<double>{0};
    }
    const std::set<std::size_t> some{0, cameras.size() / 2, cameras.size() - 1};
    MeterSink sink;
    for (const double time : times) {
        const PosedScene posed = scene_->at(time);
        renderer_->setPose(posed);
        for (const std::size_t camera : some) {
            const View view = small(makeView(posed, scene_->extent(), cameras[camera]));
            renderer_->capture(renderer_->plan(view, settings), sink);
        }
    }
    return sink.meter.stops();
}

StageTimes CaptureJob::takeTimes() {
    if (renderer_) add(times_, renderer_->takeTimes());
    if (traced_) add(times_, traced_->takeTimes());
    return std::exchange(times_, {});
}

bool CaptureJob::wantsTint(const PosedScene& posed) const {
    return cmd::wantsTint(options_.appearance, posed);
}

std::string CaptureJob::settingsText(const CaptureSettings& capture, nlohmann::json more,
                                     const Window& crop, double frames_per_second) const {
    more.update(appearanceSettings(options_.appearance, scene_->scene()));
    more.update(readingSettings(options_.scene.reading, scene_->assumed()));
    if (const auto& ignored = options_.scene.reading.ignored_extensions; !ignored.empty())
        more["ignoredExtensions"] = ignored;
    if (capture.point_size != 1 && hasPrimitive(scene_->scene(), isPoints))
        more["pointSize"] = capture.point_size;
    if (capture.hit_mode == HitMode::kNone && hasPrimitive(scene_->scene(), isSplats)) {
        more["splatOrder"] = nameOf<SplatOrder>(kSplatOrders, capture.splat_order);
        more["splatBlending"] = nameOf<SplatBlending>(kSplatBlendings, capture.splat_blending);
    }
    if (const auto& normalize = options_.scene.normalize)
        more["normalize"] = nameOf<Normalized>(kNormalized, *normalize);
    if (engine_ == RayEngine::kCpu) more["engine"] = nameOf<RayEngine>(kEngines, RayEngine::kCpu);
    const ShownScene shown{scene_->index(),        scene_->animations(), options_.scene.include,
                           options_.scene.exclude, frames_per_second,    crop};
    return cmd::settingsText(shown, capture, more);
}

std::string CaptureJob::settingsHash(const CaptureSettings& capture, nlohmann::json more,
                                     const Window& crop) const {
    return hashText(settingsText(capture, std::move(more), crop));
}

void CaptureJob::finish(RunResult& result) {
    result.inputs = {options_.scene.file};
    if (scene_ && scene_->assumed()) {
        result.format = scene_->assumed()->format;
        result.up = axisName(scene_->assumed()->up);
        result.metres_per_unit = scene_->assumed()->metres_per_unit;
    }
    if (engine_) result.engine = nameOf<RayEngine>(kEngines, *engine_);
    if (device_) {
        result.renderer = device_->renderer;
        result.backend = device_->backend;
    }
    result.peak_memory = peakMemory();
    add(result.milliseconds, takeTimes());
    const std::chrono::duration<double, std::milli> passed = Clock::now() - start_;
    result.milliseconds["total"] = passed.count();
}

}  // namespace peeler::cmd
