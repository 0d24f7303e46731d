// SPDX-License-Identifier: Apache-2.0
#include "cmd/cli/report.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <span>
#include <system_error>
#include <utility>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/machine/resources.h"
#include "cmd/session/choices.h"
#include "core/base/printable.h"
#include "formats/cameras/calibration.h"
#include "formats/file/atomic_file.h"
#include "formats/file/json_text.h"

namespace peeler::cmd {

namespace {

/// The stages of the pipeline, in order. Results list these first, then a verb's own stages, then
/// the total.
constexpr const char* kStages[] = {"load", "context",   "upload", "count", "capture",
                                   "sort", "composite", "encode", "write"};
constexpr const char* kTotal = "total";

double spent(const StageTimes& times, const std::string& stage) {
    const auto entry = times.find(stage);
    return entry == times.end() ? 0 : entry->second;
}

Json stagesJson(const StageTimes& times) {
    Json json;
    const auto report = [&](const std::string& stage) {
        json[stage] = std::round(spent(times, stage) * 1e3) / 1e3;
    };
    for (const char* stage : kStages)
        report(stage);
    for (const auto& [stage, milliseconds] : times)
        if (stage != kTotal) report(stage);
    report(kTotal);
    return json;
}

/// Returns stops with at most six significant digits: −1.4, not −1.399999976.
double stopsJson(float stops) {
    return std::stod(stopsText(stops));
}

Json filesJson(const RunResult& run) {
    Json json;
    if (run.inputs.size() == 1) {
        json["input"] = run.inputs.front().string();
    } else {
        for (const std::filesystem::path& input : run.inputs)
            json["inputs"].push_back(input.string());
    }
    json["output"] = run.output.empty() ? Json() : Json(run.output.string());
    json["bytes"] = run.bytes;
    if (run.forecast_bytes) json["forecastBytes"] = *run.forecast_bytes;
    if (run.forecast_memory) json["forecastMemory"] = *run.forecast_memory;
    if (!run.files) return json;
    json["outputs"] = Json::array();
    for (const WrittenFile& file : *run.files) {
        Json entry;
        if (!file.kind.empty()) entry["kind"] = file.kind;
        entry["path"] = file.path.string();
        entry["bytes"] = file.bytes;
        json["outputs"].push_back(std::move(entry));
    }
    return json;
}

}  // namespace

void ReportOptions::applyTo(Reporter& reporter) const {
    const bool for_people = progress == ProgressStyle::kAuto || progress == ProgressStyle::kPlain;
    reporter.setProgress(quiet && for_people ? ProgressStyle::kNone : progress);
    reporter.setQuiet(quiet);
    reporter.setVerbose(verbose);
}

void addReportOptions(VerbOptions& verb, ReportOptions& options) {
    constexpr const char* kGroup = "Messages";
    verb.addFlag("--json", options.json, "print the result as JSON").group(kGroup);
    addFile(verb, "--report", "FILE", options.file, "write the result as JSON to a file")
        .files(".json")
        .group(kGroup);
    addChoice<ProgressStyle>(verb, "--progress", options.progress, kProgressStyles,
                             "progress style", "style of progress reports on stderr:")
        .group(kGroup);
    verb.addFlag("-q,--quiet", options.quiet, "print only warnings and errors").group(kGroup);
    verb.addFlag("-v,--verbose", options.verbose, "also print each step").group(kGroup);
}

ReportOptions givenReportOptions(const VerbOptions& verb) {
    ReportOptions options;
    options.json = verb.given("--json");
    options.quiet = verb.given("--quiet");
    options.verbose = verb.given("--verbose");
    if (verb.given("--report")) options.file = verb.value("--report");
    if (verb.given("--progress"))
        options.progress =
            choose<ProgressStyle>("progress style", kProgressStyles, verb.value("--progress"));
    return options;
}

void RunResult::setFile(const std::filesystem::path& file) {
    output = file;
    bytes = fileBytes(file);
}

void RunResult::setFiles(const std::filesystem::path& name,
                         const std::vector<std::filesystem::path>& all) {
    output = name;
    files.emplace();
    for (const std::filesystem::path& path : all)
        addFile(path);
}

const WrittenFile& RunResult::addFile(const std::filesystem::path& file, const std::string& kind) {
    if (!files) files.emplace();
    files->push_back({file, fileBytes(file), kind});
    bytes += files->back().bytes;
    return files->back();
}

void describePicture(const Plan& plan, const Provenance& provenance, PictureResult& result) {
    result.width = plan.view.width;
    result.height = plan.view.height;
    result.layers = plan.layers.size();
    result.fragments_counted = plan.fragments_counted;
    result.fragments_stored = plan.fragments_stored;
    result.fragments_blended = plan.fragments_blended;
    result.samples = plan.samples;
    result.method = provenance.method;
    result.settings_hash = provenance.settings_hash;
    result.renderer = provenance.renderer;
    result.peak_memory = peakMemory();
}

Json toJson(const RunResult& run, const Json& findings) {
    Json json = filesJson(run);
    json.update(findings);
    if (!run.format.empty()) {
        json["format"] = run.format;
        json["up"] = run.up;
        json["metresPerUnit"] = run.metres_per_unit;
    }
    if (!run.engine.empty()) json["engine"] = run.engine;
    json["settingsHash"] = run.settings_hash;
    json["renderer"] = run.renderer;
    json["backend"] = run.backend;
    json["peakMemory"] = run.peak_memory;
    json["milliseconds"] = stagesJson(run.milliseconds);
    return json;
}

Json normalizingJson(const Normalizing& by) {
    return {{"scale", by.scale}, {"middle", {by.middle.x, by.middle.y, by.middle.z}}};
}

Json findingsOf(const PictureResult& result) {
    Json json;
    if (!result.sample.empty()) json["sample"] = result.sample;
    if (result.frame) {
        json["frame"] = *result.frame;
        json["time"] = result.time;
    }
    if (result.view) {
        json["view"] = *result.view;
        json["camera"] = result.camera;
    }
    if (result.skipped) {
        json["skipped"] = true;
        return json;
    }
    if (result.normalized) json["normalized"] = normalizingJson(*result.normalized);
    if (result.sample_view) json.update(calibrationJson(*result.sample_view));
    json["width"] = result.width;
    json["height"] = result.height;
    json["layers"] = result.layers;
    json["fragmentsCounted"] = result.fragments_counted;
    json["fragmentsStored"] = result.fragments_stored;
    json["fragmentsBlended"] = result.fragments_blended;
    if (result.without_ray > 0) json["withoutRay"] = result.without_ray;
    json["fragmentsLeftOut"] =
        result.fragments_counted - result.fragments_stored - result.fragments_blended;
    json["samples"] = result.samples;
    json["complete"] = result.fragments_counted == result.fragments_stored;
    json["method"] = result.method;
    json["passes"] = result.passes;
    if (!result.display) return json;
    json["toneMap"] = result.display->tone_map;
    json["exposure"] = stopsJson(result.display->exposure);
    json["exposureAutomatic"] = result.display->automatic_exposure;
    json["alphaRaisedPixels"] = result.display->alpha_raised_pixels;
    return json;
}

Json toJson(const PictureResult& result) {
    if (!result.skipped) return toJson(result, findingsOf(result));
    Json json = filesJson(result);
    json.update(findingsOf(result));
    return json;
}

std::string summary(const PictureResult& result) {
    const std::string file =
        (result.sample.empty() ? "" : result.sample + " in ") + result.output.string();
    if (result.skipped) return file + ": already exists";
    const auto samples = static_cast<std::uint64_t>(result.counted_samples);
    std::string text = file + ": " + countText(result.layers, "layer") + ", " +
                       countText(result.fragments_stored / samples,
                                 result.counts_visible ? "visible fragment" : "fragment");
    if (result.fragments_stored != result.fragments_counted) {
        text += " of " + groupedText(result.fragments_counted / samples);
    }
    if (!result.view && !result.camera.empty()) {
        text += ", camera " + printable(result.camera) +
                (result.camera_cut ? " (cuts the scene off; --camera auto shows all of it)" : "");
    }
    if (!result.light.empty()) text += ", " + result.light;
    return text + ", " + bytesText(result.bytes) + ", " + totalText(result.milliseconds);
}

std::string totalText(const StageTimes& milliseconds) {
    return groupedText(static_cast<std::uint64_t>(std::llround(spent(milliseconds, kTotal)))) +
           " ms";
}

void reportResult(const ReportOptions& options, const Json& json,
                  const std::vector<std::string>& lines, Reporter& reporter) {
    if (options.file) writeReport(*options.file, json);
    for (const std::string& line : lines)
        reporter.note(line);
    if (options.json) reporter.result(json);
}

void reportResult(const ReportOptions& options, const PictureResult& result, Reporter& reporter) {
    reportResult(options, toJson(result), {summary(result)}, reporter);
}

std::string jsonText(const Json& json) {
    return dumpJson(json, 2) + '\n';
}

void writeReport(const std::filesystem::path& path, const Json& json) {
    const std::string text = jsonText(json);
    AtomicFile file(path.string());
    file.append(std::as_bytes(std::span(text)));
    file.commit();
}

std::uint64_t fileBytes(const std::filesystem::path& file) {
    if (isStandardOutput(file.string())) return bytesOnStandardOutput();
    std::error_code failure;
    const std::uint64_t bytes = std::filesystem::file_size(file, failure);
    if (!failure) return bytes;
    throw Error(ErrorKind::kOutput, "the file has disappeared: " + failure.message(), file.string(),
                "something else has removed the file or its folder");
}

std::string windowText(const Window& window) {
    return std::to_string(window.width()) + " x " + std::to_string(window.height()) + " at (" +
           std::to_string(window.x0) + ", " + std::to_string(window.y0) + ')';
}

std::string stopsText(float stops) {
    return numberText(static_cast<double>(stops));
}

std::string groupedText(std::uint64_t value) {
    std::string text = std::to_string(value);
    for (std::size_t at = text.size(); at > 3;) {
        at -= 3;
        text.insert(at, 1, ',');
    }
    return text;
}

std::string numberText(double value, int digits) {
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), "%.*g", digits, value);
    return text.data();
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
    return groupedText(count) + ' ' + (count == 1 ? noun : pluralOf(noun));
}

}  // namespace peeler::cmd
