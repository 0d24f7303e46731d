// SPDX-License-Identifier: Apache-2.0
// peeler holdout: removes the parts of a layered file that a matte hides, band by band.
#include "core/image/holdout.h"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <peeler/error.h>
#include <nlohmann/json.hpp>
#include "cmd/cli/arguments.h"
#include "cmd/holdout/matte.h"
#include "cmd/options/filtered_input.h"
#include "cmd/options/layered_options.h"
#include "cmd/options/layered_run.h"
#include "cmd/options/object_options.h"
#include "cmd/options/output_options.h"
#include "cmd/session/session.h"
#include "cmd/verbs.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct HoldoutOptions : LayeredRunOptions {
    fs::path input;
    std::optional<fs::path> by;
    ObjectOptions objects;
    SameDepth same_depth = SameDepth::kBehind;
    CaptureJobOptions matte;  ///< if `by` is a scene
};

constexpr Choice<SameDepth> kSameDepths[] = {
    {"behind", SameDepth::kBehind, "the matte is behind, and hides nothing"},
    {"in-front", SameDepth::kInFront,
     "the matte is in front; for one of two elements that hold each other out"},
};

void checkHoldout(const HoldoutOptions& options) {
    if (!options.by && !options.objects.any())
        throw Error(
            ErrorKind::kUsage, "no matte is given", "--by",
            "give a layered file or a scene as the matte; or give --include with the objects "
            "to keep, so that the other objects of the file are the matte");
}

/// Returns the filter that selects and holds out the fragments of a picture.
FilteredInput::Filter filterOf(const HoldoutOptions& options, const ExrInfo& picture,
                               Session& session) {
    ObjectSelection selection;
    if (options.objects.any() && !picture.plan.layers.empty())  // an empty picture has no objects
        selection = selectionOf(options.objects, picture, options.input.string());
    if (!options.by) return [selection](LayeredImage& band) { holdOutSelected(band, selection); };
    CaptureJobOptions matte = options.matte;
    matte.scene.file = *options.by;
    matte.scene.reading.strict = options.reading.strict;
    const auto by = std::make_shared<Matte>(matte, picture, options.reading, session);
    return [by, selection, at = options.same_depth](LayeredImage& band) {
        keepObjects(band, selection);
        holdOut(band, by->read(band.window), at);
    };
}

bool isVolume(const ExrInfo& picture) {
    for (const std::size_t part : picture.deep)
        for (const ExrInputChannel& channel : picture.parts[part].channels)
            if (channel.name == "ZBack") return true;
    return false;
}

std::unique_ptr<LayeredInput> openHeldOut(const HoldoutOptions& options,
                                          const LayeredReadOptions& reading, Session& session) {
    Reporter& reporter = session.reporter();
    auto input = openInput(options.input.string(), reading, reporter);
    if (isVolume(input->info()))
        reporter.warning("Samples with ZBack are held out as points at their Z.");
    FilteredInput::Filter filter = filterOf(options, input->info(), session);
    auto held_out = std::make_unique<FilteredInput>(std::move(input), std::move(filter));
    Provenance& provenance = held_out->provenance();
    if (!options.by) {
        recordSetting("heldOut", toJson(options.objects), provenance);
        return held_out;
    }
    if (options.objects.any()) recordSetting("selected", toJson(options.objects), provenance);
    recordSetting("heldOut",
                  {{"by", options.by->filename().string()},
                   {"inFront", options.same_depth == SameDepth::kInFront}},
                  provenance);
    return held_out;
}

void holdout(const HoldoutOptions& options, Session& session) {
    std::vector<fs::path> inputs{options.input};
    if (options.by) inputs.push_back(*options.by);
    LayeredRun run(options, inputs, session.reporter());
    checkHoldout(options);
    run.checkFiles();
    const auto input = run.open(
        [&](const LayeredReadOptions& reading) { return openHeldOut(options, reading, session); });
    const ExrInfo& info = input->info();
    run.plan = info.plan;
    std::string& as = run.output.options.as;
    const std::string path = run.output.path.string();
    if (as.empty() && !info.deep.empty() &&
        findOutputFormat(path, "").holds(OutputContent::kLayers))
        as = "deep";
    checkFormat(run.output);
    const OutputOptions output = run.outputOptions(info.provenance);
    const auto sink = makeSink(path, output);
    run.write(*sink, [&] {
        run.forEachBand("holdout", *input, 0,
                        [&](LayeredImage& band) { sink->write(std::move(band)); });
    });
    run.report(output, info.provenance);
}

}  // namespace

VerbAction declareHoldout(VerbOptions& verb) {
    const auto options = std::make_shared<HoldoutOptions>();
    addFile(verb, "IN", "", options->input, "a layered or deep image (.exr, .safetensors)")
        .files(".exr .safetensors")
        .required();
    constexpr const char* kGroup = "Matte";
    addFile(verb, "--by", "MATTE", options->by,
            "a layered or deep image that holds IN out, or a scene, which is rendered with the "
            "camera and at the time of IN (default: the objects of IN that are not kept)")
        .files(".exr " + sceneExtensions())
        .group(kGroup);
    addChoice<SameDepth>(verb, "--same-depth", options->same_depth, kSameDepths,
                         "place of the matte", "fragments of the matte at exactly the same depth:")
        .group(kGroup);
    addLayeredOptions(verb, options->reading);
    addOutputOptions(verb, options->output);
    addLayerOutputOptions(verb, options->output);
    addObjectOptions(verb, options->objects);
    addMachineOptions(verb, options->matte.device, options->threads, options->matte.capture,
                      "a scene is rendered in bands that fit");
    addReportOptions(verb, options->report);
    verb.footer(
        "Every fragment is weakened by the matte in front of it, also where the matte is\n"
        "partly transparent. Composites of elements that hold each other out add up to the\n"
        "composite of all: hold A out by B, and B out by A with --same-depth in-front.");
    return [options](Session& session) {
        options->matte.threads = options->threads;
        options->matte.report = options->report;
        holdout(*options, session);
        return 0;
    };
}

}  // namespace peeler::cmd
