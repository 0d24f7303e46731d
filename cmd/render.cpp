// SPDX-License-Identifier: Apache-2.0
// peeler render: the layers of a picture, or of each frame of a sequence.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/report.h"
#include "cmd/machine/resources.h"
#include "cmd/options/empty_picture.h"
#include "cmd/options/forecast.h"
#include "cmd/options/many_scenes.h"
#include "cmd/options/output_checks.h"
#include "cmd/options/sequence_options.h"
#include "cmd/render/channel_options.h"
#include "cmd/render/presets.h"
#include "cmd/render/render_options.h"
#include "cmd/render/render_request.h"
#include "cmd/render/scene_list.h"
#include "cmd/render/used_cameras.h"
#include "cmd/session/progress_report.h"
#include "cmd/verbs.h"
#include "core/base/parallel.h"
#include "core/base/process_memory.h"
#include "core/base/stage_times.h"
#include "core/capture/gl_planner.h"
#include "core/image/background_sink.h"
#include "core/image/fxaa.h"
#include "formats/file/file_name.h"
#include "formats/file/regular_file.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

using Clock = std::chrono::steady_clock;

/// A picture in progress.
struct Picture {
    PictureRequest asked{};
    Clock::time_point start{};
    CapturePlan plan{};
    PictureResult result{};
    std::unique_ptr<Sink> writer{};
    OutputOptions written{};               ///< options of the writer
    BackgroundSink* background = nullptr;  ///< the writer, if the writer runs on its own thread
};

/// A run of one request. The pictures of a run share the scene, the shaders and the context. While
/// a picture is captured, the previous picture may still be written.
class Render {
  public:
    Render(const RenderOptions& options, Session& session)
        : options_(options),
          reporter_(session.reporter()),
          job_(options, session),
          request_(options, job_, session.reporter()),
          results_(request_.pictureKind(), session.reporter()) {}

    /// Returns the exit code. Sets `result` to the result as JSON, or to the plan of a dry run, or
    /// to null if there is no result.
    int run(Json& result) {
        request_.openScene();
        if (options_.sequence.dry_run) {
            result = request_.plan();
            return runReported(reporter_, [&] {
                forecast(result);
                return 0;
            });
        }
        int code = 0;
        try {
            const std::string name = options_.output.path.string();
            if (!request_.hasFrames() && hasFrameToken(name))
                reporter_.warning("Without --frames, the name keeps its placeholder: " + name);
            if (options_.views.cameras_out)
                cameras_.emplace(*options_.views.cameras_out, request_.pictures());
            renderAll();
            if (cameras_) writeCameras();
            if (options_.channels.manifest)
                writeIdManifest(*options_.channels.manifest, idNames(request_.scene()));
        } catch (...) {
            code = reportError(reporter_, currentError());
        }
        // Reports finished frames even if others failed.
        if (!results_.empty() || (code == 0 && request_.isSequence())) result = results_.json();
        results_.reportFailures();
        return std::max(code, results_.worst());
    }

  private:
    void renderAll();
    void render(std::size_t index);
    bool make(Picture& picture, std::size_t index);
    void pose(Picture& picture, std::size_t index);
    void capture(Picture& picture);
    void prepare(Picture& picture);
    void forecast(Json& result);
    void forecastMemory(const Picture& picture);
    void meterExposure(const PictureRequest& asked);
    void plan(Picture& picture);
    void noteEmpty(const Picture& picture);
    void makeWriter(Picture& picture);
    void reportSize(Picture& picture, const OutputOptions& output);
    void endPending() { endPending(options_.sequence.keep_going); }
    void endPending(bool keep_going);
    void report(Picture& picture);
    void reportSkipped(Picture& picture);
    void addResult(const PictureResult& result);
    void writeCameras();
    Progress progressOf(const Picture& picture);
    void finishProgress(const Picture& picture);

    const RenderOptions& options_;
    Reporter& reporter_;
    CaptureJob job_;
    RenderRequest request_;
    // Automatic exposure in stops; none = not metered yet.
    std::optional<float> exposure_;
    bool noted_ = false;
    std::optional<Picture> pending_;  // previous picture, perhaps still being written
    SequenceResults results_;
    std::optional<ProgressReport> progress_;
    std::optional<UsedCameras> cameras_;  ///< for --cameras-out
    bool size_told_ = false;
    bool lens_seen_ = false;             ///< whether a picture has had a lens
    std::uint64_t memory_forecast_ = 0;  ///< bytes
    std::size_t empty_ = 0;              ///< number of pictures without fragments
};

void Render::renderAll() {
    progress_.emplace(reporter_, "render");
    try {
        for (std::size_t i = 0; i < request_.pictures(); ++i)
            render(i);
    } catch (...) {
        const Error error = currentError();
        endPending(true);  // the previous picture has not failed
        throw error;
    }
    endPending();
    progress_->update(1);
    progress_.reset();
    if (empty_ > 1)
        reporter_.warning(groupedText(empty_) + " of " + groupedText(request_.pictures()) +
                          " pictures are empty.");
}

void Render::render(std::size_t index) {
    Picture picture;
    picture.start = index == 0 ? job_.start() : Clock::now();
    // The first picture's times include opening the scene.
    if (index == 0) picture.result.milliseconds = job_.takeTimes();
    try {
        if (!make(picture, index)) return;
    } catch (...) {
        const Error error = currentError();
        const bool of_all = error.kind() == ErrorKind::kUsage ||
                            (error.kind() == ErrorKind::kDevice && !job_.hasContext());
        if (!options_.sequence.keep_going || of_all) throw error;
        endPending();
        results_.addFailure(request_.outputFile(index), request_.number(index), error);
        job_.discard();
        return;
    }
    endPending();
    pending_ = std::move(picture);
    if (!pending_->background) endPending();
}

/// Captures a picture and begins to write it. Returns false if the picture's file is already up to
/// date.
bool Render::make(Picture& picture, std::size_t index) {
    pose(picture, index);
    if (request_.isSequence()) {
        progress_->status(picture.asked.number.text() + ", " + std::to_string(index + 1) + " of " +
                          std::to_string(request_.pictures()));
    }
    if (options_.sequence.skip_existing && request_.isUpToDate(picture.asked)) {
        endPending();
        reportSkipped(picture);
        return false;
    }
    if (options_.output.no_clobber) checkTarget(picture.asked.output, {});
    const std::filesystem::path& path = picture.asked.output.path;
    if (options_.sequence.skip_existing && fileExists(path, ErrorKind::kOutput)) {
        reporter_.note(path.string() +
                       " is written again: " + request_.differenceOf(picture.asked));
    }
    try {
        capture(picture);
        return true;
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kDevice || !job_.hasContext()) throw;
        reporter_.warning(error.whatText() + "; trying once more.");
    }
    // A lost context loses all GL objects.
    picture.writer.reset();
    job_.closeContext();
    pose(picture, index);
    capture(picture);
    return true;
}

void Render::pose(Picture& picture, std::size_t index) {
    const StageTimer timer(picture.result.milliseconds, "load");
    picture.asked = request_.picture(index);
    picture.result.inputs = {options_.scene.file};
    picture.result.output = picture.asked.output.path;
    picture.result.frame = picture.asked.number.frame;
    picture.result.time = picture.asked.time;
    picture.result.view = picture.asked.number.view;
    picture.result.camera = picture.asked.view.camera_name;
    picture.result.normalized = request_.normalized();
    if (request_.makesSamples()) picture.result.sample_view = picture.asked.view;
}

/// Runs the count pass. Creates the writer, but does not start it.
void Render::prepare(Picture& picture) {
    PictureRequest& asked = picture.asked;
    GlRenderer& renderer = job_.openRenderer(*asked.posed);
    if (asked.view.rays && !std::exchange(lens_seen_, true))
        warnOfThin(*asked.posed, options_.scene, "pictures", reporter_);
    // Reported only for the first picture.
    picture.result.camera_cut = !size_told_ && !reporter_.quiet() &&
                                request_.views().cutsSceneOff(asked.view, *asked.posed);
    meterExposure(asked);
    if (asked.next) renderer.setNextFrame(std::move(*asked.next));
    if (const gl::Device* const device = job_.device()) {
        asked.provenance.renderer = device->renderer;
        picture.result.backend = device->backend;
    }
    plan(picture);
    makeWriter(picture);
    forecastMemory(picture);
}

void Render::capture(Picture& picture) {
    prepare(picture);
    GlRenderer& renderer = *job_.renderer();
    picture.writer->begin(picture.plan);
    picture.result.passes =
        renderer.capture(picture.plan, *picture.writer, progressOf(picture)).passes;
    reporter_.detail("captured in " +
                     countText(static_cast<std::uint64_t>(picture.result.passes), "geometry pass") +
                     "; writing " + request_.outputFile(picture.asked.index).string());
    add(picture.result.milliseconds, job_.takeTimes());
    picture.writer->finish();
}

/// Forecasts the memory of the run up to this picture. The forecast is the maximum over the
/// pictures, because each picture reuses the memory of earlier pictures.
void Render::forecastMemory(const Picture& picture) {
    memory_forecast_ = std::max({memory_forecast_, repeatedPeak(peakMemory()),
                                 job_.renderer()->forecastMemory(picture.plan, *picture.writer)});
    reporter_.detail("uses at most " + bytesText(memory_forecast_) + " of memory");
}

/// Adds the forecasts for the first picture to a dry run's result. The forecasts are null if there
/// is no picture to render, or no device to count fragments.
void Render::forecast(Json& result) {
    const std::optional<std::size_t> first = RenderRequest::firstOf(result);
    for (const char* const unknown : {"forecastBytes", "forecastMemory"})
        result[unknown] = nullptr;
    if (!first) return;
    Picture picture;
    pose(picture, *first);
    try {
        prepare(picture);
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kDevice) throw;
        reporter_.warning(
            "The output file's size and the memory needed are unknown: " + error.whatText() + ".");
        return;
    }
    result["forecastBytes"] = *picture.result.forecast_bytes;
    result["forecastMemory"] = memory_forecast_;
    reportMemory(memory_forecast_, reporter_);
}

/// Meters the exposure, once per run.
void Render::meterExposure(const PictureRequest& asked) {
    if (!request_.metersExposure() || exposure_) return;
    exposure_ = job_.meterExposure(asked.capture, request_.views().cameras());
    job_.renderer()->setPose(*asked.posed);
}

void Render::plan(Picture& picture) {
    const CaptureSettings& capture = picture.asked.capture;
    // Finishes the previous picture first if more than a quarter of the budget is already in use.
    if (pending_ && capture.memory != 0 && usedBytes(capture.memory) > capture.memory / 4)
        endPending();
    picture.plan = job_.renderer()->plan(picture.asked.view, capture, progressOf(picture));
    const Plan& plan = picture.plan;
    reporter_.detail("counted " + countText(plan.fragments_counted, "fragment") + " in " +
                     countText(plan.layers.size(), "layer") + " of " +
                     std::to_string(plan.view.width) + "x" + std::to_string(plan.view.height) +
                     " pixels; capturing them with " + picture.asked.capture.method);
    if (plan.fragments_counted == 0) noteEmpty(picture);
    if (!options_.scene.reading.strict || plan.complete()) return;
    const bool blended = plan.fragments_blended != 0;
    throw Error(ErrorKind::kIncomplete,
                std::string("the layer limit ") + (blended ? "approximates " : "leaves out ") +
                    countText(plan.fragments_counted - plan.fragments_stored, "fragment") + " of " +
                    groupedText(plan.fragments_counted),
                request_.outputFile(picture.asked.index).string(),
                "use --layers all and no --occlusion-ratio, or leave --strict out");
}

/// Counts empty pictures. Warns only of the first empty picture unless --strict.
void Render::noteEmpty(const Picture& picture) {
    const PictureRequest& asked = picture.asked;
    if (empty_++ > 0 && !options_.scene.reading.strict) return;
    reportEmpty(request_.outputFile(asked.index),
                emptyReason(*asked.posed, asked.view, asked.capture, options_.scene),
                options_.scene.reading.strict, reporter_);
}

void Render::makeWriter(Picture& picture) {
    OutputOptions output = request_.writerOptions(picture.asked);
    if (exposure_) {
        output.exposure = *exposure_;
        output.automatic_exposure = false;  // already metered
    }
    picture.written = output;
    reportSize(picture, output);
    picture.writer = makeSink(picture.asked.output.path.string(), output);
    if (options_.fxaa)
        picture.writer = std::make_unique<FxaaFilter>(std::move(picture.writer), output.background);
    if (request_.pictures() > 1 && threadCount() > 1) {
        auto background = std::make_unique<BackgroundSink>(std::move(picture.writer));
        picture.background = background.get();
        picture.writer = std::move(background);
    }
    if (cameras_) picture.writer = cameras_->watched(std::move(picture.writer));
}

/// Writes the cameras of all views, including those that this run does not render.
void Render::writeCameras() {
    for (std::size_t view = 0; view < request_.views().size(); ++view)
        cameras_->add(request_.firstView(view), request_.firstFile(view));
    cameras_->write();
}

/// Reports the forecast file size, once per run. Assumes that all remaining pictures, including
/// those of other scenes, have the same size.
void Render::reportSize(Picture& picture, const OutputOptions& output) {
    const std::filesystem::path& path = picture.asked.output.path;
    Forecast forecast;
    forecast.files = {{request_.outputFile(picture.asked.index),
                       forecastPicture(path.string(), picture.plan, output),
                       countText(picture.plan.fragments_stored, "fragment")}};
    picture.result.forecast_bytes = forecast.size().bytes;
    if (std::exchange(size_told_, true)) return;
    forecast.times = request_.pictures() * options_.scenes_like_this - picture.asked.index;
    reportForecast(forecast, reporter_, options_.sequence.dry_run);
}

/// Returns the progress callback for a capture. The last hundredth of a picture's progress is for
/// writing.
Progress Render::progressOf(const Picture& picture) {
    if (!progress_) return {};  // a dry run shows no progress
    const auto index = static_cast<double>(picture.asked.index);
    return [this, index](double share) {
        progress_->update((index + 0.99 * share) / static_cast<double>(request_.pictures()));
    };
}

/// Completes the progress bar before the result of the last picture is reported.
void Render::finishProgress(const Picture& picture) {
    if (picture.asked.index + 1 == request_.pictures()) progress_->update(1);
}

/// Finishes the previous picture, if any. If writing has failed, throws the error or, if
/// `keep_going`, adds the error to the results.
void Render::endPending(bool keep_going) {
    if (!pending_) return;
    Picture picture = std::move(*pending_);
    pending_.reset();
    try {
        if (picture.background) picture.background->wait();
        report(picture);
    } catch (...) {
        if (!keep_going) throw;
        results_.addFailure(request_.outputFile(picture.asked.index), picture.asked.number,
                            currentError());
    }
}

void Render::report(Picture& picture) {
    const PictureRequest& asked = picture.asked;
    PictureResult& result = picture.result;
    const auto end = picture.background ? picture.background->finishedAt() : Clock::now();
    add(result.milliseconds, picture.writer->times());
    result.milliseconds["total"] =
        std::chrono::duration<double, std::milli>(end - picture.start).count();
    describePicture(picture.plan, asked.provenance, result);
    result.without_ray = picture.plan.without_ray;
    result.forecast_memory = memory_forecast_;
    describeFiles(asked.output, result, reporter_);
    if (options_.shards) options_.shards->add(asked, result);
    describeDisplay(picture.written, request_.metersExposure(), result);
    const bool first = !std::exchange(noted_, true);
    if (first) noteWithoutRay(result.without_ray, asked.view.crop.pixels(), reporter_);
    if (first) noteDisplay(result, reporter_);
    const CaptureSettings& capture = asked.capture;
    result.counted_samples = capture.composite ? result.samples : 1;
    result.counts_visible = skipsHidden(capture);
    if (result.display) result.light = request_.lightText(*asked.posed, first);
    finishProgress(picture);
    addResult(result);
}

void Render::reportSkipped(Picture& picture) {
    if (options_.shards)
        options_.shards->keep(picture.asked, picture.result);
    else
        picture.result.bytes = fileBytes(picture.result.output);
    picture.result.skipped = true;
    finishProgress(picture);
    addResult(picture.result);
}

void Render::addResult(const PictureResult& result) {
    results_.add(toJson(result), summary(result));
}

/// Reports the result as the options request. Returns the exit code.
int report(const RenderOptions& options, const Json& result, Reporter& reporter) {
    return runReported(reporter, [&] {
        if (options.sequence.dry_run)
            reporter.result(result);
        else if (!result.is_null())
            reportResult(options.report, result, {}, reporter);
        return 0;
    });
}

int renderOne(const RenderOptions& options, Session& session) {
    Reporter& reporter = session.reporter();
    Json result;
    int code = Render(options, session).run(result);
    code = std::max(code, endShards(options, code == 0 || options.sequence.keep_going, reporter));
    return std::max(code, report(options, result, reporter));
}

/// Renders the scenes one by one, each with its options in `scenes`. Reports {"scenes": [one result
/// per scene]} with a list "failed" if any scene failed.
int renderEach(const RenderOptions& options, const std::vector<RenderOptions>& scenes,
               Session& session) {
    Reporter& reporter = session.reporter();
    options.report.applyTo(reporter);
    std::vector<std::filesystem::path> files;
    for (const RenderOptions& one : scenes)
        files.push_back(one.scene.file);
    Json results;
    int worst = makeEachScene(
        files, options.sequence.keep_going, reporter, results,
        [&](std::size_t i, Json& result) { return Render(scenes[i], session).run(result); });
    worst =
        std::max(worst, endShards(options, worst == 0 || options.sequence.keep_going, reporter));
    worst = std::max(worst, report(options, results, reporter));
    reportFailedScenes(results, scenes.size(), reporter);
    return worst;
}

}  // namespace

VerbAction declareRender(VerbOptions& verb) {
    const auto options = std::make_shared<RenderOptions>();
    addRenderOptions(verb, *options);
    return [options, verb](Session& session) {
        options->samples_given = verb.given("--samples");
        options->output.options.cryptomatte = options->channels.cryptomatte;
        applyPreset(verb, *options);
        takeLens(options->lens, options->camera);
        if (namesShards(options->output.path))
            options->shards = std::make_shared<SampleShards>(*options, session.reporter());
        else
            refuseShardOptions(verb);
        if (findOutputFormat(options->output.path.string(), options->output.options.as).for_display)
            chooseForEyes(verb, options->camera, *options);
        const std::vector<RenderOptions> scenes = eachScene(*options);
        return options->isOneScene() ? renderOne(scenes.front(), session)
                                     : renderEach(*options, scenes, session);
    };
}

}  // namespace peeler::cmd
