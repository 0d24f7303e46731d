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

#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/progress.h"
#include "cmd/cli/report.h"
#include "cmd/render/render_request.h"
#include "cmd/verbs.h"
#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/capture/bands.h"
#include "core/image/background_sink.h"
#include "core/image/filters.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

using Clock = std::chrono::steady_clock;

/// What became of the pictures of a run: reported as each ends, and together at the end.
class SequenceResults {
  public:
    /// `sequence`: the pictures are frames; else there is one picture. Flags and console must
    /// outlive this object.
    SequenceResults(const ReportOptions& report, bool sequence, Console& console)
        : report_(report), sequence_(sequence), console_(console) {}

    void add(const PictureResult& result);
    /// Reports the failure of a picture that the others go on without.
    void addFailure(const std::filesystem::path& output, std::optional<int> frame,
                    const Error& error);

    bool empty() const { return finished_.empty() && failed_.empty(); }
    int worst() const { return worst_; }  ///< the greatest exit code of a failure; 0 = none
    /// The results of a sequence as asked for: {"frames": [one result a frame]} and, if there are
    /// any, "failed". (A lone picture's are reported when it ends.)
    void report() const;

  private:
    const ReportOptions& report_;
    bool sequence_;
    Console& console_;
    std::vector<PictureResult> finished_;
    std::vector<nlohmann::ordered_json> failed_;
    int worst_ = 0;
};

void SequenceResults::add(const PictureResult& result) {
    if (sequence_)
        console_.note(summary(result));
    else
        reportResult(report_, result, console_);
    finished_.push_back(result);
}

void SequenceResults::addFailure(const std::filesystem::path& output, std::optional<int> frame,
                                 const Error& error) {
    const std::string of = frame ? "frame " + std::to_string(*frame) + ": " : "";
    const int code =
        reportError(console_, Error(error.kind(), of + error.what(), error.where(), error.hint()));
    worst_ = std::max(worst_, code);
    nlohmann::ordered_json json;
    if (frame) json["frame"] = *frame;
    json["output"] = output.string();
    json["exitCode"] = code;
    json["error"] = error.what();
    json["where"] = error.where();
    json["hint"] = error.hint();
    failed_.push_back(std::move(json));
}

void SequenceResults::report() const {
    if (!sequence_) return;
    nlohmann::ordered_json json;
    json["frames"] = nlohmann::ordered_json::array();
    for (const PictureResult& result : finished_)
        json["frames"].push_back(toJson(result));
    if (!failed_.empty()) json["failed"] = failed_;
    if (report_.file) writeReport(*report_.file, json);
    if (report_.json) console_.result(jsonText(json));
    if (failed_.empty()) return;
    console_.error(std::to_string(failed_.size()) + " of " +
                   countText(finished_.size() + failed_.size(), "frame") + " failed");
}

/// A picture in the making.
struct Picture {
    PictureRequest asked{};
    Clock::time_point start{};
    Plan plan{};
    PictureResult result{};
    std::unique_ptr<Sink> writer{};
    OutputOptions written{};               ///< what the writer was told
    BackgroundSink* background = nullptr;  ///< the writer, if it has a thread of its own; else null
};

/// The run of one request. Scene, shaders and context are there once for all pictures, and a
/// picture is captured while the one before is being written.
class Render {
  public:
    Render(const RenderOptions& options, Console& console)
        : options_(options),
          console_(console),
          job_(options, console),
          request_(options, job_),
          results_(options.report, request_.isSequence(), console) {}

    int run() {
        if (options_.sequence.dry_run) {
            console_.result(jsonText(request_.plan()));
            return 0;
        }
        try {
            renderAll();
            if (options_.channels.manifest)
                writeIdManifest(*options_.channels.manifest, idNames(request_.scene()));
        } catch (...) {
            const Error error = currentError();
            // The frames that are there should be known, whatever becomes of the report.
            const int reported = runReported(console_, [&] {
                if (!results_.empty()) results_.report();
                return 0;
            });
            return std::max({reportError(console_, error), results_.worst(), reported});
        }
        results_.report();
        return results_.worst();
    }

  private:
    void renderAll();
    void render(std::size_t index);
    bool make(Picture& picture, std::size_t index);
    void pose(Picture& picture, std::size_t index);
    void capture(Picture& picture);
    void meterExposure(const PictureRequest& asked);
    void plan(Picture& picture);
    void makeWriter(Picture& picture);
    void endPending() { endPending(options_.sequence.keep_going); }
    void endPending(bool keep_going);
    void report(Picture& picture);
    void reportSkipped(Picture& picture);
    Progress progressOf(const Picture& picture);

    const RenderOptions& options_;
    Console& console_;
    CaptureJob job_;
    RenderRequest request_;
    std::optional<float> exposure_;   // that was metered, for all pictures
    bool noted_ = false;              // how pictures are shown
    std::optional<Picture> pending_;  // captured, and perhaps still being written
    SequenceResults results_;
    std::optional<ProgressReport> progress_;
};

void Render::renderAll() {
    progress_.emplace(console_, options_.report.shownProgress(), "render");
    try {
        for (std::size_t i = 0; i < request_.pictures(); ++i)
            render(i);
    } catch (...) {
        const Error error = currentError();
        endPending(true);  // the picture before is not at fault
        throw error;
    }
    endPending();
    progress_->update(1);
    progress_.reset();
}

void Render::render(std::size_t index) {
    Picture picture;
    picture.start = index == 0 ? job_.start() : Clock::now();
    if (index == 0) picture.result.milliseconds = job_.takeTimes();  // of opening the scene
    try {
        if (!make(picture, index)) return;
    } catch (...) {
        const Error error = currentError();
        const bool of_all = error.kind() == ErrorKind::kUsage ||
                            (error.kind() == ErrorKind::kDevice && !job_.hasContext());
        if (!options_.sequence.keep_going || of_all) throw error;
        endPending();
        results_.addFailure(request_.outputFile(index), request_.frame(index), error);
        job_.closeRenderer();  // the failure may have left it in any state
        job_.takeTimes();      // these times belong to no picture
        return;
    }
    endPending();
    pending_ = std::move(picture);
    if (!pending_->background) endPending();
}

/// Captures a picture and begins to write it; false if its file was there already.
bool Render::make(Picture& picture, std::size_t index) {
    pose(picture, index);
    if (picture.asked.frame) {
        progress_->status("frame " + std::to_string(*picture.asked.frame) + ", " +
                          std::to_string(index + 1) + " of " + std::to_string(request_.pictures()));
    }
    if (options_.sequence.skip_existing && request_.isUpToDate(picture.asked)) {
        endPending();
        reportSkipped(picture);
        return false;
    }
    if (options_.output.no_clobber) checkTarget(picture.asked.output, {});
    try {
        capture(picture);
        return true;
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kDevice || !job_.hasContext()) throw;
        console_.warning(std::string(error.what()) + "; trying once more.");
    }
    // A context that was lost takes everything that lives in it along.
    picture.writer.reset();
    job_.closeRenderer();
    pose(picture, index);
    capture(picture);
    return true;
}

void Render::pose(Picture& picture, std::size_t index) {
    const StageTimer timer(picture.result.milliseconds, "load");
    picture.asked = request_.picture(index);
    picture.result.inputs = {options_.scene.file};
    picture.result.output = picture.asked.output.path;
    picture.result.frame = picture.asked.frame;
    picture.result.time = picture.asked.time;
}

void Render::capture(Picture& picture) {
    PictureRequest& asked = picture.asked;
    if (job_.renderer())
        job_.renderer()->setPose(*asked.posed);
    else
        job_.openRenderer(*asked.posed);
    Renderer& renderer = *job_.renderer();
    meterExposure(asked);
    if (asked.next) renderer.setNextFrame(std::move(*asked.next));
    asked.provenance.renderer = job_.device().renderer;
    picture.result.backend = job_.device().backend;
    plan(picture);
    makeWriter(picture);
    picture.result.passes = renderer.capture(*picture.writer, progressOf(picture)).passes;
    add(picture.result.milliseconds, job_.takeTimes());
    picture.writer->finish();
}

/// Finds the exposure of all pictures before the first one.
void Render::meterExposure(const PictureRequest& asked) {
    if (!request_.metersExposure() || exposure_) return;
    exposure_ = job_.meterExposure(asked.capture, options_.camera);
    job_.renderer()->setPose(*asked.posed);
}

void Render::plan(Picture& picture) {
    const CaptureSettings& capture = picture.asked.capture;
    // Two pictures at once only where there is plenty of room for both.
    if (pending_ && capture.memory != 0 && residentBytes() > capture.memory / 4) endPending();
    picture.plan = job_.renderer()->plan(picture.asked.view, capture, progressOf(picture));
    const Plan& plan = picture.plan;
    if (!options_.strict || plan.complete()) return;
    const bool blended = plan.fragments_blended != 0;
    throw Error(ErrorKind::kIncomplete,
                std::string("the layer limit ") +
                    (blended ? "leaves to an approximation " : "leaves out ") +
                    countText(plan.fragments_counted - plan.fragments_stored, "fragment") + " of " +
                    groupedText(plan.fragments_counted),
                picture.asked.output.path.string(),
                "use --layers all and no --occlusion-ratio, or leave --strict out");
}

void Render::makeWriter(Picture& picture) {
    OutputOptions output = request_.writerOptions(picture.asked);
    if (exposure_) {
        output.exposure = *exposure_;
        output.automatic_exposure = false;  // it is found
    }
    picture.written = output;
    picture.writer = makeSink(picture.asked.output.path.string(), output);
    if (options_.fxaa)
        picture.writer = std::make_unique<FxaaFilter>(std::move(picture.writer), output.background);
    if (request_.pictures() > 1 && threadCount() > 1) {
        auto background = std::make_unique<BackgroundSink>(std::move(picture.writer));
        picture.background = background.get();
        picture.writer = std::move(background);
    }
    picture.writer->begin(picture.plan);
}

/// The last hundredth is for what follows the capture.
Progress Render::progressOf(const Picture& picture) {
    const auto index = static_cast<double>(picture.asked.index);
    return [this, index](double share) {
        progress_->update((index + 0.99 * share) / static_cast<double>(request_.pictures()));
    };
}

/// Ends the picture that was captured last, if it has not been ended. Its failure is thrown, or
/// listed if the run goes on.
void Render::endPending(bool keep_going) {
    if (!pending_) return;
    Picture picture = std::move(*pending_);
    pending_.reset();
    try {
        if (picture.background) picture.background->wait();
        report(picture);
    } catch (...) {
        if (!keep_going) throw;
        results_.addFailure(picture.asked.output.path, picture.asked.frame, currentError());
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
    describeFiles(asked.output, result, console_);
    describeDisplay(picture.written, request_.metersExposure(), result);
    if (!noted_) noteDisplay(result, console_);
    noted_ = true;
    results_.add(result);
}

void Render::reportSkipped(Picture& picture) {
    picture.result.bytes = fileBytes(picture.result.output);
    picture.result.skipped = true;
    results_.add(picture.result);
}

}  // namespace

VerbAction declareRender(VerbOptions& verb) {
    const auto options = std::make_shared<RenderOptions>();
    addRenderOptions(verb, *options);
    return [options, verb](Console& console) {
        options->scene.gltf.strict = options->strict;
        options->samples_given = verb.given("--samples");
        if (findOutputFormat(options->output.path.string(), options->output.options.as).for_display)
            chooseForEyes(verb, options->camera, *options);
        return Render(*options, console).run();
    };
}

}  // namespace peeler::cmd
