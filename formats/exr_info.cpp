// SPDX-License-Identifier: Apache-2.0
#include "formats/exr_info.h"

#include <algorithm>
#include <charconv>
#include <string_view>

#include "core/error.h"
#include "formats/exr_header.h"

namespace peeler {
namespace {

constexpr std::string_view kLayerPrefix = "layer_";

/// The number in "layer_012"; −1 if the name is another.
int layerNumber(const std::string& name) {
    if (!name.starts_with(kLayerPrefix)) return -1;
    int number = -1;
    const char* end = name.data() + name.size();
    const auto [stop, failure] = std::from_chars(name.data() + kLayerPrefix.size(), end, number);
    return failure == std::errc() && stop == end ? number : -1;
}

template <class T>
T numberOf(const std::string& text) {
    T number{};
    std::from_chars(text.data(), text.data() + text.size(), number);
    return number;
}

double rationalOf(const std::string& text) {
    const auto slash = text.find('/');
    if (slash == std::string::npos) return 0;
    const auto below = numberOf<double>(text.substr(slash + 1));
    return below > 0 ? numberOf<double>(text.substr(0, slash)) / below : 0;
}

Provenance provenanceOf(const ExrInputPart& part) {
    Provenance p;
    p.version = part.attribute("peeler:version");
    p.method = part.attribute("peeler:method");
    p.surfaces = part.attribute("peeler:surfaces");
    p.scene = part.attribute("peeler:scene");
    p.scene_hash = part.attribute("peeler:sceneHash");
    p.settings_hash = part.attribute("peeler:settingsHash");
    p.renderer = part.attribute("peeler:renderer");
    p.frame = numberOf<int>(part.attribute("peeler:frame"));
    p.time = numberOf<double>(part.attribute("peeler:time"));
    p.frames_per_second = rationalOf(part.attribute("framesPerSecond"));
    return p;
}

/// Camera and windows. What the JSON says must agree with the windows, which are what pixels are
/// read by.
View viewOf(const ExrInfo& info, const std::string& path) {
    View view;
    const ExrInputPart& first = info.parts.front();
    const std::string json = first.attribute("peeler:cameraJson");
    if (!json.empty()) view = viewFromJson(json);
    const Window& display = first.display_window;
    if (display.x0 != 0 || display.y0 != 0 || display.empty()) {
        throw Error(ErrorKind::kInput, "the display window does not begin at (0, 0)", path);
    }
    if (!json.empty() && (view.width != display.width() || view.height != display.height())) {
        throw Error(ErrorKind::kInput, "peeler:cameraJson is of another picture size", path);
    }
    view.width = display.width();
    view.height = display.height();
    Window all;
    if (info.composite >= 0) all = info.parts[static_cast<std::size_t>(info.composite)].data_window;
    for (const std::size_t layer : info.layers)
        all = unite(all, info.parts[layer].data_window);
    if (info.composite < 0 && info.layers.empty()) all = first.data_window;
    // Without a composite part the crop is known from the JSON alone.
    const bool known = !json.empty() && intersect(view.crop, all) == all &&
                       intersect(view.crop, display) == view.crop;
    if (!known) view.crop = all;
    return view;
}

PixelType colorType(const ExrInfo& info) {
    for (const std::size_t layer : info.layers) {
        for (const char* name : {"R", "G", "B", "A"}) {
            const ExrInputChannel* channel = info.parts[layer].channel(name);
            if (channel && channel->type != PixelType::kHalf) return PixelType::kFloat;
        }
    }
    if (!info.layers.empty() || info.composite < 0) return PixelType::kHalf;
    const auto* red = info.parts[static_cast<std::size_t>(info.composite)].channel("R");
    return red ? red->type : PixelType::kHalf;
}

}  // namespace

ExrInfo describe(const ExrInput& input) {
    ExrInfo info;
    info.parts = input.parts();
    info.bytes = input.bytes();
    if (info.parts.empty()) throw Error(ErrorKind::kInput, "it has no parts", input.path());
    std::map<int, std::size_t> layers;
    for (std::size_t i = 0; i < info.parts.size(); ++i) {
        const int number = layerNumber(info.parts[i].name);
        if (number >= 0 && !layers.emplace(number, i).second) {
            throw Error(ErrorKind::kInput, "two parts are the same layer",
                        input.path() + ": " + info.parts[i].name);
        }
        if (info.parts[i].name == "composite" && info.composite < 0)
            info.composite = static_cast<int>(i);
    }
    for (const auto& [number, part] : layers)
        info.layers.push_back(part);

    const ExrInputPart& first = info.parts.front();
    info.is_peeler = !first.attribute("peeler:version").empty();
    info.provenance = provenanceOf(first);
    info.plan.view = viewOf(info, input.path());
    info.plan.color_type = colorType(info);
    info.plan.fragments_counted =
        numberOf<std::uint64_t>(first.attribute("peeler:fragmentsCounted"));
    info.plan.fragments_stored = numberOf<std::uint64_t>(first.attribute("peeler:fragmentsStored"));
    info.plan.fragments_blended =
        numberOf<std::uint64_t>(first.attribute("peeler:fragmentsBlended"));
    info.plan.samples = std::max(1, numberOf<int>(first.attribute("peeler:samples")));
    for (const std::size_t layer : info.layers) {
        info.plan.layers.push_back({info.parts[layer].data_window, 0});
    }
    return info;
}

ExrInfo readExrInfo(const std::string& path) {
    return describe(ExrInput(path));
}

}  // namespace peeler
