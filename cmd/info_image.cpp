// SPDX-License-Identifier: Apache-2.0
// peeler info on an OpenEXR image.
#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <vector>

#include "cmd/info_kinds.h"
#include "cmd/report.h"
#include "formats/exr_layout.h"
#include "formats/layered_input.h"

namespace peeler::cmd {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kPixelTypes[] = {"half", "float", "uint"};
constexpr std::uint64_t kBandBytes = std::uint64_t{256} << 20;

/// What the headers say, and what reading the layers found.
struct ImageFacts {
    ExrInfo info;
    bool layered = false;
    std::vector<std::uint64_t> layer_pixels;
    std::uint64_t fragments = 0;

    bool countsKnown() const { return info.attributes().contains("peeler:fragmentsStored"); }
    bool agrees() const {
        return !layered || !countsKnown() || fragments == info.plan.fragments_stored;
    }
};

/// Reads every layer: a file that is damaged says so here, and not in the middle of somebody's
/// work.
void readLayers(const std::string& path, ImageFacts& facts) {
    const std::unique_ptr<LayeredInput> reader = openLayered(path);
    const Window crop = reader->info().plan.view.crop;
    facts.info.plan.layers = reader->info().plan.layers;
    facts.layer_pixels.assign(facts.info.plan.layers.size(), 0);
    LayeredImage band;
    const int rows = reader->rowsFor(kBandBytes);
    for (int y = crop.y0; y < crop.y1; y += rows) {
        reader->read({crop.x0, y, crop.x1, std::min(y + rows, crop.y1)}, band);
        facts.fragments += band.fragments();
        for (std::size_t pixel = 0; pixel < band.window.pixels(); ++pixel) {
            for (std::uint32_t k = 0; k < band.count(pixel); ++k)
                ++facts.layer_pixels[k];
        }
    }
}

ImageFacts gather(const std::string& path) {
    ImageFacts facts;
    facts.info = readExrInfo(path);
    facts.layered = !facts.info.layers.empty() || !facts.info.deep.empty();
    if (facts.layered) readLayers(path, facts);
    return facts;
}

Json windowJson(const Window& window) {
    return {window.x0, window.y0, window.width(), window.height()};
}

std::string windowText(const Window& window) {
    return std::to_string(window.width()) + " x " + std::to_string(window.height()) + " at (" +
           std::to_string(window.x0) + ", " + std::to_string(window.y0) + ')';
}

Json partJson(const ExrInputPart& part) {
    Json json;
    json["name"] = part.name;
    json["type"] = part.type;
    json["compression"] = part.compression;
    json["window"] = windowJson(part.data_window);
    json["channels"] = Json::array();
    for (const ExrInputChannel& channel : part.channels) {
        Json entry;
        entry["name"] = channel.name;
        entry["type"] = kPixelTypes[static_cast<std::size_t>(channel.type)];
        json["channels"].push_back(entry);
    }
    return json;
}

Json toJson(const ImageFacts& facts, const InfoOptions& options) {
    const ExrInfo& info = facts.info;
    const Plan& plan = info.plan;
    Json json;
    json["kind"] = "image";
    json["file"] = options.file.string();
    json["bytes"] = info.bytes;
    json["peeler"] = info.is_peeler;
    json["width"] = plan.view.width;
    json["height"] = plan.view.height;
    json["crop"] = windowJson(plan.view.crop);
    json["fragmentsCounted"] = facts.countsKnown() ? Json(plan.fragments_counted) : Json();
    json["fragmentsStored"] = facts.countsKnown() ? Json(plan.fragments_stored) : Json();
    json["fragmentsFound"] = facts.layered ? Json(facts.fragments) : Json();
    json["complete"] = facts.countsKnown() ? Json(plan.complete() && facts.agrees()) : Json();
    json["layers"] = Json::array();
    for (std::size_t i = 0; i < plan.layers.size(); ++i) {
        Json layer;
        layer["name"] = layerName(i);
        layer["window"] = windowJson(plan.layers[i].data_window);
        layer["pixels"] = facts.layer_pixels[i];
        json["layers"].push_back(layer);
    }
    json["parts"] = Json::array();
    for (const ExrInputPart& part : info.parts)
        json["parts"].push_back(partJson(part));
    json["attributes"] = info.attributes();
    return json;
}

std::string toText(const ImageFacts& facts, const InfoOptions& options) {
    const ExrInfo& info = facts.info;
    const Plan& plan = info.plan;
    std::string text = printable(options.file.string()) + ": OpenEXR image, " +
                       std::to_string(plan.view.width) + " x " + std::to_string(plan.view.height) +
                       ", " + bytesText(info.bytes) +
                       (info.is_peeler ? ", written by peeler\n" : "\n");
    text += "pixels: " + windowText(plan.view.crop) + '\n';
    if (facts.countsKnown()) {
        text += "fragments: " + groupedText(plan.fragments_stored) + " of " +
                groupedText(plan.fragments_counted) +
                (plan.complete() ? ", complete\n" : ", not complete\n");
    }
    text += "layers: " + groupedText(plan.layers.size()) + '\n';
    for (std::size_t i = 0; i < plan.layers.size(); ++i) {
        text += "  " + layerName(i) + "  " + countText(facts.layer_pixels[i], "pixel") + ", " +
                windowText(plan.layers[i].data_window) + '\n';
    }
    text += "parts:\n";
    for (const ExrInputPart& part : info.parts) {
        text += "  " + (part.name.empty() ? "(no name)" : printable(part.name)) + "  " + part.type +
                ", " + part.compression + ", " + windowText(part.data_window) + ':';
        for (const ExrInputChannel& channel : part.channels) {
            text += ' ' + printable(channel.name) + ' ' +
                    kPixelTypes[static_cast<std::size_t>(channel.type)];
        }
        text += '\n';
    }
    text += "attributes:\n";
    for (const auto& [name, value] : info.attributes()) {
        text += "  " + printable(name) + ": " + printable(value) + '\n';
    }
    return text;
}

}  // namespace

void printImageInfo(const InfoOptions& options, Console& console) {
    const ImageFacts facts = gather(options.file.string());
    if (!facts.agrees()) {
        console.warning("the file says it has " + groupedText(facts.info.plan.fragments_stored) +
                        " fragments, and has " + groupedText(facts.fragments));
    }
    console.result(options.json ? jsonText(toJson(facts, options)) : toText(facts, options));
}

}  // namespace peeler::cmd
