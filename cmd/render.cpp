// SPDX-License-Identifier: Apache-2.0
// peeler render: from a scene to the layers of one picture, or of each frame of a sequence.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "cmd/errors.h"
#include "cmd/frames.h"
#include "cmd/opened_scene.h"
#include "cmd/progress.h"
#include "cmd/render_options.h"
#include "cmd/report.h"
#include "cmd/resources.h"
#include "cmd/sequence_results.h"
#include "cmd/settings.h"
#include "cmd/verbs.h"
#include "core/background_sink.h"
#include "core/bands.h"
#include "core/error.h"
#include "core/fxaa_filter.h"
#include "core/gl/context.h"
#include "core/parallel.h"
#include "formats/hash_text.h"
#include "formats/output_hash.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// A picture in the making.
struct Picture {
    Moment moment;
    std::size_t index = 0;  ///< among the moments
    OutputFlags output{};
    Clock::time_point start{};
    View view{};
    Provenance provenance{};
    Plan plan{};
    PictureResult result{};
    std::string backend{};  ///< that it was captured with
    std::unique_ptr<Sink> writer{};
    BackgroundSink* behind = nullptr;  ///< the writer, if it goes on by itself
};

/// One render of one picture or a sequence. run() lists its stages. Scene, shaders and context are
/// there once for all pictures, and a picture is captured while the one before is being written.
class Render {
  public:
    Render(const RenderOptions& options, Console& console)
        : options_(options), console_(console), results_(options.report, isSequence(), console) {}

    int run() {
        checkOptions();
        openScene();
        if (options_.sequence.dry_run) {
            tellPlan();
            return 0;
        }
        try {
            renderAll();
            if (options_.channels.manifest)
                writeIdManifest(*options_.channels.manifest, idNames(scene_->scene()));
        } catch (...) {
            // The frames that are there should be known.
            if (!results_.empty()) results_.tell();
            throw;
        }
        results_.tell();
        return results_.worst();
    }

  private:
    void checkOptions();
    void checkFiles();
    void openScene();
    std::vector<fs::path> outputs() const;

    void renderAll();
    void render(const Moment& moment);
    void retry(Picture& picture);
    void pose(Picture& picture);
    bool isThere(const Picture& picture) const;
    void capture(Picture& picture);
    void openRenderer(Picture& picture);
    void plan(Picture& picture);
    void makeWriter(Picture& picture);
    void settle();

    void tellPlan();
    void tell(Picture& picture);
    void tellSkipped(Picture& picture);

    bool isSequence() const { return options_.animation.frames.has_value(); }
    std::optional<int> frameOf(const Moment& moment) const {
        return isSequence() ? std::optional(moment.frame) : std::nullopt;
    }
    Progress progressOf(const Picture& picture);
    OutputFlags outputOf(const Moment& moment) const;
    OutputOptions writerOptions(const Picture& picture) const;
    void describeProvenance(Picture& picture) const;

    const RenderOptions& options_;
    Console& console_;
    const Clock::time_point start_ = Clock::now();
    std::vector<Moment> moments_;
    CaptureSettings capture_;
    StageTimes loading_;
    std::optional<OpenedScene> scene_;
    SceneContents contents_;
    NextFrame next_frame_;
    std::unique_ptr<gl::Context> context_;  // before what lives in it
    std::optional<Renderer> renderer_;
    std::optional<Picture> written_;  // captured, and perhaps still being written
    SequenceResults results_;
    std::optional<ProgressReport> progress_;
};

void Render::checkOptions() {
    options_.report.applyTo(console_);
    checkCameraOptions(options_.camera);
    checkAnimationOptions(options_.animation);
    const std::string path = options_.output.path.string();
    const std::size_t frames = isSequence() ? options_.animation.frames->size() : 1;
    if (frames > 1 && !hasFrameToken(path)) {
        throw Error(ErrorKind::kUsage,
                    "all " + std::to_string(frames) + " frames would have the same name",
                    "--output " + path,
                    "put #### or %04d into the file's name, where the frame's number goes");
    }
    moments_ = momentsOf(options_.animation);
    checkFiles();
    setThreads(options_.threads);
    capture_ = captureSettings(options_);
    checkClipOptions(options_.clip);
    checkLookOptions(options_.look);
}

/// Nothing that is written may replace anything that is read, or what must stay.
void Render::checkFiles() {
    std::vector<fs::path> inputs{options_.scene.file};
    if (options_.look.environment) inputs.push_back(*options_.look.environment);
    std::vector<fs::path> others = inputs;
    for (const Moment& moment : moments_) {
        OutputFlags output = outputOf(moment);
        // What must stay may be what is wanted, or no reason to stop.
        if (options_.sequence.skip_existing || options_.sequence.keep_going)
            output.no_clobber = false;
        if (&moment == &moments_.front())
            checkOutput(output, inputs);
        else
            checkTarget(output, inputs);
        others.push_back(output.path);
    }
    if (options_.channels.manifest) {
        const std::string manifest = options_.channels.manifest->string();
        if (isSequence() && hasFrameToken(manifest)) {
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
    const StageTimer timer(loading_, "load");
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

/// A lone picture keeps the name it is given, whatever is in it.
OutputFlags Render::outputOf(const Moment& moment) const {
    OutputFlags output = options_.output;
    if (isSequence()) output.path = framePath(output.path.string(), moment.frame);
    return output;
}

void Render::renderAll() {
    progress_.emplace(console_, options_.report.shownProgress(), "render");
    try {
        for (const Moment& moment : moments_)
            render(moment);
    } catch (...) {
        // The picture before is none the worse for it.
        const std::exception_ptr first = std::current_exception();
        try {
            settle();
        } catch (...) {
            reportError(console_, currentError());
        }
        std::rethrow_exception(first);
    }
    settle();
    progress_->update(1);
    progress_.reset();
}

void Render::render(const Moment& moment) {
    Picture picture{.moment = moment,
                    .index = static_cast<std::size_t>(&moment - moments_.data()),
                    .output = outputOf(moment),
                    .start = Clock::now()};
    if (picture.index == 0) {
        picture.start = start_;
        picture.result.milliseconds = loading_;
    }
    if (isSequence()) {
        progress_->status("frame " + std::to_string(moment.frame) + ", " +
                          std::to_string(picture.index + 1) + " of " +
                          std::to_string(moments_.size()));
    }
    try {
        pose(picture);
        if (options_.sequence.skip_existing && isThere(picture)) {
            settle();
            tellSkipped(picture);
            return;
        }
        try {
            capture(picture);
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::kDevice || !context_) throw;
            console_.warning(std::string(error.what()) + "; trying once more.");
            retry(picture);
        }
    } catch (...) {
        const Error error = currentError();
        const bool for_all =
            error.kind() == ErrorKind::kUsage || (error.kind() == ErrorKind::kDevice && !context_);
        if (!options_.sequence.keep_going || for_all) throw error;
        settle();
        results_.addFailure(picture.output.path, frameOf(picture.moment), error);
        // Whatever state it was left in.
        renderer_.reset();
        context_.reset();
        return;
    }
    settle();
    written_ = std::move(picture);
    if (!written_->behind) settle();
}

/// A context that was lost takes everything that lives in it along.
void Render::retry(Picture& picture) {
    picture.writer.reset();
    renderer_.reset();
    context_.reset();
    pose(picture);
    capture(picture);
}

void Render::pose(Picture& picture) {
    const StageTimer timer(picture.result.milliseconds, "load");
    contents_ = scene_->at(picture.moment.time);
    picture.view = scene_->view(contents_, options_.camera);
    capture_.clip = clipVolume(options_.clip, scene_->scene(), contents_);
    if (options_.channels.wants(Channel::kMotion)) {
        next_frame_.contents = scene_->at(picture.moment.next_time);
        next_frame_.view = scene_->view(next_frame_.contents, options_.camera);
    }
    describeProvenance(picture);
}

void Render::describeProvenance(Picture& picture) const {
    const Moment& moment = picture.moment;
    Provenance& provenance = picture.provenance;
    provenance.version = PEELER_VERSION;
    provenance.method = capture_.method;
    provenance.surfaces =
        capture_.opaque_only ? "opaque" : nameOf<Surfaces>(kSurfaces, capture_.surfaces);
    provenance.scene = options_.scene.file.filename().string();
    provenance.scene_hash = hexText(scene_->scene().content_hash);
    const bool moves = options_.channels.wants(Channel::kMotion);
    provenance.settings_hash =
        settingsHash({scene_->index(), scene_->animations(), options_.scene.include,
                      options_.scene.exclude, moves ? 1 / (moment.next_time - moment.time) : 0},
                     capture_, options_.fxaa, lookSettings(options_.look, scene_->scene()));
    provenance.frame = moment.frame;
    provenance.time = moment.time;
    provenance.frames_per_second = moment.frames_per_second;
    if (std::ranges::find(capture_.channels, Channel::kId) != capture_.channels.end())
        provenance.ids = idNames(scene_->scene());
    provenance.output_hash =
        outputHash(picture.view, picture.output.path.string(), writerOptions(picture));
}

OutputOptions Render::writerOptions(const Picture& picture) const {
    OutputOptions output = outputOptions(picture.output, picture.provenance);
    output.cryptomatte = options_.channels.cryptomatte;
    return output;
}

bool Render::isThere(const Picture& picture) const {
    return outputHashOf(picture.output.path.string()) == picture.provenance.output_hash;
}

void Render::capture(Picture& picture) {
    if (options_.output.no_clobber) checkTarget(picture.output, {});
    if (renderer_)
        renderer_->setContents(std::move(contents_));
    else
        openRenderer(picture);
    if (options_.channels.wants(Channel::kMotion)) renderer_->setNextFrame(std::move(next_frame_));
    picture.provenance.renderer = context_->device().renderer;
    picture.backend = context_->device().backend;
    plan(picture);
    makeWriter(picture);
    Sink* const sinks[] = {picture.writer.get()};
    picture.result.passes = renderer_->capture(sinks, progressOf(picture)).passes;
    add(picture.result.milliseconds, renderer_->takeTimes());
    picture.writer->finish();
}

void Render::openRenderer(Picture& picture) {
    {
        const StageTimer timer(picture.result.milliseconds, "context");
        context_ = openContext(options_.device, console_);
    }
    renderer_.emplace(*context_, scene_->scene(), std::move(contents_));
}

/// The last hundredth is for what follows the capture.
Progress Render::progressOf(const Picture& picture) {
    const auto index = static_cast<double>(picture.index);
    return [this, index](double share) {
        progress_->update((index + 0.99 * share) / static_cast<double>(moments_.size()));
    };
}

void Render::plan(Picture& picture) {
    // Two pictures at once only where there is plenty of room for both.
    if (written_ && capture_.memory != 0 && residentBytes() > capture_.memory / 4) settle();
    picture.plan = renderer_->plan(picture.view, capture_, progressOf(picture));
    const Plan& plan = picture.plan;
    if (!options_.strict || plan.complete()) return;
    const bool blended = plan.fragments_blended != 0;
    throw Error(ErrorKind::kIncomplete,
                std::string("the layer limit ") +
                    (blended ? "leaves to an approximation " : "leaves out ") +
                    countText(plan.fragments_counted - plan.fragments_stored, "fragment") + " of " +
                    groupedText(plan.fragments_counted),
                picture.output.path.string(),
                "use --layers all and no --occlusion-ratio, or leave --strict out");
}

void Render::makeWriter(Picture& picture) {
    const OutputOptions output = writerOptions(picture);
    picture.writer = makeSink(picture.output.path.string(), output);
    if (options_.fxaa)
        picture.writer = std::make_unique<FxaaFilter>(std::move(picture.writer), output.background);
    if (moments_.size() > 1 && threadCount() > 1) {
        auto behind = std::make_unique<BackgroundSink>(std::move(picture.writer));
        picture.behind = behind.get();
        picture.writer = std::move(behind);
    }
    picture.writer->begin(picture.plan);
}

/// Ends the picture that was captured last, if it has not been ended.
void Render::settle() {
    if (!written_) return;
    Picture picture = std::move(*written_);
    written_.reset();
    try {
        if (picture.behind) picture.behind->wait();
        tell(picture);
    } catch (...) {
        if (!options_.sequence.keep_going) throw;
        results_.addFailure(picture.output.path, frameOf(picture.moment), currentError());
    }
}

void Render::tell(Picture& picture) {
    PictureResult& result = picture.result;
    const auto end = picture.behind ? picture.behind->finishedAt() : Clock::now();
    add(result.milliseconds, picture.writer->times());
    result.milliseconds["total"] =
        std::chrono::duration<double, std::milli>(end - picture.start).count();
    result.output = picture.output.path;
    result.frame = frameOf(picture.moment);
    result.time = picture.moment.time;
    describePicture(picture.plan, picture.provenance, result);
    result.fragments_blended = picture.plan.fragments_blended;
    result.samples = picture.plan.samples;
    result.backend = picture.backend;
    describeFiles(picture.output.layers, picture.output.path, result, console_);
    results_.add(result);
}

void Render::tellSkipped(Picture& picture) {
    PictureResult& result = picture.result;
    result.output = picture.output.path;
    result.frame = frameOf(picture.moment);
    result.time = picture.moment.time;
    result.bytes = fs::file_size(picture.output.path);
    result.skipped = true;
    results_.add(result);
}

void Render::tellPlan() {
    nlohmann::ordered_json json;
    json["scene"] = options_.scene.file.string();
    json["pictures"] = nlohmann::ordered_json::array();
    for (const Moment& moment : moments_) {
        Picture picture{.moment = moment, .output = outputOf(moment)};
        pose(picture);
        const View& view = picture.view;
        const Window& crop = view.crop;
        const bool there = isThere(picture);
        nlohmann::ordered_json entry;
        entry["output"] = picture.output.path.string();
        if (isSequence()) entry["frame"] = moment.frame;
        entry["time"] = moment.time;
        entry["width"] = view.width;
        entry["height"] = view.height;
        entry["crop"] = {crop.x0, crop.y0, crop.width(), crop.height()};
        entry["camera"] = view.camera_name;
        entry["settingsHash"] = picture.provenance.settings_hash;
        entry["outputHash"] = picture.provenance.output_hash;
        entry["exists"] = fs::exists(picture.output.path);
        entry["upToDate"] = there;
        entry["action"] = there && options_.sequence.skip_existing ? "skip" : "render";
        json["pictures"].push_back(std::move(entry));
    }
    console_.result(jsonText(json));
}

}  // namespace

VerbAction declareRender(CLI::App& app) {
    const auto options = std::make_shared<RenderOptions>();
    addRenderOptions(app, *options);
    return [options](Console& console) { return Render(*options, console).run(); };
}

}  // namespace peeler::cmd
