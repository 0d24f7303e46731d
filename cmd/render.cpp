// SPDX-License-Identifier: Apache-2.0
// peeler render: from a scene to the layers of one picture, or of each frame of a sequence.
#include <algorithm>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "cmd/cli/errors.h"
#include "cmd/cli/progress.h"
#include "cmd/cli/report.h"
#include "cmd/render/render_request.h"
#include "cmd/render/sequence_results.h"
#include "cmd/verbs.h"
#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/capture/bands.h"
#include "core/gl/context.h"
#include "core/image/background_sink.h"
#include "core/image/fxaa.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

using Clock = std::chrono::steady_clock;

/// A picture in the making.
struct Picture {
    PictureRequest asked{};
    Clock::time_point start{};
    Plan plan{};
    PictureResult result{};
    std::unique_ptr<Sink> writer{};
    BackgroundSink* behind = nullptr;  ///< the writer, if it goes on by itself
};

/// The run of one request. Scene, shaders and context are there once for all pictures, and a
/// picture is captured while the one before is being written.
class Render {
  public:
    Render(const RenderOptions& options, Console& console)
        : options_(options),
          console_(console),
          request_(options, console),
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
            // The frames that are there should be known, whatever becomes of telling it.
            const int told = runReported(console_, [&] {
                if (!results_.empty()) results_.tell();
                return 0;
            });
            return std::max({reportError(console_, error), results_.worst(), told});
        }
        results_.tell();
        return results_.worst();
    }

  private:
    void renderAll();
    void render(std::size_t index);
    bool make(Picture& picture, std::size_t index);
    void pose(Picture& picture, std::size_t index);
    void capture(Picture& picture);
    void openRenderer(Picture& picture);
    void closeRenderer();
    void plan(Picture& picture);
    void makeWriter(Picture& picture);
    void settle() { settle(options_.sequence.keep_going); }
    void settle(bool keep_going);
    void tell(Picture& picture);
    void tellSkipped(Picture& picture);
    Progress progressOf(const Picture& picture);

    const RenderOptions& options_;
    Console& console_;
    const Clock::time_point start_ = Clock::now();
    RenderRequest request_;
    std::unique_ptr<gl::Context> context_;  // before what lives in it
    std::optional<Renderer> renderer_;
    std::optional<Picture> written_;  // captured, and perhaps still being written
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
        settle(true);  // the picture before is none the worse for it
        throw error;
    }
    settle();
    progress_->update(1);
    progress_.reset();
}

void Render::render(std::size_t index) {
    Picture picture;
    picture.start = index == 0 ? start_ : Clock::now();
    if (index == 0) picture.result.milliseconds = request_.times();
    try {
        if (!make(picture, index)) return;
    } catch (...) {
        const Error error = currentError();
        const bool of_all =
            error.kind() == ErrorKind::kUsage || (error.kind() == ErrorKind::kDevice && !context_);
        if (!options_.sequence.keep_going || of_all) throw error;
        settle();
        results_.addFailure(request_.outputFile(index), request_.frame(index), error);
        closeRenderer();  // whatever state it was left in
        return;
    }
    settle();
    written_ = std::move(picture);
    if (!written_->behind) settle();
}

/// Captures a picture and begins to write it; false if its file was there already.
bool Render::make(Picture& picture, std::size_t index) {
    pose(picture, index);
    if (picture.asked.frame) {
        progress_->status("frame " + std::to_string(*picture.asked.frame) + ", " +
                          std::to_string(index + 1) + " of " + std::to_string(request_.pictures()));
    }
    if (options_.sequence.skip_existing && request_.isThere(picture.asked)) {
        settle();
        tellSkipped(picture);
        return false;
    }
    if (options_.output.no_clobber) checkTarget(picture.asked.output, {});
    try {
        capture(picture);
        return true;
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kDevice || !context_) throw;
        console_.warning(std::string(error.what()) + "; trying once more.");
    }
    // A context that was lost takes everything that lives in it along.
    picture.writer.reset();
    closeRenderer();
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
    if (renderer_)
        renderer_->setPose(*asked.posed);
    else
        openRenderer(picture);
    if (asked.next) renderer_->setNextFrame(std::move(*asked.next));
    asked.provenance.renderer = context_->device().renderer;
    picture.result.backend = context_->device().backend;
    plan(picture);
    makeWriter(picture);
    picture.result.passes = renderer_->capture(*picture.writer, progressOf(picture)).passes;
    add(picture.result.milliseconds, renderer_->takeTimes());
    picture.writer->finish();
}

void Render::openRenderer(Picture& picture) {
    {
        const StageTimer timer(picture.result.milliseconds, "context");
        context_ = openContext(options_.device, console_);
    }
    renderer_.emplace(*context_, *picture.asked.posed);
}

void Render::closeRenderer() {
    renderer_.reset();
    context_.reset();
}

void Render::plan(Picture& picture) {
    const CaptureSettings& capture = picture.asked.capture;
    // Two pictures at once only where there is plenty of room for both.
    if (written_ && capture.memory != 0 && residentBytes() > capture.memory / 4) settle();
    picture.plan = renderer_->plan(picture.asked.view, capture, progressOf(picture));
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
    const OutputOptions output = request_.writerOptions(picture.asked);
    picture.writer = makeSink(picture.asked.output.path.string(), output);
    if (options_.fxaa)
        picture.writer = std::make_unique<FxaaFilter>(std::move(picture.writer), output.background);
    if (request_.pictures() > 1 && threadCount() > 1) {
        auto behind = std::make_unique<BackgroundSink>(std::move(picture.writer));
        picture.behind = behind.get();
        picture.writer = std::move(behind);
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
void Render::settle(bool keep_going) {
    if (!written_) return;
    Picture picture = std::move(*written_);
    written_.reset();
    try {
        if (picture.behind) picture.behind->wait();
        tell(picture);
    } catch (...) {
        if (!keep_going) throw;
        results_.addFailure(picture.asked.output.path, picture.asked.frame, currentError());
    }
}

void Render::tell(Picture& picture) {
    const PictureRequest& asked = picture.asked;
    PictureResult& result = picture.result;
    const auto end = picture.behind ? picture.behind->finishedAt() : Clock::now();
    add(result.milliseconds, picture.writer->times());
    result.milliseconds["total"] =
        std::chrono::duration<double, std::milli>(end - picture.start).count();
    describePicture(picture.plan, asked.provenance, result);
    describeFiles(asked.output, result, console_);
    results_.add(result);
}

void Render::tellSkipped(Picture& picture) {
    picture.result.bytes = fileBytes(picture.result.output);
    picture.result.skipped = true;
    results_.add(picture.result);
}

}  // namespace

VerbAction declareRender(VerbOptions& verb) {
    const auto options = std::make_shared<RenderOptions>();
    addRenderOptions(verb, *options);
    return [options](Console& console) { return Render(*options, console).run(); };
}

}  // namespace peeler::cmd
