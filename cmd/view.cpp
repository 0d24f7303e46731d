// SPDX-License-Identifier: Apache-2.0
// peeler view: the layers of a file as another camera sees them, or as a page to look around in.
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "cmd/cli/options.h"
#include "cmd/cli/parse.h"
#include "cmd/cli/progress.h"
#include "cmd/cli/report.h"
#include "cmd/machine/resources.h"
#include "cmd/options/output_options.h"
#include "cmd/verbs.h"
#include "cmd/view/view_camera.h"
#include "core/image/nearest.h"
#include "core/views/reprojection.h"
#include "formats/file/output_hash.h"
#include "formats/layered_input.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

constexpr const char* kPageKind = "page";
constexpr const char* kMethod = "reprojection";

struct ViewOptions {
    fs::path input;
    std::uint32_t max_layers = 0;                ///< nearest layers; 0 = all
    std::optional<std::uint64_t> max_fragments;  ///< of a page; 0 = any number
    int threads = 0;
    ViewCameraOptions camera;
    OutputFlags output;
    ReportFlags report;
};

/// One run. run() lists its stages.
class ViewRun {
  public:
    ViewRun(const ViewOptions& options, Console& console) : options_(options), console_(console) {}

    void run() {
        {
            const StageTimer timer(result_.milliseconds, "total");
            checkOptions();
            load();
            render();
        }
        tell();
    }

  private:
    void checkOptions();
    void load();
    void render();
    /// The picture from `view`, in bands.
    void reprojectInto(Sink& writer, const View& view);
    void tell();

    ViewOptions options_;
    bool page_ = false;
    Console& console_;
    std::unique_ptr<LayeredInput> reader_;
    LayeredImage image_;  ///< all of the file, limited
    Plan plan_;           ///< what the layers were captured by
    PictureResult result_;
};

void ViewRun::checkOptions() {
    options_.report.applyTo(console_);
    checkViewCameraOptions(options_.camera);
    page_ = findOutputFormat(options_.output.path.string(), "").kind == kPageKind;
    options_.output.as = page_ ? kPageKind : "composite";
    if (page_ && options_.camera.changesAnything()) {
        throw Error(ErrorKind::kUsage, "a page begins at the file's own camera",
                    options_.output.path.string(),
                    "leave the options of camera and picture out, or write a .png");
    }
    if (!page_ && options_.max_fragments) {
        throw Error(ErrorKind::kUsage, "only a page has a limit", "--max-fragments",
                    "leave it out, or write a .html");
    }
    checkOutput(options_.output, {options_.input});
    checkReport(options_.report, {options_.input, options_.output.path});
    setThreads(options_.threads);
}

void ViewRun::load() {
    const StageTimer timer(result_.milliseconds, "load");
    reader_ = openLayered(options_.input.string());
    plan_ = reader_->info().plan;
    if (!reader_->info().attributes().contains("peeler:cameraJson")) {
        throw Error(ErrorKind::kInput, "the file does not say which camera its layers come from",
                    options_.input.string(),
                    "view needs the attribute peeler:cameraJson, which peeler render writes");
    }
    reader_->read(plan_.view.crop, image_);
    if (options_.max_layers != 0) {
        keepNearest(image_, options_.max_layers);
        plan_.layers.resize(std::min<std::size_t>(plan_.layers.size(), options_.max_layers));
    }
    plan_.fragments_stored = image_.fragments();
    // Files of others do not say how many there were.
    plan_.fragments_counted = std::max(plan_.fragments_counted, plan_.fragments_stored);
}

void ViewRun::render() {
    Plan plan = plan_;
    if (!page_) plan.view = viewFrom(plan_.view, image_, options_.camera);
    Provenance provenance = reader_->info().provenance;
    provenance.version = PEELER_VERSION;
    provenance.method = kMethod;
    provenance.settings_hash.clear();  // of other settings
    OutputOptions output = outputOptions(options_.output, provenance);
    if (page_ && options_.max_layers == 0) {
        const ExrInfo& input = reader_->info();
        output.provenance.output_hash =
            outputHashFrom(input, plan.view, options_.output.path.string(),
                           outputOptions(options_.output, input.provenance));
    }
    if (options_.max_fragments) {
        output.max_fragments = *options_.max_fragments == 0
                                   ? std::numeric_limits<std::uint64_t>::max()
                                   : *options_.max_fragments;
    }
    const auto writer = makeSink(options_.output.path.string(), output);
    writer->begin(plan);
    if (page_)
        writer->write(image_);
    else
        reprojectInto(*writer, plan.view);
    writer->finish();
    add(result_.milliseconds, writer->times());
    result_.width = plan.view.width;
    result_.height = plan.view.height;
}

void ViewRun::reprojectInto(Sink& writer, const View& view) {
    ProgressReport progress(console_, options_.report.shownProgress(), "view");
    {
        const StageTimer timer(result_.milliseconds, "capture");
        reproject(image_, plan_.view, view, [&](const LayeredImage& band) {
            writer.write(band);
            progress.update(static_cast<double>(band.window.y1 - view.crop.y0) /
                            view.crop.height());
        });
    }
    // Bands were written in between.
    for (const auto& [stage, milliseconds] : writer.times())
        result_.milliseconds["capture"] -= milliseconds;
}

void ViewRun::tell() {
    result_.output = options_.output.path;
    result_.bytes = fileBytes(options_.output.path);
    result_.layers = plan_.layers.size();
    result_.fragments_counted = plan_.fragments_counted;
    result_.fragments_stored = plan_.fragments_stored;
    result_.method = kMethod;
    result_.renderer = reader_->info().provenance.renderer;
    result_.peak_memory = peakMemory();
    tellResult(options_.report, result_, console_);
}

}  // namespace

VerbAction declareView(VerbOptions& verb) {
    const auto options = std::make_shared<ViewOptions>();
    addValue(
        verb, "IN", "", options->input, [](const std::string& text) { return fs::path(text); },
        "a layered or deep image (.exr)")
        .required();
    addViewCameraOptions(verb, options->camera);
    addOutputOptions(verb, options->output);
    addValue(
        verb, "--layers", "N|all", options->max_layers,
        [](const std::string& text) { return parseLayers(text); },
        "use the N nearest layers of every pixel (default: all)")
        .group("Layers");
    addValue(
        verb, "--max-fragments", "N|all", options->max_fragments,
        [](const std::string& text) {
            if (text == "all") return std::uint64_t{0};
            return static_cast<std::uint64_t>(parseInteger(text, 1, 1'000'000'000));
        },
        "a page (.html) holds no more fragments than these (default: 4000000)")
        .group("Layers");
    addThreadsOption(verb, options->threads);
    addReportOptions(verb, options->report);
    return [options](Console& console) {
        ViewRun(*options, console).run();
        return 0;
    };
}

}  // namespace peeler::cmd
