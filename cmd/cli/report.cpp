// SPDX-License-Identifier: Apache-2.0
// Numbers as people and as programs read them.
#include "cmd/cli/report.h"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <span>
#include <system_error>

#include "cmd/machine/resources.h"
#include "core/base/error.h"
#include "formats/file/atomic_file.h"

namespace peeler::cmd {

namespace {
constexpr const char* kStages[] = {"load", "context",   "upload", "count", "capture",
                                   "sort", "composite", "encode", "write", "total"};
}  // namespace

void describePicture(const Plan& plan, const Provenance& provenance, PictureResult& result) {
    result.width = plan.view.width;
    result.height = plan.view.height;
    result.layers = plan.layers.size();
    result.fragments_counted = plan.fragments_counted;
    result.fragments_stored = plan.fragments_stored;
    result.fragments_blended = plan.fragments_blended;
    result.samples = plan.samples;
    result.method = provenance.method;
    result.renderer = provenance.renderer;
    result.peak_memory = peakMemory();
}

nlohmann::ordered_json toJson(const PictureResult& result) {
    nlohmann::ordered_json json;
    json["output"] = result.output.string();
    if (result.frame) {
        json["frame"] = *result.frame;
        json["time"] = result.time;
    }
    json["bytes"] = result.bytes;
    if (result.skipped) {
        json["skipped"] = true;
        return json;
    }
    json["width"] = result.width;
    json["height"] = result.height;
    json["layers"] = result.layers;
    json["fragmentsCounted"] = result.fragments_counted;
    json["fragmentsStored"] = result.fragments_stored;
    json["fragmentsBlended"] = result.fragments_blended;
    json["fragmentsLeftOut"] =
        result.fragments_counted - result.fragments_stored - result.fragments_blended;
    json["samples"] = result.samples;
    json["complete"] = result.fragments_counted == result.fragments_stored;
    json["method"] = result.method;
    json["renderer"] = result.renderer;
    json["backend"] = result.backend;
    json["passes"] = result.passes;
    json["peakMemory"] = result.peak_memory;
    auto& milliseconds = json["milliseconds"];
    for (const char* stage : kStages) {
        const auto entry = result.milliseconds.find(stage);
        const double spent = entry == result.milliseconds.end() ? 0 : entry->second;
        milliseconds[stage] = std::round(spent * 1e3) / 1e3;
    }
    return json;
}

std::string summary(const PictureResult& result) {
    if (result.skipped) return result.output.string() + ": is there already";
    std::string text = result.output.string() + ": " + countText(result.layers, "layer") + ", " +
                       countText(result.fragments_stored, "fragment");
    if (result.fragments_stored != result.fragments_counted) {
        text += " of " + groupedText(result.fragments_counted);
    }
    const auto total = result.milliseconds.find("total");
    const double spent = total == result.milliseconds.end() ? 0 : total->second;
    return text + ", " + bytesText(result.bytes) + ", " +
           groupedText(static_cast<std::uint64_t>(std::llround(spent))) + " ms";
}

std::string jsonText(const nlohmann::ordered_json& json) {
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
}

void writeReport(const std::filesystem::path& path, const nlohmann::ordered_json& json) {
    const std::string text = jsonText(json);
    AtomicFile file(path.string());
    file.append(std::as_bytes(std::span(text)));
    file.commit();
}

std::uint64_t fileBytes(const std::filesystem::path& file) {
    std::error_code failure;
    const std::uint64_t bytes = std::filesystem::file_size(file, failure);
    if (!failure) return bytes;
    throw Error(ErrorKind::kOutput, "the file is gone: " + failure.message(), file.string(),
                "something else has removed it, or its folder");
}

std::string groupedText(std::uint64_t value) {
    std::string text = std::to_string(value);
    for (std::size_t at = text.size(); at > 3;) {
        at -= 3;
        text.insert(at, 1, ',');
    }
    return text;
}

std::string bytesText(std::uint64_t bytes) {
    constexpr const char* kUnits[] = {"B", "kB", "MB", "GB", "TB"};
    if (bytes < 1000) return std::to_string(bytes) + " B";
    double value = static_cast<double>(bytes);
    std::size_t unit = 0;
    while (value >= 999.95 && unit + 1 < std::size(kUnits)) {
        value /= 1000;
        ++unit;
    }
    char text[32];
    std::snprintf(text, sizeof text, "%.1f %s", value, kUnits[unit]);
    return text;
}

std::string countText(std::uint64_t count, const std::string& noun) {
    return groupedText(count) + ' ' + noun + (count == 1 ? "" : "s");
}

}  // namespace peeler::cmd
