// SPDX-License-Identifier: Apache-2.0
#include "cmd/info/info_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "cmd/cli/report.h"
#include "cmd/info/info_options.h"
#include "cmd/info/info_scene.h"
#include "cmd/options/differences.h"
#include "cmd/options/layered_bands.h"
#include "core/base/printable.h"
#include "core/image/layers.h"
#include "core/image/statistics.h"
#include "core/lens/lens.h"
#include "core/scene/view.h"
#include "formats/exr/deep_certificate.h"
#include "formats/exr/exr_layout.h"
#include "formats/file/json_text.h"
#include "formats/layered/opened_picture.h"

namespace peeler::cmd {

namespace {

constexpr const char* kPixelTypes[] = {"half", "float", "uint"};

/// The data in the headers, and facts from reading the layers.
struct ImageFacts {
    ExrInfo info;
    bool layered = false;
    std::vector<LayerPlan> layers;         ///< pixel counts, and the data windows in the header
    std::vector<std::uint64_t> histogram;  ///< element n: the number of pixels with n fragments
    std::uint64_t fragments = 0;
    /// Statistics of the points; set only if the camera is known.
    std::optional<PointStatistics> points;

    bool countsKnown() const { return info.attributes().contains("peeler:fragmentsStored"); }
    bool cameraKnown() const { return info.attributes().contains("peeler:cameraJson"); }
    /// Whether the number of fragments matches the header.
    bool agrees() const {
        return !layered || !countsKnown() || fragments == info.plan.fragments_stored;
    }
};

/// Reads every layer. This also finds damage to the file.
void readLayers(OpenedPicture opened, ImageFacts& facts, Reporter& reporter) {
    const std::unique_ptr<LayeredInput> reader = openInput(std::move(opened), reporter);
    facts.info = reader->info();
    const View& view = facts.info.plan.view;
    DepthComplexity complexity(view.crop);
    PointStatistics points;
    forEachBand(*reader, kBandBytes, [&](const LayeredImage& band) {
        complexity.addBand(band);
        if (facts.cameraKnown()) addPoints(view, band, points);
    });
    facts.fragments = complexity.counted();
    facts.histogram = complexity.histogram();
    facts.layers = complexity.layers();
    // Adds the layers without pixels.
    facts.layers.resize(std::max(facts.layers.size(), facts.info.plan.layers.size()));
    for (std::size_t k = 0; k < facts.info.plan.layers.size(); ++k)
        facts.layers[k].data_window = facts.info.plan.layers[k].data_window;
    if (facts.cameraKnown()) facts.points = points;
}

ImageFacts gather(const InfoOptions& options, Reporter& reporter) {
    ImageFacts facts;
    LayeredReadOptions reading = options.image;
    reading.strict = options.scene.reading.strict;
    OpenedPicture opened(options.file.string(), reading);
    facts.info = opened.info();
    facts.layered = isLayered(facts.info) || reading.choosesPicture();
    if (facts.layered) readLayers(std::move(opened), facts, reporter);
    return facts;
}

Json windowJson(const Window& window) {
    return {window.x0, window.y0, window.width(), window.height()};
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

Json pointsJson(const PointStatistics& points) {
    if (points.empty()) return {{"count", 0}};
    return {{"count", points.points},
            {"min", vectorJson(points.boxMin())},
            {"max", vectorJson(points.boxMax())},
            {"mean", vectorJson(points.mean())}};
}

Json provenanceJson(const Provenance& p) {
    Json json{{"scene", p.scene},
              {"sceneHash", p.scene_hash},
              {"settingsHash", p.settings_hash},
              {"settings", settingsJson(p)},
              {"method", p.method},
              {"surfaces", p.surfaces},
              {"renderer", p.renderer},
              {"version", p.version},
              {"frame", p.frame},
              {"time", p.time}};
    if (!p.elements.empty()) json["elements"] = parseOrderedJsonOrNull(p.elements);
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
    json["layered"] = facts.layered;
    json["width"] = plan.view.width;
    json["height"] = plan.view.height;
    json["crop"] = windowJson(plan.view.crop);
    json["fragmentsCounted"] = facts.countsKnown() ? Json(plan.fragments_counted) : Json();
    json["fragmentsStored"] = facts.countsKnown() ? Json(plan.fragments_stored) : Json();
    json["fragmentsFound"] = facts.layered ? Json(facts.fragments) : Json();
    json["complete"] = facts.countsKnown() ? Json(plan.complete() && facts.agrees()) : Json();
    json["layers"] = Json::array();
    for (std::size_t i = 0; i < facts.layers.size(); ++i) {
        Json layer;
        layer["name"] = layerName(i);
        layer["window"] = windowJson(facts.layers[i].data_window);
        layer["pixels"] = facts.layers[i].pixels;
        json["layers"].push_back(layer);
    }
    json["depthComplexity"] = facts.layered ? Json(facts.histogram) : Json();
    json["points"] = facts.points ? pointsJson(*facts.points) : Json();
    json["camera"] = facts.cameraKnown()
                         ? parseOrderedJsonOrNull(info.attributes().at("peeler:cameraJson"))
                         : Json();
    json["provenance"] = info.is_peeler ? provenanceJson(info.provenance) : Json();
    json["parts"] = Json::array();
    for (const ExrInputPart& part : info.parts)
        json["parts"].push_back(partJson(part));
    json["attributes"] = info.attributes();
    return json;
}

std::string layersText(const ImageFacts& facts) {
    std::string text = "layers: " + groupedText(facts.layers.size()) + '\n';
    for (std::size_t i = 0; i < facts.layers.size(); ++i) {
        text += "  " + layerName(i) + "  " + countText(facts.layers[i].pixels, "pixel") + ", " +
                windowText(facts.layers[i].data_window) + '\n';
    }
    if (!facts.layered) return text;
    text += "fragments per pixel:\n";
    for (std::size_t n = 0; n < facts.histogram.size(); ++n) {
        if (facts.histogram[n] == 0) continue;
        text += "  " + std::to_string(n) + "  " + countText(facts.histogram[n], "pixel") + '\n';
    }
    return text;
}

/// Returns the statistics of the fragments' positions as text. The programs in examples/readers
/// print the same three lines.
std::string pointsText(const PointStatistics& points) {
    std::string text = "points: " + std::to_string(points.points) + '\n';
    if (points.empty()) return text;
    return text + "bounds: " + vectorText(points.boxMin()) + " to " + vectorText(points.boxMax()) +
           "\nmean: " + vectorText(points.mean()) + '\n';
}

std::string lensText(const LensCamera& camera) {
    std::string text = "lens " + camera.lens.model;
    for (const double coefficient : camera.lens.coefficients)
        text += ' ' + numberText(coefficient);
    if (lensModel(camera.lens).filling) return text;
    const auto& [fx, fy, cx, cy] = camera.intrinsics;
    return text + ", fx " + numberText(fx) + ", fy " + numberText(fy) + ", cx " + numberText(cx) +
           ", cy " + numberText(cy);
}

std::string projectionText(const View& view) {
    if (const LensCamera* camera = lensCameraOf(view)) return lensText(*camera);
    const Projection& projection = view.projection;
    std::array<char, 96> size{};
    if (projection.perspective) {
        constexpr double kDegrees = 57.295779513082320877;
        std::snprintf(size.data(), size.size(), "perspective, %.6g degrees high",
                      2 * kDegrees * std::atan(projection.half_height));
    } else {
        std::snprintf(size.data(), size.size(), "orthographic, %.6g high",
                      2 * projection.half_height);
    }
    return size.data();
}

std::string cameraText(const View& view) {
    const glm::dvec3 eye(view.camera_to_world[3]), forward(-view.camera_to_world[2]);
    return "camera: " +
           (view.camera_name.empty() ? std::string() : printable(view.camera_name) + ", ") +
           projectionText(view) + ", at " + vectorText(eye) + " looking along " +
           vectorText(forward) + '\n';
}

/// Returns a line for each element of a merge. Skips malformed entries, because other programs may
/// have changed the attribute.
std::string elementsText(const Provenance& p) {
    const nlohmann::json elements = parseJsonOrNull(p.elements);
    if (!elements.is_array()) return "";
    std::string text = "merged of:\n";
    for (const nlohmann::json& element : elements) {
        if (!element.is_object()) continue;
        const auto word = [&](const char* key) {
            const auto found = element.find(key);
            return found == element.end() ? std::string()
                   : found->is_string()   ? found->get<std::string>()
                                          : dumpJson(*found);
        };
        text += "  " + printable(word("file")) + ": " + printable(word("scene"));
        for (const char* const key : {"include", "exclude"})
            if (!word(key).empty()) text += std::string(", ") + key + ' ' + printable(word(key));
        text += '\n';
    }
    return text;
}

std::string provenanceText(const Provenance& p) {
    std::array<char, 64> moment{};
    std::snprintf(moment.data(), moment.size(), "frame %d, %.6g s", p.frame, p.time);
    std::string text =
        "from: " +
        (p.scene.empty() && !p.elements.empty() ? "several scenes" : printable(p.scene)) + ", " +
        moment.data();
    if (!p.method.empty()) text += ", by " + printable(p.method);
    if (!p.renderer.empty()) text += " on " + printable(p.renderer);
    return text + '\n' + elementsText(p);
}

bool isOfArrays(const ExrInfo& info) {
    const std::string& type = info.parts.front().type;
    return type == kListArrays || type == kPlaneArrays;
}

std::string toText(const ImageFacts& facts, const InfoOptions& options) {
    const ExrInfo& info = facts.info;
    const Plan& plan = info.plan;
    std::string text = printable(options.file.string(), kMostOfLine) +
                       (isOfArrays(info) ? ": picture in arrays, " : ": OpenEXR image, ") +
                       std::to_string(plan.view.width) + " x " + std::to_string(plan.view.height) +
                       ", " + bytesText(info.bytes) +
                       (info.is_peeler ? ", written by peeler\n" : "\n");
    text += "pixels: " + windowText(plan.view.crop) + '\n';
    if (facts.countsKnown()) {
        text += "fragments: " + groupedText(plan.fragments_stored) + " of " +
                groupedText(plan.fragments_counted) +
                (plan.complete()                                ? ", complete\n"
                 : info.attributes().contains(kDeepCertificate) ? ", thinned\n"
                                                                : ", not complete\n");
    } else if (facts.layered) {
        text += "fragments: " + groupedText(facts.fragments) + '\n';
    }
    text += layersText(facts);
    if (facts.points) text += pointsText(*facts.points);
    if (facts.cameraKnown()) text += cameraText(plan.view);
    if (info.is_peeler) text += provenanceText(info.provenance);
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
        text += "  " + printable(name) + ": " + printable(value, kMostOfLine) + '\n';
    }
    return text;
}

}  // namespace

void printImageInfo(const InfoOptions& options, Reporter& reporter) {
    const ImageFacts facts = gather(options, reporter);
    if (!facts.agrees()) {
        reporter.warning("The header says " + groupedText(facts.info.plan.fragments_stored) +
                         " fragments, but the file has " + groupedText(facts.fragments) + '.');
    }
    if (options.json)
        reporter.result(toJson(facts, options));
    else
        reporter.text(toText(facts, options));
}

}  // namespace peeler::cmd
