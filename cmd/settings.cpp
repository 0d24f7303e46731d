// SPDX-License-Identifier: Apache-2.0
// The canonical JSON behind peeler:settingsHash.
#include "cmd/settings.h"

#include <nlohmann/json.hpp>

#include "cmd/choices.h"
#include "cmd/report.h"
#include "core/peel/method.h"

namespace peeler::cmd {

namespace {

/// Infinity is no JSON number.
nlohmann::json number(double value) {
    return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json("inf");
}

nlohmann::json clipJson(const ClipVolume& clip) {
    nlohmann::json planes = nlohmann::json::array();
    for (const auto& [normal, offset] : clip.half_spaces)
        planes.push_back({normal.x, normal.y, normal.z, offset});
    return {{"planes", planes}, {"nodes", clip.nodes}, {"inside", clip.keep_inside}};
}

}  // namespace

std::string settingsHash(const ShownScene& shown, const View& view, const CaptureSettings& capture,
                         bool fxaa, const nlohmann::json& look) {
    const Projection& projection = view.projection;
    nlohmann::json matrix = nlohmann::json::array();
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 4; ++row)
            matrix.push_back(view.camera_to_world[column][row]);
    }
    // nlohmann::json sorts its keys and prints the shortest digits that read back: the text is
    // canonical.
    nlohmann::json settings = {
        {"scene", shown.scene},
        {"cameraToWorld", matrix},
        {"perspective", projection.perspective},
        {"halfWidth", projection.half_width},
        {"halfHeight", projection.half_height},
        {"near", number(projection.near)},
        {"far", number(projection.far)},
        {"size", {view.width, view.height}},
        {"crop", {view.crop.x0, view.crop.y0, view.crop.x1, view.crop.y1}},
        {"layers", capture.max_layers},
        {"surfaces", nameOf<Surfaces>(kSurfaces, capture.surfaces)},
        {"faces", nameOf<Faces>(kFaces, capture.faces)},
        {"shading", nameOf<Shading>(kShading, capture.shading)},
        {"precision", nameOf<PixelType>(kPrecisions, capture.color_type)},
    };
    // Only where they are on, so that a picture without them keeps its hash.
    if (!shown.animations.empty()) {
        settings["animations"] = shown.animations;
        settings["time"] = shown.time;
    }
    if (!shown.include.empty()) settings["include"] = shown.include;
    if (!shown.exclude.empty()) settings["exclude"] = shown.exclude;
    if (capture.shadows) settings["shadows"] = capture.shadow_size;
    for (const Channel channel : capture.channels)
        settings["channels"].push_back(infoOf(channel).name);
    if (capture.samples > 1) settings["samples"] = capture.samples;
    if (capture.occlusion_ratio > 0) settings["occlusionRatio"] = capture.occlusion_ratio;
    if (capture.tail == Tail::kBlend) settings["tail"] = "blend";
    if (capture.clip.active()) settings["clip"] = clipJson(capture.clip);
    if (capture.opaque_only) settings["opaqueOnly"] = true;
    if (const MethodInfo* method = findPeelMethod(capture.method); method && !method->exact())
        settings["method"] = capture.method;
    if (fxaa) settings["fxaa"] = true;
    settings.update(look);
    return hashText(settings.dump());
}

}  // namespace peeler::cmd
