// SPDX-License-Identifier: Apache-2.0
#include "cmd/masks/mask_pictures.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"
#include "cmd/cli/parse.h"
#include "core/base/stage_times.h"
#include "formats/output_hash.h"
#include "formats/writers.h"

namespace peeler::cmd {

namespace {

constexpr const char* kPictureName = "rgb.png";
constexpr const char* kPictureOptions[] = {
    "--background",           "--exposure", "--tone-map",   "--samples", "--environment",
    "--environment-rotation", "--shadows",  "--shadow-size"};

}  // namespace

void addMaskPictureOptions(VerbOptions& verb, MaskPictureOptions& options, CaptureJobOptions& job) {
    options.output.path = kPictureName;
    verb.addFlag(
            "--rgb", options.asked,
            "also write the picture of each view as peeler render does, to rgb/NNNNNN.png, the "
            "file_name in coco.json")
        .group("Output");
    addDisplayOptions(verb, options.output);
    verb.option("--background")
        .description(
            "background of --rgb: transparent, a basic colour of CSS such as white, #rrggbb[aa] or "
            "#rgb[a] in sRGB, or r,g,b[,a] in linear light (default: transparent)");
    addValue(
        verb, "--samples", "N", options.samples,
        [](const std::string& text) { return static_cast<int>(parseInteger(text, 1, 256)); },
        "antialiasing samples per pixel of --rgb; masks always have one (default: " +
            std::to_string(kDisplaySamples) + ")")
        .group("Output");
    addLightOptions(verb, job.capture, options.shadow_size);
    addEnvironmentOptions(verb, job.appearance);
}

void checkMaskPictureOptions(const VerbOptions& verb, const MaskPictureOptions& options) {
    if (options.asked) return;
    for (const char* const option : kPictureOptions)
        if (verb.given(option)) refuse("masks have no colours", option, "add --rgb");
}

MaskPictures::MaskPictures(const MaskPictureOptions& options, const CaptureSettings& capture,
                           CaptureJob& job, const ViewList& views)
    : options_(options), capture_(capture), job_(job), views_(views) {
    capture_.samples = options.samples;
    capture_.composite = true;
}

CaptureSettings MaskPictures::settings(const ClipVolume& clip) const {
    CaptureSettings settings = capture_;
    settings.clip = clip;
    return settings;
}

bool MaskPictures::metersExposure(const PosedScene& posed) const {
    return options_.output.leavesExposureOpen() && !posed.lights().empty();
}

std::string MaskPictures::hash(const View& view, const ClipVolume& clip, nlohmann::json more,
                               Provenance provenance) const {
    provenance.settings_hash = job_.settingsHash(settings(clip), std::move(more), view.crop);
    OutputOptions output = options_.output.from(provenance);
    output.automatic_exposure = options_.output.leavesExposureOpen();
    return outputHash(view, kPictureName, output);
}

void MaskPictures::write(const View& view, const PosedScene& posed, const ClipVolume& clip,
                         const Provenance& provenance, const std::filesystem::path& path,
                         PictureResult& result) {
    // Masks through lenses need no renderer.
    GlRenderer& renderer = job_.openRenderer(posed);
    CaptureSettings settings = this->settings(clip);
    settings.tinted = job_.wantsTint(posed);
    OutputOptions output = options_.output.from(provenance);
    if (metersExposure(posed)) {
        if (!exposure_) exposure_ = job_.meterExposure(settings, views_.cameras());
        renderer.setPose(posed);
        output.exposure = *exposure_;
    }
    CapturePlan plan = renderer.plan(view, settings);
    const auto sink = makeSink(path.string(), output);
    sink->begin(plan);
    renderer.capture(plan, *sink);
    sink->finish();
    add(job_.times(), sink->times());
    describeDisplay(output, exposure_.has_value(), result);
}

}  // namespace peeler::cmd
