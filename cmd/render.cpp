// SPDX-License-Identifier: Apache-2.0
// peeler render: from a scene to the layers of one picture, or of each frame of a sequence.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "cmd/animation_options.h"
#include "cmd/camera_options.h"
#include "cmd/capture_options.h"
#include "cmd/channel_options.h"
#include "cmd/clip_options.h"
#include "cmd/frames.h"
#include "cmd/look_options.h"
#include "cmd/opened_scene.h"
#include "cmd/options.h"
#include "cmd/output_options.h"
#include "cmd/progress.h"
#include "cmd/report.h"
#include "cmd/resources.h"
#include "cmd/scene_options.h"
#include "cmd/settings.h"
#include "cmd/verbs.h"
#include "core/error.h"
#include "core/fxaa_filter.h"
#include "core/gl/context.h"
#include "core/peel/method.h"
#include "core/renderer.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct RenderOptions {
    SceneOptions scene;
    AnimationOptions animation;
    CameraOptions camera;
    CaptureSettings capture;
    ChannelOptions channels;
    ClipOptions clip;
    LookOptions look;
    std::optional<int> shadow_size;
    gl::ContextRequest device;
    int threads = 0;
    bool strict = false;
    bool fxaa = false;
    OutputFlags output;
    ReportFlags report;
};

/// One render of one picture or a sequence. run() lists its stages; each leaves in the members what
/// the next ones need. Scene, shaders and context are there once for all pictures.
class Render {
  public:
    Render(const RenderOptions& options, Console& console) : options_(options), console_(console) {}

    void run() {
        start_ = Clock::now();
        checkOptions();
        openScene();
        try {
            for (const Moment& moment : moments_)
                renderPicture(moment);
            if (options_.channels.manifest)
                writeIdManifest(*options_.channels.manifest, provenance_.ids);
        } catch (...) {
            // The frames that are there should be known.
            if (!finished_.empty()) tellSequence();
            throw;
        }
        tellSequence();
    }

  private:
    void checkOptions();
    void checkFiles();
    void chooseChannels();
    void openScene();
    std::vector<fs::path> outputs() const;
    void renderPicture(const Moment& moment);
    void pose(const Moment& moment);
    void prepareRenderer();
    void openRenderer();
    void plan();
    void capture(const Moment& moment);
    void tell(const Moment& moment);
    void tellSequence();

    OutputFlags outputOf(const Moment& moment) const;
    Provenance provenance(const Moment& moment) const;

    using Clock = std::chrono::steady_clock;

    const RenderOptions& options_;
    Console& console_;
    std::vector<Moment> moments_;
    CaptureSettings capture_;
    std::optional<OpenedScene> scene_;
    SceneContents contents_;
    NextFrame next_frame_;
    View view_;
    std::unique_ptr<gl::Context> context_;  // before what lives in it
    std::optional<Renderer> renderer_;
    Clock::time_point start_;  // of what belongs to the picture in the making
    OutputFlags output_;
    Plan plan_;
    Provenance provenance_;
    PictureResult result_;
    std::vector<PictureResult> finished_;
    std::optional<ProgressReport> progress_;
};

/// What shadows are made of, for an output that shows nothing else.
void chooseCasters(CaptureSettings& capture) {
    const CaptureSettings usual;
    if (capture.max_layers != usual.max_layers || capture.surfaces != usual.surfaces ||
        capture.faces != usual.faces || capture.shadows || capture.samples != usual.samples ||
        capture.occlusion_ratio != usual.occlusion_ratio) {
        throw Error(
            ErrorKind::kUsage, "a shadow map shows both faces of all opaque surfaces",
            "--as midpoint-depth",
            "leave --layers, --occlusion-ratio, --samples, --surfaces, --faces and --shadows out");
    }
    capture.opaque_only = true;
    capture.faces = Faces::kBoth;
    capture.shading = Shading::kUnlit;
}

void Render::checkOptions() {
    console_.setQuiet(options_.report.quiet);
    checkCameraOptions(options_.camera);
    checkAnimationOptions(options_.animation);
    moments_ = momentsOf(options_.animation);
    const std::string path = options_.output.path.string();
    if (moments_.size() > 1 && !hasFrameToken(path)) {
        throw Error(ErrorKind::kUsage,
                    "all " + std::to_string(moments_.size()) + " frames would have the same name",
                    "--output " + path,
                    "put #### or %04d into the file's name, where the frame's number goes");
    }
    checkFiles();
    setThreads(options_.threads);
    capture_ = options_.capture;
    const OutputFormat& format = findOutputFormat(path, options_.output.as);
    capture_.composite = format.kind == "composite";
    chooseChannels();
    if (format.casters) chooseCasters(capture_);
    checkSettings(capture_);
    if (options_.fxaa && !capture_.composite && capture_.channels.empty()) {
        throw Error(ErrorKind::kUsage, "a filter of finished pictures cannot smooth layers",
                    "--fxaa", "add --as composite, or use --samples instead");
    }
    checkClipOptions(options_.clip);
    checkLookOptions(options_.look);
    setShadowSize(capture_, options_.shadow_size);
}

/// A composite with channels is made of layers, by its writer.
void Render::chooseChannels() {
    checkChannelOptions(options_.channels, options_.output);
    capture_.channels = capturedChannels(options_.channels);
    if (capture_.channels.empty()) return;
    const MethodInfo* method = findPeelMethod(capture_.method);
    if (method && !method->exact()) {
        throw Error(ErrorKind::kUsage,
                    capture_.method + " finds no fragments that could have channels",
                    "--method " + capture_.method,
                    "choose another method, or leave --channels and --cryptomatte out");
    }
    if (capture_.tail == Tail::kBlend) {
        throw Error(ErrorKind::kUsage, "what is blended has no channels", "--tail blend",
                    "leave it out, or --channels and --cryptomatte");
    }
    if (options_.fxaa) {
        throw Error(ErrorKind::kUsage, "a filter of colours cannot smooth channels", "--fxaa",
                    "use --samples, or leave --channels and --cryptomatte out");
    }
    capture_.composite = false;
}

/// Nothing that is written may replace anything that is read, or what must stay.
void Render::checkFiles() {
    std::vector<fs::path> inputs{options_.scene.file};
    if (options_.look.environment) inputs.push_back(*options_.look.environment);
    checkOutput(outputOf(moments_.front()), inputs);
    std::vector<fs::path> others = inputs;
    for (const Moment& moment : moments_) {
        const OutputFlags output = outputOf(moment);
        checkTarget(output, inputs);
        others.push_back(output.path);
    }
    if (options_.channels.manifest) {
        const std::string manifest = options_.channels.manifest->string();
        if (options_.animation.frames && hasFrameToken(manifest)) {
            throw Error(ErrorKind::kUsage, "one manifest serves all frames",
                        "--manifest " + manifest, "give it a name without a frame number");
        }
        checkExtraFile(manifest, others, "the manifest", "--manifest");
        if (options_.output.no_clobber && fs::exists(manifest)) {
            throw Error(ErrorKind::kOutput, "the file is there already", manifest,
                        "remove it, choose another name, or leave --no-clobber out");
        }
        others.push_back(*options_.channels.manifest);
    }
    checkReport(options_.report, others);
}

void Render::openScene() {
    const StageTimer timer(result_.milliseconds, "load");
    SceneOptions scene = options_.scene;
    scene.gltf.strict = options_.strict;
    scene_.emplace(scene, options_.look, options_.animation, capture_.shadows, console_);
    checkSceneFiles(scene_->scene(), outputs());
}

/// Everything that is written.
std::vector<fs::path> Render::outputs() const {
    std::vector<fs::path> files;
    for (const Moment& moment : moments_)
        files.push_back(outputOf(moment).path);
    for (const auto& file : {options_.channels.manifest, options_.report.file})
        if (file) files.push_back(*file);
    return files;
}

void Render::renderPicture(const Moment& moment) {
    output_ = outputOf(moment);
    pose(moment);
    prepareRenderer();
    plan();
    capture(moment);
    const std::chrono::duration<double, std::milli> passed = Clock::now() - start_;
    result_.milliseconds["total"] = passed.count();
    tell(moment);
    result_ = {};
    start_ = Clock::now();
}

/// A lone picture keeps the name it is given, whatever is in it.
OutputFlags Render::outputOf(const Moment& moment) const {
    OutputFlags output = options_.output;
    if (options_.animation.frames) output.path = framePath(output.path.string(), moment.frame);
    return output;
}

void Render::pose(const Moment& moment) {
    const StageTimer timer(result_.milliseconds, "load");
    contents_ = scene_->at(moment.time);
    view_ = scene_->view(contents_, options_.camera);
    capture_.clip = clipVolume(options_.clip, scene_->scene(), contents_);
    if (!options_.channels.wants(Channel::kMotion)) return;
    next_frame_.contents = scene_->at(moment.next_time);
    next_frame_.view = scene_->view(next_frame_.contents, options_.camera);
}

void Render::prepareRenderer() {
    if (renderer_)
        renderer_->setContents(std::move(contents_));
    else
        openRenderer();
    if (options_.channels.wants(Channel::kMotion)) renderer_->setNextFrame(std::move(next_frame_));
}

void Render::openRenderer() {
    {
        const StageTimer timer(result_.milliseconds, "context");
        context_ = openContext(options_.device, console_);
    }
    renderer_.emplace(*context_, scene_->scene(), std::move(contents_));
}

void Render::plan() {
    plan_ = renderer_->plan(view_, capture_);
    if (options_.strict && !plan_.complete()) {
        const bool blended = plan_.fragments_blended != 0;
        throw Error(ErrorKind::kIncomplete,
                    std::string("the layer limit ") +
                        (blended ? "leaves to an approximation " : "leaves out ") +
                        countText(plan_.fragments_counted - plan_.fragments_stored, "fragment") +
                        " of " + groupedText(plan_.fragments_counted),
                    output_.path.string(),
                    "use --layers all and no --occlusion-ratio, or leave --strict out");
    }
}

void Render::capture(const Moment& moment) {
    provenance_ = provenance(moment);
    OutputOptions output = outputOptions(output_, provenance_);
    output.cryptomatte = options_.channels.cryptomatte;
    auto writer = makeSink(output_.path.string(), output);
    if (options_.fxaa) writer = std::make_unique<FxaaFilter>(std::move(writer), output.background);
    writer->begin(plan_);
    if (!progress_) progress_.emplace(console_, options_.report.shownProgress(), "render");
    const auto done = static_cast<double>(finished_.size());
    Sink* const sinks[] = {writer.get()};
    result_.passes =
        renderer_
            ->capture(sinks,
                      [&](double share) {
                          progress_->update((done + share) / static_cast<double>(moments_.size()));
                      })
            .passes;
    if (finished_.size() + 1 == moments_.size()) progress_.reset();
    writer->finish();
    add(result_.milliseconds, renderer_->takeTimes());
    add(result_.milliseconds, writer->times());
}

Provenance Render::provenance(const Moment& moment) const {
    Provenance provenance;
    provenance.version = PEELER_VERSION;
    provenance.method = capture_.method;
    provenance.surfaces =
        capture_.opaque_only ? "opaque" : nameOf<Surfaces>(kSurfaces, capture_.surfaces);
    provenance.scene = options_.scene.file.filename().string();
    provenance.scene_hash = hexText(scene_->scene().content_hash);
    provenance.settings_hash = settingsHash(
        {scene_->index(), scene_->animations(), options_.scene.include, options_.scene.exclude},
        capture_, options_.fxaa, lookSettings(options_.look, scene_->scene()));
    provenance.renderer = context_->device().renderer;
    provenance.frame = moment.frame;
    provenance.time = moment.time;
    provenance.frames_per_second = moment.frames_per_second;
    if (std::find(capture_.channels.begin(), capture_.channels.end(), Channel::kId) !=
        capture_.channels.end())
        provenance.ids = idNames(scene_->scene());
    return provenance;
}

void Render::tell(const Moment& moment) {
    result_.output = output_.path;
    if (options_.animation.frames) result_.frame = moment.frame;
    result_.time = moment.time;
    describePicture(plan_, provenance_, result_);
    result_.fragments_blended = plan_.fragments_blended;
    result_.samples = plan_.samples;
    result_.backend = context_->device().backend;
    describeFiles(output_.layers, output_.path, result_, console_);
    if (options_.animation.frames)
        console_.note(summary(result_));
    else
        tellResult(options_.report, result_, console_);
    finished_.push_back(result_);
}

void Render::tellSequence() {
    if (options_.animation.frames) tellFrames(options_.report, finished_, console_);
}

}  // namespace

VerbAction declareRender(CLI::App& app) {
    const auto options = std::make_shared<RenderOptions>();
    addValue(
        app, "SCENE", "", options->scene.file,
        [](const std::string& text) { return fs::path(text); }, "a glTF scene (.gltf or .glb)")
        ->required();
    addOutputOptions(app, options->output);
    addLayerOutputOptions(app, options->output);
    addFxaaOption(app, options->fxaa, "quick, but --samples sees more");
    addSceneOptions(app, options->scene);
    addTimeOptions(app, options->animation);
    addFrameOptions(app, options->animation);
    addCameraOptions(app, options->camera);
    addLayerOptions(app, options->capture);
    addChannelOptions(app, options->channels);
    addClipOptions(app, options->clip);
    addLightOptions(app, options->capture, options->shadow_size);
    addLookOptions(app, options->look);
    addMachineOptions(app, options->device, options->threads, options->capture);
    addReportOptions(app, options->report);
    app.add_flag("--strict", options->strict,
                 wrapped("a missing texture and damaged compressed data are errors (exit code 3), "
                         "whatever the fallback, and so is a layer limit that leaves fragments out "
                         "(6); no file is written then"))
        ->group("Output");
    return [options](Console& console) {
        Render(*options, console).run();
        return 0;
    };
}

}  // namespace peeler::cmd
