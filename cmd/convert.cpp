// SPDX-License-Identifier: Apache-2.0
// peeler convert: lossless conversion of layered files, band by band.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/options/layered_options.h"
#include "cmd/options/layered_run.h"
#include "cmd/options/output_options.h"
#include "cmd/session/session.h"
#include "cmd/verbs.h"
#include "core/image/layers.h"
#include "formats/exr/deep_certificate.h"
#include "formats/exr/layered_input.h"
#include "formats/output_hash.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct ConvertOptions : LayeredRunOptions {
    fs::path input;
    bool cryptomatte = false;
};

/// Throws Error (kUsage) if the output format stores no layers or, with --cryptomatte, no
/// composite.
void checkHoldsLayers(const ConvertOptions& options) {
    const std::string path = options.output.path.string();
    const OutputFormat& format = findOutputFormat(path, options.output.options.as);
    constexpr OutputContent kArrays[] = {OutputContent::kArrays, OutputContent::kPlanes,
                                         OutputContent::kXray};
    if (std::ranges::find(kArrays, format.content) != std::end(kArrays)) {
        throw Error(ErrorKind::kUsage, "convert writes layers only", path,
                    "write arrays with peeler extract --npz");
    }
    if (format.holds(OutputContent::kComposite) || format.holds(OutputContent::kShadowMap)) {
        throw Error(ErrorKind::kUsage, "convert writes layers only", path,
                    "use --as ldi, deep or layers, or write a composite with peeler flatten");
    }
    if (options.cryptomatte &&
        (!format.takesCryptomatte() || options.output.options.no_composite)) {
        throw Error(ErrorKind::kUsage, "Cryptomatte needs a composite, which this output lacks",
                    "--cryptomatte", "leave it out, or write --as ldi with its composite");
    }
}

/// Warns if the output lacks the input's Cryptomatte. With --strict, throws Error (kInput) instead.
void warnOfCryptomatte(const ConvertOptions& options, const ExrInfo& info, const LayeredRun& run,
                       Reporter& reporter) {
    if (!info.has_cryptomatte || options.cryptomatte || keepsCryptomatte(info, run.output)) return;
    const std::string what = "The output lacks the Cryptomatte of the input";
    if (options.reading.strict)
        throw Error(ErrorKind::kInput, what, options.input.string(),
                    "add --cryptomatte, or leave --strict out");
    reporter.warning(what + "; --cryptomatte keeps it.");
}

/// Counts the fragments of every layer, because the output's header contains the window of each
/// layer. Skips deep input, whose counts are exact. In the headers of other input, windows may be
/// larger than their layers.
void countLayers(LayeredInput& input, LayeredRun& run) {
    if (!input.info().deep.empty()) return;
    DepthComplexity complexity(run.plan.view.crop);
    run.forEachBand({"count", kCountEnd}, input, 0,
                    [&](const LayeredImage& band) { complexity.addBand(band); });
    run.plan.layers = complexity.layers();
    run.plan.fragments_stored = complexity.counted();
    if (!input.info().is_peeler) run.plan.fragments_counted = run.plan.fragments_stored;
}

void convert(const ConvertOptions& options, Reporter& reporter) {
    LayeredRun run(options, {options.input}, reporter);
    checkHoldsLayers(options);
    run.output.options.cryptomatte = options.cryptomatte;
    run.checkFiles();
    const auto input = run.openInput(ObjectOptions());
    const ExrInfo& info = input->info();
    if (options.cryptomatte && info.provenance.ids.empty())
        throw Error(ErrorKind::kUsage, "the file does not name its ids", "--cryptomatte",
                    "render it with --channels id");
    warnOfCryptomatte(options, info, run, reporter);
    countLayers(*input, run);

    const std::string path = run.output.path.string();
    Provenance provenance = info.provenance;
    if (provenance.version.empty()) provenance.version = PEELER_VERSION;
    OutputOptions output = run.output.from(provenance);
    output.cryptomatte = options.cryptomatte || keepsCryptomatte(info, run.output);
    const auto certificate = info.attributes().find(kDeepCertificate);
    if (certificate != info.attributes().end() &&
        findOutputFormat(path, output.as).holdsFragments())
        output.provenance.deep_certificate = certificate->second;
    output.provenance.output_hash = outputHashFrom(info, run.plan.view, path, output);
    const auto sink = makeSink(path, output);
    run.write(*sink, [&] {
        run.forEachBand("convert", *input, 0,
                        [&](LayeredImage& band) { sink->write(std::move(band)); });
    });
    run.report(output, info.provenance);
}

constexpr const char* kConvertFooter =
    "Layered files (--as ldi, in any --layout) and deep images contain the same fragments, so\n"
    "conversion in both directions is lossless. Converting a file there and back with the\n"
    "same options reproduces it byte for byte. A deep image has no composite, so its\n"
    "Cryptomatte is in a file of its own, OUT.cryptomatte.exr. Deep images of other programs\n"
    "are read too; their samples are sorted by depth first.";

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
            "write Cryptomatte 1.4 (objects and materials) into the composite part or, for a deep "
            "image, into OUT.cryptomatte.exr, from the ids of the input (default: on if the "
            "input has it and the output has a composite)")
        .group("Output");
    addThreadsOption(verb, options->threads);
    addReportOptions(verb, options->report);
    verb.footer(kConvertFooter);
    return [options](Session& session) {
        convert(*options, session.reporter());
        return 0;
    };
}

}  // namespace peeler::cmd
