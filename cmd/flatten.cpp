// SPDX-License-Identifier: Apache-2.0
// peeler flatten: composites the layers of a file on the CPU, band by band.
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/parse.h"
#include "cmd/options/layered_options.h"
#include "cmd/options/layered_run.h"
#include "cmd/options/object_options.h"
#include "cmd/options/output_options.h"
#include "cmd/session/capture_choices.h"
#include "cmd/session/session.h"
#include "cmd/verbs.h"
#include "core/image/composite.h"
#include "core/image/fxaa.h"
#include "formats/exr/layered_input.h"
#include "formats/output_hash.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct FlattenOptions : LayeredRunOptions {
    fs::path input;
    ObjectOptions objects;
    std::uint32_t max_layers = 0;  ///< layers to composite, nearest first; 0 = all
    Tail tail = Tail::kDrop;       ///< for the layers behind max_layers
    bool fxaa = false;

    bool blendsTail() const { return tail == Tail::kBlend; }
};

/// Limits the plan to the kept layers. Counts the kept fragments for the output's header, unless
/// the input's header has the count.
void limitLayers(const FlattenOptions& options, LayeredInput& input, LayeredRun& run) {
    Plan& plan = run.plan;
    const bool limited = options.max_layers != 0 && options.max_layers < plan.layers.size();
    const bool known = input.info().is_peeler || plan.fragments_stored != 0;
    if (!limited && known) return;
    if (limited) plan.layers.resize(options.max_layers);
    const std::uint64_t all = plan.fragments_stored;
    plan.fragments_stored = 0;
    run.forEachBand({"count", kCountEnd}, input, options.max_layers,
                    [&](const LayeredImage& band) { plan.fragments_stored += band.fragments(); });
    if (options.blendsTail()) plan.fragments_blended = all - plan.fragments_stored;
    if (!known) plan.fragments_counted = plan.fragments_stored;
}

void flatten(const FlattenOptions& options, Reporter& reporter) {
    LayeredRun run(options, {options.input}, reporter);
    if (options.blendsTail() && options.max_layers == 0)
        throw Error(ErrorKind::kUsage, "a tail needs a layer limit", "--tail blend",
                    "add --layers N, or leave --tail out");
    run.checkFiles();
    const auto input = run.openInput(options.objects);
    limitLayers(options, *input, run);

    const std::string path = run.output.path.string();
    OutputOptions output = run.outputOptions(input->info().provenance);
    // An output hash made from the input's hash would not cover --layers and --fxaa.
    if (options.max_layers == 0 && !options.fxaa)
        output.provenance.output_hash = outputHashFrom(input->info(), run.plan.view, path, output);
    auto sink = makeSink(path, output);
    if (options.fxaa) sink = std::make_unique<FxaaFilter>(std::move(sink), output.background);
    run.write(*sink, [&] {
        CompositeImage flat;
        const std::uint32_t layers = options.blendsTail() ? 0 : options.max_layers;
        run.forEachBand("flatten", *input, layers, [&](LayeredImage& band) {
            if (options.blendsTail()) {
                compositeNearest(band, options.max_layers, options.tail, flat);
                toSingleLayer(flat, band);
            }
            sink->write(std::move(band));
        });
    });
    run.report(output, input->info().provenance);
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
    addFxaaOption(verb, options->fxaa, "fast, but less accurate than peeler render --samples");
    addValue(
        verb, "--layers", "N|all", options->max_layers,
        [](const std::string& text) { return parseLayers(text); },
        "composite only the N nearest layers of every pixel (default: all)")
        .group("Layers");
    addChoice<Tail>(verb, "--tail", options->tail, kTails, "choice of tail",
                    "treatment of fragments behind the kept layers:")
        .group("Layers");
    addThreadsOption(verb, options->threads);
    addReportOptions(verb, options->report);
    return [options](Session& session) {
        flatten(*options, session.reporter());
        return 0;
    };
}

}  // namespace peeler::cmd
