// SPDX-License-Identifier: Apache-2.0
// Interpretation of headers: the parts with layers, composite or deep samples, and the metadata of
// the render.
#include "formats/exr/exr_files.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include <peeler/error.h>
#include "formats/exr/exr_header.h"
#include "formats/exr/exr_layout.h"
#include "formats/file/file_name.h"

namespace peeler {
namespace {

double rationalOf(const std::string& text) {
    const auto slash = text.find('/');
    if (slash == std::string::npos) return 0;
    const auto below = numberIn<double>(text.substr(slash + 1));
    return below > 0 ? numberIn<double>(text.substr(0, slash)) / below : 0;
}

Provenance provenanceOf(const ExrInputPart& part) {
    Provenance p;
    p.version = part.attribute("peeler:version");
    p.method = part.attribute("peeler:method");
    p.surfaces = part.attribute("peeler:surfaces");
    p.scene = part.attribute("peeler:scene");
    p.scene_hash = part.attribute("peeler:sceneHash");
    p.settings_hash = part.attribute("peeler:settingsHash");
    p.settings = part.attribute("peeler:settings");
    p.renderer = part.attribute("peeler:renderer");
    p.deep_merge = part.attribute("peeler:deepMerge");
    p.tile = part.attribute("peeler:tile");
    p.elements = part.attribute("peeler:elements");
    p.frame = numberIn<int>(part.attribute("peeler:frame"));
    if (const std::string view = part.attribute("peeler:view"); !view.empty())
        p.view = numberIn<int>(view);
    p.time = numberIn<double>(part.attribute("peeler:time"));
    p.frames_per_second = rationalOf(part.attribute("framesPerSecond"));
    return p;
}

/// Returns the view: the camera, and the windows that decide how pixels are read. Throws Error
/// (kInput) if the camera's JSON has another picture size. Ignores the crop in the JSON if the
/// windows contradict it.
View viewOf(const ExrInfo& info, const std::string& path) {
    View view;
    const ExrInputPart& first = info.parts.front();
    const std::string camera = first.attribute("peeler:cameraJson");
    if (!camera.empty()) view = viewFromJson(camera);
    const Window& display = first.display_window;
    if (display.empty()) throw Error(ErrorKind::kInput, "the display window is empty", path);
    if (!camera.empty() && (view.width != display.width() || view.height != display.height())) {
        throw Error(ErrorKind::kInput, "peeler:cameraJson gives a different picture size", path);
    }
    view.width = display.width();
    view.height = display.height();
    view.known = !camera.empty();
    Window all;
    if (info.composite >= 0) all = info.parts[static_cast<std::size_t>(info.composite)].data_window;
    for (const std::size_t layer : info.layers)
        all = unite(all, info.parts[layer].data_window);
    for (const std::size_t part : info.deep)
        all = unite(all, info.parts[part].data_window);
    if (all.empty()) all = first.data_window;
    // Without a composite part, only the camera's JSON stores the crop.
    const bool known = !camera.empty() && intersect(view.crop, all) == all &&
                       intersect(view.crop, display) == view.crop;
    if (!known) view.crop = unite(display, all);
    return view;
}

bool isFloat(const ExrInputPart& part, const std::string& prefix) {
    for (const std::string& name : colorNames(hasTint(part, prefix))) {
        const ExrInputChannel* channel = part.channel(prefix + name);
        if (channel && channel->type != PixelType::kHalf) return true;
    }
    return false;
}

/// Calls visit(part, prefix) for every layer, for the first deep part, and for the composite if
/// there are no layers.
template <class Visit>
void forEachColors(const ExrInfo& info, Visit&& visit) {
    for (std::size_t i = 0; i < info.layers.size(); ++i)
        visit(info.parts[info.layers[i]], info.prefixes[i]);
    if (!info.deep.empty()) visit(info.parts[info.deep.front()], std::string());
    if (info.layers.empty() && info.composite >= 0)
        visit(info.parts[static_cast<std::size_t>(info.composite)], std::string());
}

/// Sets the plan's colour type, and `tinted` if all parts have coloured opacity.
void findColors(const ExrInfo& info, Plan& plan) {
    bool floats = false, any = false, all_tinted = true;
    forEachColors(info, [&](const ExrInputPart& part, const std::string& prefix) {
        any = true;
        floats = floats || isFloat(part, prefix);
        all_tinted = all_tinted && hasTint(part, prefix);
    });
    plan.color_type = floats ? PixelType::kFloat : PixelType::kHalf;
    plan.tinted = any && all_tinted;
}

/// The part that holds a layer, and the prefix of the layer's channel names in it.
struct Place {
    std::size_t part = 0;
    std::string prefix;
};
using Layers = std::map<int, Place>;

void addLayer(int number, const Place& place, const std::string& where, Layers& layers) {
    if (layers.emplace(number, place).second) return;
    throw Error(ErrorKind::kInput, "two parts are the same layer", where);
}

/// Finds the layers: the parts named after layers (layouts plain, nuke, per-file) or, without such
/// parts, the channels named after layers in the first part that has some (single-part).
Layers findLayers(const std::vector<ExrInputPart>& parts, const std::string& path) {
    Layers layers;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const std::string& name = parts[i].name;
        const int number = name.find('.') == std::string::npos ? layerNumber(name) : -1;
        if (number < 0) continue;
        const bool prefixed = parts[i].channel(name + ".Z") != nullptr;
        addLayer(number, {i, prefixed ? name + "." : ""},
                 std::string(path).append(": ").append(name), layers);
    }
    for (std::size_t i = 0; i < parts.size() && layers.empty(); ++i) {
        for (const ExrInputChannel& channel : parts[i].channels) {
            const int number = layerNumber(channel.name);
            const std::size_t dot = channel.name.find('.');
            // If layer_000 has no channel Z, the file is from another program, and layer_000
            // contains only colours.
            const bool depth = dot != std::string::npos && channel.name.substr(dot) == ".Z";
            if (number < 0 || !depth || parts[i].deep()) continue;
            layers.try_emplace(number, Place{i, channel.name.substr(0, dot + 1)});
        }
    }
    return layers;
}

/// Returns the index of the composite's part: the part with the composite's name, or the part that
/// also holds the layers. Returns −1 if there is no composite.
int findComposite(const ExrInfo& info) {
    const std::vector<ExrInputPart>& parts = info.parts;
    const std::string layout = parts.front().attribute("peeler:layout");
    for (std::size_t i = 0; i < parts.size(); ++i) {
        for (const ExrLayout& row : exrLayouts()) {
            const bool named = parts[i].name == row.composite_part;
            const bool plain = row.composite_part == exrLayouts().front().composite_part;
            if (named && (plain || layout == row.name)) return static_cast<int>(i);
        }
    }
    if (info.layers.empty() || info.prefixes.front().empty()) return -1;
    const std::size_t part = info.layers.front();
    return parts[part].channel("R") && parts[part].channel("Z") ? static_cast<int>(part) : -1;
}

const std::string& imagePath(const std::string& path) {
    if (fileKind(path) != FileKind::kGltf) return path;
    throw Error(ErrorKind::kInput, "the file is a scene, not an image", path,
                "render it first: " + Parameter::kRenderer);
}

}  // namespace

bool hasTint(const ExrInputPart& part, const std::string& prefix) {
    return std::ranges::all_of(colorNames(true), [&](const std::string& name) {
        const ExrInputChannel* channel = part.channel(prefix + name);
        return channel && channel->type != PixelType::kUint;
    });
}

ExrInfo describe(std::vector<ExrInputPart> parts, std::uint64_t bytes, const std::string& path) {
    ExrInfo info;
    info.parts = std::move(parts);
    info.bytes = bytes;
    if (info.parts.empty()) throw Error(ErrorKind::kInput, "the file has no parts", path);
    for (auto& [number, place] : findLayers(info.parts, path)) {
        info.layers.push_back(place.part);
        info.prefixes.push_back(place.prefix);
    }
    info.composite = findComposite(info);
    for (std::size_t i = 0; i < info.parts.size() && info.layers.empty(); ++i) {
        if (info.parts[i].deep()) info.deep.push_back(i);
    }

    const ExrInputPart& first = info.parts.front();
    info.is_peeler = !first.attribute("peeler:version").empty();
    info.provenance = provenanceOf(first);
    for (const ExrInputPart& part : info.parts) {
        if (part.id_manifest.empty() || !info.provenance.ids.empty()) continue;
        info.provenance.ids = idNamesFromManifest(part.id_manifest);
    }
    if (info.composite >= 0) {
        const ExrInputPart& part = info.parts[static_cast<std::size_t>(info.composite)];
        info.has_cryptomatte = part.channel("CryptoObject00.R") != nullptr;
    }
    info.plan.view = viewOf(info, path);
    findColors(info, info.plan);
    info.plan.fragments_counted =
        numberIn<std::uint64_t>(first.attribute("peeler:fragmentsCounted"));
    info.plan.fragments_stored = numberIn<std::uint64_t>(first.attribute("peeler:fragmentsStored"));
    info.plan.fragments_blended =
        numberIn<std::uint64_t>(first.attribute("peeler:fragmentsBlended"));
    info.plan.samples = std::max(1, numberIn<int>(first.attribute("peeler:samples")));
    for (const std::size_t layer : info.layers) {
        info.plan.layers.push_back({info.parts[layer].data_window, 0});
    }
    return info;
}

std::size_t ExrInfo::layersOfComposite() const {
    return std::min<std::size_t>(numberIn<std::size_t>(parts.front().attribute("peeler:layers")),
                                 kMostLayers);
}

OpenedExr::OpenedExr(const std::string& path, const LayeredReadOptions& read)
    : options(read),
      files(imagePath(path)),
      info(describe(files.parts(), files.bytes(), path)),
      warnings(read.strict, path) {}

ExrInfo readExrInfo(const std::string& path) {
    return OpenedExr(path).info;
}

}  // namespace peeler
