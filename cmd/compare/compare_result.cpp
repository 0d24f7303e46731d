// SPDX-License-Identifier: Apache-2.0
#include "cmd/compare/compare_result.h"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "cmd/cli/report.h"
#include "cmd/session/reporter.h"
#include "core/base/printable.h"

namespace peeler::cmd {

namespace {

Json number(double value) {
    if (std::isfinite(value)) return value;
    return value > 0 ? "inf" : "-inf";
}

std::string cellText(const char* format, double value) {
    char text[48];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

std::string padded(const std::string& text, std::size_t width) {
    return text.size() < width ? std::string(width - text.size(), ' ') + text : text;
}

Json toJson(const DifferenceStatistics& statistics, bool is_color) {
    Json json;
    json["max"] = number(statistics.largest);
    json["mean"] = number(statistics.mean());
    json["rmse"] = number(statistics.rmse());
    if (is_color) json["psnr"] = number(statistics.psnr());
    json["maxAt"] = statistics.x < 0 ? Json() : Json{statistics.x, statistics.y};
    return json;
}

Json toJson(const FragmentDifference& fragments) {
    Json json;
    json["both"] = fragments.both;
    json["onlyA"] = fragments.only_a;
    json["onlyB"] = fragments.only_b;
    json["depth"] = toJson(fragments.depth, false);
    json["color"] = toJson(fragments.color, true);
    return json;
}

Json toJson(const ComparedFile& file) {
    return {{"path", file.path}, {"layered", file.layered}, {"layers", file.layers}};
}

constexpr std::size_t kNameWidth = 9, kColumn = 9, kCounts = 3, kDepths = 3;

std::string depthCells(const DifferenceStatistics& depth) {
    return cellText(" %8.3g", depth.largest) + cellText(" %8.3g", depth.mean()) +
           cellText(" %8.3g", depth.rmse());
}

std::string colorCells(const DifferenceStatistics& color) {
    return depthCells(color) + cellText(" %7.2f\n", color.psnr());
}

std::string row(std::string name, const FragmentDifference& fragments) {
    name.resize(kNameWidth, ' ');
    for (const std::uint64_t count : {fragments.both, fragments.only_a, fragments.only_b})
        name += ' ' + padded(groupedText(count), kColumn);
    return name + depthCells(fragments.depth) + colorCells(fragments.color);
}

std::string layerTable(const LayeredDifference& difference) {
    const std::size_t before_depth = kNameWidth + kCounts * (kColumn + 1);
    const std::size_t before_color = before_depth + kDepths * kColumn;
    std::string text(before_depth, ' ');
    text += "    depth";
    text.resize(before_color, ' ');
    text += "   colour\nlayer          both    only A    only B";
    text += "      max     mean     RMSE      max     mean     RMSE    PSNR\n";
    for (std::size_t k = 0; k < difference.layers.size(); ++k)
        text += row(std::to_string(k), difference.layers[k]);
    text += row("all", difference.all);
    std::string composite = "composite";
    composite.resize(before_color, ' ');
    return text + composite + colorCells(difference.composite);
}

std::string flatTable(const DifferenceStatistics& color) {
    return "colour      max     mean     RMSE    PSNR\n      " + colorCells(color);
}

std::string fileText(const char* name, const ComparedFile& file) {
    return std::string(name) + ": " + printable(file.path, kMostOfLine) + ", " +
           (file.layered ? countText(file.layers, "layer") : "flat") + '\n';
}

std::string placeText(const char* what, const DifferenceStatistics& statistics) {
    if (statistics.x < 0) return "";
    return std::string("largest difference of ") + what + ": first at pixel (" +
           std::to_string(statistics.x) + ", " + std::to_string(statistics.y) + ")\n";
}

}  // namespace

bool Comparison::identical() const {
    const FragmentDifference& all = difference.all;
    return difference.count_pixels == 0 && all.depth.largest == 0 && color().largest == 0;
}

std::vector<ThresholdResult> judge(const Comparison& comparison, const Thresholds& thresholds) {
    std::vector<ThresholdResult> results;
    const auto atMost = [&](const char* option, const char* what, double limit, double found) {
        results.push_back({option, what, limit, found, found > limit});
    };
    const LayeredDifference& difference = comparison.difference;
    const DifferenceStatistics& color = comparison.color();
    if (comparison.by_layer) {
        atMost("--max-count", "number of pixels whose fragment count differs",
               static_cast<double>(thresholds.max_count),
               static_cast<double>(difference.count_pixels));
        atMost("--max-depth", "largest difference of depth", thresholds.max_depth,
               difference.all.depth.largest);
    }
    const bool chosen = thresholds.max_color || thresholds.max_rmse || thresholds.min_psnr;
    if (thresholds.max_color || !chosen) {
        atMost("--max-color", "largest difference of colour", thresholds.max_color.value_or(0),
               color.largest);
    }
    if (thresholds.max_rmse) atMost("--max-rmse", "RMSE", *thresholds.max_rmse, color.rmse());
    if (thresholds.min_psnr) {
        results.push_back({"--min-psnr", "PSNR", *thresholds.min_psnr, color.psnr(),
                           color.psnr() < *thresholds.min_psnr});
    }
    return results;
}

std::string toText(const ThresholdResult& result) {
    return "beyond " + result.option + ' ' + numberText(result.limit) + ": the " + result.what +
           " is " + numberText(result.found);
}

std::string toText(const Comparison& comparison, const std::optional<HeatmapResult>& heatmap) {
    const LayeredDifference& difference = comparison.difference;
    std::string text = fileText("A", comparison.a) + fileText("B", comparison.b);
    if (comparison.by_layer) {
        text += "fragment counts: differ in " + groupedText(difference.count_pixels) + " of " +
                countText(difference.pixels, "pixel");
        if (difference.count_pixels != 0)
            text += ", by " + std::to_string(difference.largest_count) + " at most";
        text += '\n' + layerTable(difference) + placeText("depth", difference.all.depth);
    } else {
        text += "composites: " + countText(difference.pixels, "pixel") + '\n' +
                flatTable(difference.composite);
    }
    text += placeText("colour", comparison.color());
    if (comparison.identical()) text += "identical\n";
    if (heatmap) {
        text += "heat map: " + printable(heatmap->path, kMostOfLine) +
                ", colour difference 0 (black) to " + numberText(heatmap->color) + " (yellow)";
        if (heatmap->count != 0) {
            text += "; blue to cyan: counts differ by up to " + std::to_string(heatmap->count);
        }
        text += '\n';
    }
    return text;
}

Json toJson(const Comparison& comparison, const std::vector<ThresholdResult>& thresholds,
            const std::optional<HeatmapResult>& heatmap) {
    const LayeredDifference& difference = comparison.difference;
    Json json;
    json["a"] = toJson(comparison.a);
    json["b"] = toJson(comparison.b);
    json["width"] = comparison.width;
    json["height"] = comparison.height;
    json["pixels"] = difference.pixels;
    json["byLayer"] = comparison.by_layer;
    if (comparison.by_layer) {
        json["countPixels"] = difference.count_pixels;
        json["largestCount"] = difference.largest_count;
        json["fragments"] = toJson(difference.all);
        json["layers"] = Json::array();
        for (const FragmentDifference& layer : difference.layers)
            json["layers"].push_back(toJson(layer));
    }
    json["composite"] = toJson(difference.composite, true);
    json["identical"] = comparison.identical();
    bool within = true;
    json["thresholds"] = Json::array();
    for (const ThresholdResult& result : thresholds) {
        within = within && !result.exceeded;
        json["thresholds"].push_back({{"option", result.option},
                                      {"limit", number(result.limit)},
                                      {"found", number(result.found)},
                                      {"exceeded", result.exceeded}});
    }
    json["within"] = within;
    if (heatmap) {
        json["heatmap"] = {
            {"path", heatmap->path}, {"colorMax", heatmap->color}, {"countMax", heatmap->count}};
    }
    return json;
}

}  // namespace peeler::cmd
