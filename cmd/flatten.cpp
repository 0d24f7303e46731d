// SPDX-License-Identifier: Apache-2.0
// peeler flatten: the layers of a file composited on the CPU, band by band.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <utility>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/parse.h"
#include "cmd/cli/report.h"
#include "cmd/machine/resources.h"
#include "cmd/options/layered_bands.h"
#include "cmd/options/layered_options.h"
#include "cmd/options/object_options.h"
#include "cmd/options/output_checks.h"
#include "cmd/options/output_options.h"
#include "cmd/session/capture_choices.h"
#include "cmd/session/progress_report.h"
#include "cmd/session/session.h"
#include "cmd/verbs.h"
#include "core/base/stage_times.h"
#include "core/image/composite.h"
#include "core/image/fxaa.h"
#include "formats/exr/layered_input.h"
#include "formats/output_hash.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct FlattenOptions {
    fs::path input;
    LayeredReadOptions reading;
    ObjectOptions objects;
    std::uint32_t max_layers = 0;  ///< nearest layers; 0 = all
    Tail tail = Tail::kDrop;       ///< of the layers behind them

    bool blendsTail() const { return tail == Tail::kBlend; }
    int threads = 0;
    bool fxaa = false;
    OutputRequest output;
    ReportOptions report;
};

/// One run. run() lists its stages.
class Flatten {
  public:
    Flatten(const FlattenOptions& options, Reporter& reporter)
        : options_(options), reporter_(reporter) {}

    void run() {
        {
            const StageTimer timer(result_.milliseconds, "total");
            checkOptions();
            open();
            limitLayers();
            composite();
        }
        report();
    }

  private:
    void checkOptions();
    void open();
    void limitLayers();
    void composite();
    void report();

    /// Reads the nearest `layers` layers (0 = all) from top to bottom, and hands each band to
    /// `take`.
    template <class Take>
    void forEachBand(const Stage& stage, std::uint32_t layers, Take&& take);

    const FlattenOptions& options_;
    Reporter& reporter_;
    std::unique_ptr<LayeredInput> reader_;
    Plan plan_;
    OutputOptions written_;
    PictureResult result_;
};

void Flatten::checkOptions() {
    options_.report.applyTo(reporter_);
    if (options_.blendsTail() && options_.max_layers == 0)
        throw Error(ErrorKind::kUsage, "there is nothing behind all layers", "--tail blend",
                    "add --layers N, or leave it out");
    checkOutput(options_.output, {options_.input});
    checkReport(options_.report, {options_.input, options_.output.path});
    setThreads(options_.threads);
}

void Flatten::open() {
    const StageTimer timer(result_.milliseconds, "load");
    const LayeredReadOptions reading = readingFor(options_.reading, {{options_.output.path}});
    reader_ = openChosen(options_.input.string(), reading, options_.objects, reporter_);
    plan_ = reader_->info().plan;
}

template <class Take>
void Flatten::forEachBand(const Stage& stage, std::uint32_t layers, Take&& take) {
    ProgressReport progress(reporter_, stage);
    cmd::forEachBand(*reader_, layers, result_.milliseconds, progress, take);
}

void Flatten::limitLayers() {
    const bool limited = options_.max_layers != 0 && options_.max_layers < plan_.layers.size();
    const bool known = reader_->info().is_peeler || plan_.fragments_stored != 0;
    if (!limited && known) return;
    // The header says how many fragments the picture shows, and comes before them: count first.
    if (limited) plan_.layers.resize(options_.max_layers);
    const std::uint64_t all = plan_.fragments_stored;
    plan_.fragments_stored = 0;
    forEachBand({"count", kCountEnd}, options_.max_layers,
                [&](const LayeredImage& band) { plan_.fragments_stored += band.fragments(); });
    if (options_.blendsTail()) plan_.fragments_blended = all - plan_.fragments_stored;
    if (!known) plan_.fragments_counted = plan_.fragments_stored;
}

void Flatten::composite() {
    Provenance provenance = reader_->info().provenance;
    provenance.version = PEELER_VERSION;
    OutputOptions output = options_.output.from(provenance);
    output.automatic_exposure = options_.output.leavesExposureOpen();
    // A hash made of the input's would not know of --layers and --fxaa.
    if (options_.max_layers == 0 && !options_.fxaa) {
        output.provenance.output_hash =
            outputHashFrom(reader_->info(), plan_.view, options_.output.path.string(), output);
    }
    auto writer = makeSink(options_.output.path.string(), output);
    if (options_.fxaa) writer = std::make_unique<FxaaFilter>(std::move(writer), output.background);
    writer->begin(plan_);
    CompositeImage flat;
    forEachBand("flatten", options_.blendsTail() ? 0 : options_.max_layers,
                [&](LayeredImage& band) {
                    if (options_.blendsTail()) {
                        compositeNearest(band, options_.max_layers, options_.tail, flat);
                        toSingleLayer(flat, band);
                    }
                    writer->write(std::move(band));
                });
    writer->finish();
    add(result_.milliseconds, writer->times());
    written_ = output;
}

void Flatten::report() {
    result_.inputs = {options_.input};
    result_.setFile(options_.output.path);
    describeDisplay(written_, written_.automatic_exposure, result_);
    describePicture(plan_, reader_->info().provenance, result_);
    noteDisplay(result_, reporter_);
    reportResult(options_.report, result_, reporter_);
}

}  // namespace

VerbAction declareFlatten(VerbOptions& verb) {
    const auto options = std::make_shared<FlattenOptions>();
    options->output.options.as = "composite";
    addFile(verb, "IN", "", options->input, "a layered or deep image (.exr, .safetensors)")
        .files(".exr .safetensors")
        .required();
    addLayeredOptions(verb, options->reading);
    addOutputOptions(verb, options->output);
    addObjectOptions(verb, options->objects);
    addFxaaOption(verb, options->fxaa, "quick, but render --samples sees more");
    addValue(
        verb, "--layers", "N|all", options->max_layers,
        [](const std::string& text) { return parseLayers(text); },
        "composite the N nearest layers of every pixel (default: all)")
        .group("Layers");
    addChoice<Tail>(verb, "--tail", options->tail, kTails, "choice of tail",
                    "what becomes of fragments behind the layers that are kept:")
        .group("Layers");
    addThreadsOption(verb, options->threads);
    addReportOptions(verb, options->report);
    return [options](Session& session) {
        Flatten(*options, session.reporter()).run();
        return 0;
    };
}

}  // namespace peeler::cmd
