// SPDX-License-Identifier: Apache-2.0
#include "cmd/session/settings_text.h"

#include <peeler/channels.h>
#include "cmd/session/capture_choices.h"
#include "core/capture/method.h"
#include "formats/file/content_hash.h"
#include "formats/file/json_text.h"

namespace peeler::cmd {

namespace {

nlohmann::json clipJson(const ClipVolume& clip) {
    nlohmann::json planes = nlohmann::json::array();
    for (const auto& [normal, offset] : clip.half_spaces)
        planes.push_back({normal.x, normal.y, normal.z, offset});
    return {{"planes", planes}, {"nodes", clip.nodes}, {"inside", clip.keep_inside}};
}

}  // namespace

std::string settingsText(const ShownScene& shown, const CaptureSettings& capture,
                         const nlohmann::json& more) {
    // nlohmann::json makes the text canonical: it sorts keys and prints the fewest digits that
    // round-trip.
    nlohmann::json settings = {
        {"scene", shown.scene},
        {"layers", capture.max_layers},
        {"surfaces", nameOf<Surfaces>(kSurfaces, capture.surfaces)},
        {"faces", nameOf<Faces>(kFaces, capture.faces)},
        {"shading", nameOf<Shading>(kShading, capture.shading)},
        {"precision", nameOf<PixelType>(kPrecisions, capture.color_type)},
    };
    // These keys are added only if set, so that pictures without these settings keep their hashes.
    if (!shown.animations.empty()) settings["animations"] = shown.animations;
    if (!shown.include.empty()) settings["include"] = shown.include;
    if (!shown.exclude.empty()) settings["exclude"] = shown.exclude;
    if (shown.frames_per_second > 0) settings["framesPerSecond"] = shown.frames_per_second;
    if (capture.shadows) settings["shadows"] = capture.shadow_size;
    for (const Channel channel : capture.channels)
        settings["channels"].push_back(infoOf(channel).name);
    if (capture.samples > 1) settings["samples"] = capture.samples;
    if (capture.samples > 1 && capture.shade_per != ShadePer::kSample)
        settings["shadePer"] = nameOf<ShadePer>(kShadePer, capture.shade_per);
    if (capture.occlusion_ratio > 0) {
        const Window& crop = shown.crop;
        settings["occlusionRatio"] = {capture.occlusion_ratio, crop.x0, crop.y0, crop.x1, crop.y1};
    }
    if (capture.tail == Tail::kBlend) settings["tail"] = "blend";
    if (capture.clip.active()) settings["clip"] = clipJson(capture.clip);
    if (capture.opaque_only) settings["opaqueOnly"] = true;
    if (capture.tinted) settings["transmission"] = "color";
    if (capture.splat_dilation) settings["splatDilation"] = *capture.splat_dilation;
    if (const MethodInfo* method = findPeelMethod(capture.method); method && !method->exact())
        settings["method"] = capture.method;
    settings.update(more);
    return dumpJson(settings);
}

std::string settingsHash(const ShownScene& shown, const CaptureSettings& capture,
                         const nlohmann::json& more) {
    return hashText(settingsText(shown, capture, more));
}

}  // namespace peeler::cmd
