// SPDX-License-Identifier: Apache-2.0
// peeler convert: the layers of a file in another form, band by band, nothing lost.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <utility>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/report.h"
#include "cmd/machine/resources.h"
#include "cmd/options/layered_bands.h"
#include "cmd/options/layered_options.h"
#include "cmd/options/output_checks.h"
#include "cmd/options/output_options.h"
#include "cmd/session/progress_report.h"
#include "cmd/session/session.h"
#include "cmd/verbs.h"
#include "core/base/stage_times.h"
#include "core/image/layers.h"
#include "formats/exr/layered_input.h"
#include "formats/output_hash.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct ConvertOptions {
    fs::path input;
    LayeredReadOptions reading;
    bool cryptomatte = false;
    int threads = 0;
    OutputRequest output;
    ReportOptions report;
};

/// One run. run() lists its stages.
class Convert {
  public:
    Convert(const ConvertOptions& options, Reporter& reporter)
        : options_(options), reporter_(reporter) {}

    void run() {
        {
            const StageTimer timer(result_.milliseconds, "total");
            checkOptions();
            open();
            count();
            write();
        }
        report();
    }

  private:
    void checkOptions();
    void open();
    void count();
    void write();
    void report();

    template <class Take>
    void forEachBand(const Stage& stage, Take&& take);

    const ConvertOptions& options_;
    Reporter& reporter_;
    std::unique_ptr<LayeredInput> reader_;
    Plan plan_;
    PictureResult result_;
};

void Convert::checkOptions() {
    options_.report.applyTo(reporter_);
    const OutputFormat& format =
        findOutputFormat(options_.output.path.string(), options_.output.options.as);
    constexpr OutputContent kArrays[] = {OutputContent::kArrays, OutputContent::kPlanes,
                                         OutputContent::kXray};
    if (std::ranges::find(kArrays, format.content) != std::end(kArrays)) {
        throw Error(ErrorKind::kUsage, "convert writes layers", options_.output.path.string(),
                    "peeler extract --npz writes arrays");
    }
    if (format.holds(OutputContent::kComposite) || format.holds(OutputContent::kShadowMap)) {
        throw Error(ErrorKind::kUsage, "convert writes layers", options_.output.path.string(),
                    "use --as ldi, deep or layers; peeler flatten makes composites");
    }
    if (options_.cryptomatte &&
        (!format.channels || !format.hasComposite() || options_.output.options.no_composite)) {
        throw Error(ErrorKind::kUsage, "Cryptomatte belongs to a composite, and there is none",
                    "--cryptomatte", "leave it out, or write --as ldi with its composite");
    }
    checkOutput(options_.output, {options_.input});
    checkReport(options_.report, {options_.input, options_.output.path});
    setThreads(options_.threads);
}

void Convert::open() {
    const StageTimer timer(result_.milliseconds, "load");
    const LayeredReadOptions reading = readingFor(options_.reading, {{options_.output.path}});
    reader_ = openInput(options_.input.string(), reading, reporter_);
    plan_ = reader_->info().plan;
    if (options_.cryptomatte && reader_->info().provenance.ids.empty())
        throw Error(ErrorKind::kUsage, "there are no names of ids in it", "--cryptomatte",
                    "render it with --channels id");
}

template <class Take>
void Convert::forEachBand(const Stage& stage, Take&& take) {
    ProgressReport progress(reporter_, stage);
    cmd::forEachBand(*reader_, 0, result_.milliseconds, progress, take);
}

/// Counts the fragments of every layer: the output's header comes before its pixels and says where
/// each layer lies. Deep input comes with its counts; of other input the header promises windows
/// that may be wider than what they hold.
void Convert::count() {
    if (!reader_->info().deep.empty()) return;
    DepthComplexity complexity(plan_.view.crop);
    forEachBand({"count", kCountEnd}, [&](const LayeredImage& band) { complexity.addBand(band); });
    plan_.layers = complexity.layers();
    plan_.fragments_stored = complexity.counted();
    if (!reader_->info().is_peeler) plan_.fragments_counted = plan_.fragments_stored;
}

void Convert::write() {
    Provenance provenance = reader_->info().provenance;
    if (provenance.version.empty()) provenance.version = PEELER_VERSION;
    OutputOptions output = options_.output.from(provenance);
    output.cryptomatte = options_.cryptomatte || keepsCryptomatte(reader_->info(), options_.output);
    output.provenance.output_hash =
        outputHashFrom(reader_->info(), plan_.view, options_.output.path.string(), output);
    const auto writer = makeSink(options_.output.path.string(), output);
    writer->begin(plan_);
    forEachBand("convert", [&](LayeredImage& band) { writer->write(std::move(band)); });
    writer->finish();
    add(result_.milliseconds, writer->times());
}

void Convert::report() {
    result_.inputs = {options_.input};
    result_.output = options_.output.path;
    describePicture(plan_, reader_->info().provenance, result_);
    describeFiles(options_.output, result_, reporter_);
    reportResult(options_.report, result_, reporter_);
}

constexpr const char* kConvertFooter =
    "Layered files (--as ldi, in any --layout) and deep images hold the same fragments: from one\n"
    "to the other and back nothing is lost, and the file is the same byte for byte if it was\n"
    "written with the same options. A deep image has no composite, and so no Cryptomatte. Deep\n"
    "images of other programs are read too; samples are sorted by depth first.";

}  // namespace

VerbAction declareConvert(VerbOptions& verb) {
    const auto options = std::make_shared<ConvertOptions>();
    addFile(verb, "IN", "", options->input, "a layered or deep image (.exr, .safetensors)")
        .files(".exr .safetensors")
        .required();
    addLayeredOptions(verb, options->reading);
    addOutputFile(verb, options->output, true);
    addLayerOutputOptions(verb, options->output, true);
    verb.addFlag(
            "--cryptomatte", options->cryptomatte,
            "Cryptomatte 1.4 (objects and materials) in the composite part, from the ids of the "
            "input (default: if the input has it)")
        .group("Output");
    addThreadsOption(verb, options->threads);
    addReportOptions(verb, options->report);
    verb.footer(kConvertFooter);
    return [options](Session& session) {
        Convert(*options, session.reporter()).run();
        return 0;
    };
}

}  // namespace peeler::cmd
