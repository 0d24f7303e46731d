// SPDX-License-Identifier: Apache-2.0
// peeler render: from a scene to the layers of one picture.
#include <filesystem>
#include <memory>
#include <optional>

#include "cmd/camera_options.h"
#include "cmd/capture_options.h"
#include "cmd/clip_options.h"
#include "cmd/look_options.h"
#include "cmd/options.h"
#include "cmd/output_options.h"
#include "cmd/progress.h"
#include "cmd/report.h"
#include "cmd/resources.h"
#include "cmd/settings.h"
#include "cmd/verbs.h"
#include "core/error.h"
#include "core/fxaa_filter.h"
#include "core/gl/context.h"
#include "core/renderer.h"
#include "formats/gltf_reader.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct RenderOptions {
    fs::path scene;
    CameraOptions camera;
    CaptureSettings capture;
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

/// One render. run() lists its stages; each leaves in the members what the next ones need.
class Render {
  public:
    Render(const RenderOptions& options, Console& console) : options_(options), console_(console) {}

    void run() {
        {
            const StageTimer timer(result_.milliseconds, "total");
            checkOptions();
            readScene();
            chooseView();
            makeContext();
            upload();
            plan();
            capture();
        }
        tell();
    }

  private:
    void checkOptions();
    void readScene();
    void chooseView();
    void makeContext();
    void upload();
    void plan();
    void capture();
    void tell();

    Provenance provenance() const;

    const RenderOptions& options_;
    Console& console_;
    CaptureSettings capture_;
    Scene scene_;
    int scene_index_ = 0;
    SceneContents contents_;
    View view_;
    std::unique_ptr<gl::Context> context_;  // before what lives in it
    std::optional<Renderer> renderer_;
    Plan plan_;
    PictureResult result_;
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
    checkOutput(options_.output, options_.scene);
    checkReport(options_.report, options_.scene, options_.output.path);
    setThreads(options_.threads);
    capture_ = options_.capture;
    const OutputFormat& format =
        findOutputFormat(options_.output.path.string(), options_.output.as);
    capture_.composite = format.kind == "composite";
    if (format.casters) chooseCasters(capture_);
    checkSettings(capture_);
    if (options_.fxaa && !capture_.composite) {
        throw Error(ErrorKind::kUsage, "a filter of finished pictures cannot smooth layers",
                    "--fxaa", "add --as composite, or use --samples instead");
    }
    checkClipOptions(options_.clip);
    checkLookOptions(options_.look);
    setShadowSize(capture_, options_.shadow_size);
}

void Render::readScene() {
    const StageTimer timer(result_.milliseconds, "load");
    GltfOptions gltf;
    gltf.strict = options_.strict;
    scene_ = loadScene(options_.scene, gltf, options_.look, capture_.shadows);
    for (const std::string& warning : scene_.warnings)
        console_.warning(warning);
}

void Render::chooseView() {
    const StageTimer timer(result_.milliseconds, "load");
    scene_index_ = chooseScene(scene_, options_.camera);
    contents_ = contents(scene_, scene_index_);
    view_ = makeView(scene_, contents_, options_.camera);
    capture_.clip = clipVolume(options_.clip, scene_, contents_);
}

void Render::makeContext() {
    const StageTimer timer(result_.milliseconds, "context");
    context_ = openContext(options_.device, console_);
}

void Render::upload() {
    renderer_.emplace(*context_, scene_, contents_);
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
                    options_.output.path.string(),
                    "use --layers all and no --occlusion-ratio, or leave --strict out");
    }
}

void Render::capture() {
    const std::string path = options_.output.path.string();
    const OutputOptions output = outputOptions(options_.output, provenance());
    auto writer = makeSink(path, output);
    if (options_.fxaa) writer = std::make_unique<FxaaFilter>(std::move(writer), output.background);
    writer->begin(plan_);
    {
        ProgressReport progress(console_, options_.report.shownProgress(), "render");
        Sink* const sinks[] = {writer.get()};
        result_.passes =
            renderer_->capture(sinks, [&](double share) { progress.update(share); }).passes;
    }
    writer->finish();
    add(result_.milliseconds, renderer_->times());
    add(result_.milliseconds, writer->times());
}

Provenance Render::provenance() const {
    Provenance provenance;
    provenance.version = PEELER_VERSION;
    provenance.method = capture_.method;
    provenance.surfaces =
        capture_.opaque_only ? "opaque" : nameOf<Surfaces>(kSurfaces, capture_.surfaces);
    provenance.scene = options_.scene.filename().string();
    provenance.scene_hash = hexText(scene_.content_hash);
    provenance.settings_hash = settingsHash(scene_index_, view_, capture_, options_.fxaa,
                                            lookSettings(options_.look, scene_));
    provenance.renderer = context_->device().renderer;
    return provenance;
}

void Render::tell() {
    result_.output = options_.output.path;
    result_.bytes = fs::file_size(options_.output.path);
    result_.width = view_.width;
    result_.height = view_.height;
    result_.layers = plan_.layers.size();
    result_.fragments_counted = plan_.fragments_counted;
    result_.fragments_stored = plan_.fragments_stored;
    result_.fragments_blended = plan_.fragments_blended;
    result_.samples = plan_.samples;
    result_.method = capture_.method;
    result_.renderer = context_->device().renderer;
    result_.backend = context_->device().backend;
    result_.peak_memory = peakMemory();
    tellResult(options_.report, result_, console_);
}

}  // namespace

VerbAction declareRender(CLI::App& app) {
    const auto options = std::make_shared<RenderOptions>();
    addValue(
        app, "SCENE", "", options->scene, [](const std::string& text) { return fs::path(text); },
        "a glTF scene (.gltf or .glb)")
        ->required();
    addOutputOptions(app, options->output);
    addLayerOutputOptions(app, options->output);
    addFxaaOption(app, options->fxaa, "quick, but --samples sees more");
    addCameraOptions(app, options->camera);
    addLayerOptions(app, options->capture);
    addClipOptions(app, options->clip);
    addLightOptions(app, options->capture, options->shadow_size);
    addLookOptions(app, options->look);
    addMachineOptions(app, options->device, options->threads, options->capture);
    addReportOptions(app, options->report);
    app.add_flag(
           "--strict", options->strict,
           wrapped(
               "a missing texture is an error (exit code 3), and so is a layer limit that leaves "
               "fragments out (6); no file is written then"))
        ->group("Output");
    return [options](Console& console) {
        Render(*options, console).run();
        return 0;
    };
}

}  // namespace peeler::cmd
