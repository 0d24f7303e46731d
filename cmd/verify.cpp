// SPDX-License-Identifier: Apache-2.0
// peeler verify: checks the integrity of files and the consistency of sequences.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <set>
#include <vector>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/report.h"
#include "cmd/machine/resources.h"
#include "cmd/options/differences.h"
#include "cmd/options/output_checks.h"
#include "cmd/options/output_options.h"
#include "cmd/session/progress_report.h"
#include "cmd/session/session.h"
#include "cmd/verbs.h"
#include "cmd/verify/verified_file.h"
#include "core/base/printable.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct VerifyOptions {
    std::vector<fs::path> inputs;
    std::optional<fs::path> against;
    bool any_settings = false;
    int threads = 0;
    ReportOptions report;
};

bool isOurs(const VerifiedFile& file) {
    return file.kind == VerifiedKind::kLayered || file.kind == VerifiedKind::kFlat;
}

/// Checks that the files of a sequence agree in scene, settings and size. The camera may move.
void checkSettings(std::vector<VerifiedFile>& files) {
    const auto first = std::ranges::find_if(files, isOurs);
    for (VerifiedFile& file : files) {
        if (!isOurs(file)) continue;
        const auto blame = [&](const std::vector<Difference>& differences) {
            for (const Difference& difference : differences)
                file.blame(Verdict::kBad,
                           "differs from " + first->path + " in " + difference.text());
        };
        blame(sceneDifferences(file.provenance, first->provenance));
        blame(settingsDifferences(file.provenance, first->provenance));
        blame(sizeDifferences(file.view, first->view));
    }
}

/// Returns the frames missing between the first and the last frame. Assumes the largest step that
/// fits all frames.
std::vector<int> missingFrames(const std::vector<VerifiedFile>& files) {
    constexpr std::int64_t kMost = 1000000;  // equals kMaxFrames, the limit of --frames
    std::set<std::int64_t> frames;
    for (const VerifiedFile& file : files) {
        if (isOurs(file)) frames.insert(file.provenance.frame);
    }
    std::vector<int> missing;
    if (frames.size() < 2) return missing;
    std::int64_t step = 0;
    for (const std::int64_t frame : frames)
        step = std::gcd(step, frame - *frames.begin());
    if ((*frames.rbegin() - *frames.begin()) / step > kMost) return missing;
    for (std::int64_t frame = *frames.begin(); frame < *frames.rbegin(); frame += step) {
        if (!frames.contains(frame)) missing.push_back(static_cast<int>(frame));
    }
    return missing;
}

/// Returns text such as "3, 5-8, 11".
std::string framesText(const std::vector<int>& frames) {
    std::string text;
    for (std::size_t i = 0; i < frames.size();) {
        std::size_t last = i;
        while (last + 1 < frames.size() && frames[last + 1] == frames[last] + 1)
            ++last;
        text += (text.empty() ? "" : ", ") + std::to_string(frames[i]);
        if (last > i) text += '-' + std::to_string(frames[last]);
        i = last + 1;
    }
    return text;
}

constexpr const char* kKinds[] = {"unknown", "foreign", "flat", "layered"};
constexpr const char* kProofs[] = {"proven", "none", "changed"};
constexpr const char* kVerdicts[] = {"good", "incomplete", "bad"};

Json toJson(const DeepAgainst& against) {
    const DeepDifference& worst = against.worst;
    Json json;
    json["path"] = against.path;
    json["difference"] = std::isfinite(worst.error) ? Json(worst.error) : Json("inf");
    json["pixel"] = {against.x, against.y};
    json["z"] = worst.z;
    json["channel"] = std::string(deepChannelName(worst.component, against.tinted));
    json["value"] = worst.value;
    json["original"] = worst.original;
    json["samples"] = against.samples;
    json["originalSamples"] = against.original_samples;
    const auto& certificate = against.certificate;
    json["certified"] = certificate ? Json(certificate->error) : Json();
    json["isOriginal"] = certificate ? Json(against.is_original) : Json();
    return json;
}

Json toJson(const VerifiedFile& file) {
    Json json;
    json["path"] = file.path;
    json["kind"] = kKinds[static_cast<std::size_t>(file.kind)];
    json["verdict"] = kVerdicts[static_cast<std::size_t>(file.verdict)];
    json["proof"] = file.proof ? Json(kProofs[*file.proof]) : Json();
    const bool layered = file.kind == VerifiedKind::kLayered;
    json["layers"] = layered ? Json(file.layers) : Json();
    json["fragments"] = layered ? Json(file.fragments) : Json();
    json["frame"] = isOurs(file) ? Json(file.provenance.frame) : Json();
    json["problems"] = file.problems;
    if (file.against) json["against"] = toJson(*file.against);
    return json;
}

std::string toText(const VerifiedFile& file) {
    std::string text = printable(file.path, kMostOfLine) + ": ";
    if (!file.problems.empty()) {
        for (std::size_t i = 0; i < file.problems.size(); ++i)
            text += (i == 0 ? "" : "; ") + printable(file.problems[i], kMostOfLine);
        return text + '\n';
    }
    if (file.against) text += file.against->text() + "; ";
    const bool proven = file.proof == ExrIntegrity::kProven;
    if (file.kind == VerifiedKind::kForeign)
        return text +
               (proven ? "unchanged since it was written"
                       : "readable; not written by peeler, so nothing else was checked") +
               '\n';
    text += file.kind == VerifiedKind::kFlat ? "good, without layers"
                                             : "good, " + countText(file.layers, "layer") + ", " +
                                                   countText(file.fragments, "fragment");
    // Without the pixel hash, changed pixels cannot be detected.
    return text + (proven ? "\n" : std::string("; without ") + kPixelHash + '\n');
}

int verifyAll(const VerifyOptions& options, Reporter& reporter) {
    options.report.applyTo(reporter);
    checkReport(options.report, options.inputs);
    setThreads(options.threads);
    std::vector<VerifiedFile> files;
    {
        ProgressReport progress(reporter, "verify");
        for (const fs::path& path : options.inputs) {
            files.push_back(verifyFile(path.string()));
            if (options.against) verifyAgainst(files.back(), options.against->string());
            progress.update(static_cast<double>(files.size()) /
                            static_cast<double>(options.inputs.size()));
        }
    }
    if (!options.any_settings) checkSettings(files);
    const std::vector<int> missing = missingFrames(files);

    Verdict worst = missing.empty() ? Verdict::kGood : Verdict::kIncomplete;
    std::size_t faulty = 0;
    Json json;
    json["files"] = Json::array();
    std::string text;
    for (const VerifiedFile& file : files) {
        worst = std::max(worst, file.verdict);
        faulty += file.verdict == Verdict::kGood ? 0 : 1;
        json["files"].push_back(toJson(file));
        if (!reporter.quiet() || file.verdict != Verdict::kGood) text += toText(file);
    }
    json["missingFrames"] = missing;
    json["verdict"] = kVerdicts[static_cast<std::size_t>(worst)];
    if (!missing.empty()) text += "missing frames: " + framesText(missing) + '\n';
    if (options.report.file) writeReport(*options.report.file, json);
    if (options.report.json)
        reporter.result(json);
    else if (!text.empty())
        reporter.text(text);
    if (worst == Verdict::kGood) return 0;
    std::string sum;
    if (faulty != 0) {
        sum = std::to_string(faulty) + " of " + countText(files.size(), "file") +
              (faulty == 1 ? " is " : " are ") + "not good";
    }
    if (!missing.empty()) {
        sum += (sum.empty() ? "" : ", and ") + countText(missing.size(), "frame") +
               (missing.size() == 1 ? " is " : " are ") + "missing";
    }
    reporter.error(sum);
    return static_cast<int>(worst == Verdict::kBad ? ErrorKind::kInput : ErrorKind::kIncomplete);
}

}  // namespace

VerbAction declareVerify(VerbOptions& verb) {
    const auto options = std::make_shared<VerifyOptions>();
    verb.addFiles("FILES", options->inputs,
                  "OpenEXR files and pictures in arrays (.safetensors); files that peeler wrote "
                  "are checked as one sequence")
        .files(".exr .safetensors");
    addFile(verb, "--against", "ORIGINAL", options->against,
            "the deep or layered file that FILES were thinned from (--deep-error): measure the "
            "largest difference of accumulated colour and transmittance at any depth, and fail if "
            "it exceeds the certificate in the header")
        .files(".exr .safetensors");
    verb.addFlag("--any-settings", options->any_settings,
                 "allow scene, settings and size to differ between files");
    addThreadsOption(verb, options->threads);
    addReportOptions(verb, options->report);
    verb.footer(
        "Every byte is checked against the hash of its part; files without a hash (from other\n"
        "programs or older versions) are reported. Every chunk is read. Layers must be sorted\n"
        "by Z, with a finite Z where there is a fragment and 0 elsewhere; the header must\n"
        "have the right number of fragments, and the stored composite must be the composite\n"
        "of the layers, bit for bit. In each header, camera attributes such as worldToCamera\n"
        "must agree with peeler:cameraJson. Files of other programs are only read to their\n"
        "end.\n"
        "\n"
        "Exit codes: 0 all files are good; 3 a file is unreadable or inconsistent, or its\n"
        "settings differ from the other files'; 6 fragments or frames are\n"
        "missing, but nothing else is wrong.");
    return [options](Session& session) { return verifyAll(*options, session.reporter()); };
}

}  // namespace peeler::cmd
