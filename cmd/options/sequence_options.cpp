// SPDX-License-Identifier: Apache-2.0
#include "cmd/options/sequence_options.h"

#include <algorithm>
#include <utility>

#include "cmd/cli/arguments.h"
#include "cmd/cli/errors.h"

namespace peeler::cmd {

void addSequenceOptions(VerbOptions& verb, SequenceOptions& options) {
    constexpr const char* kGroup = "Output";
    addValue(
        verb, "--chunk", "I/N", options.chunk,
        [](const std::string& text) { return parseShard(text); },
        "render the I-th of N equal parts of all frames and views, from 1/N to N/N, so that N "
        "processes can share the work")
        .group(kGroup);
    verb.addFlag("--skip-existing", options.skip_existing,
                 "skip a file that is complete and was made from the same scene, settings, camera, "
                 "size and time; replace any other")
        .group(kGroup);
    verb.addFlag("--keep-going", options.keep_going,
                 "continue after a picture fails; the exit code is the highest of all")
        .group(kGroup);
}

std::string PictureNumber::text() const {
    std::string text;
    if (frame) text = "frame " + std::to_string(*frame);
    if (view) text += (frame ? ", view " : "view ") + std::to_string(*view);
    return text;
}

void SequenceResults::add(Json result, const std::string& line) {
    if (!line.empty()) reporter_.note(line);
    finished_.push_back(std::move(result));
}

void SequenceResults::addFailure(const std::filesystem::path& output, const PictureNumber& number,
                                 const Error& error) {
    const std::string of = pictures_.empty() ? "" : number.text() + ": ";
    const int code = reportError(
        reporter_, Error(error.kind(), of + error.whatText(), error.whereText(), error.hintText()));
    worst_ = std::max(worst_, code);
    Json json;
    if (number.frame) json["frame"] = *number.frame;
    if (number.view) json["view"] = *number.view;
    if (!output.empty()) json["output"] = output.string();
    json["exitCode"] = code;
    json["error"] = error.what();
    json["where"] = error.where();
    json["hint"] = error.hint();
    failed_.push_back(std::move(json));
}

Json SequenceResults::json() const {
    if (pictures_.empty()) return finished_.empty() ? Json() : finished_.front();
    Json json;
    json[pictures_ + "s"] = finished_;
    if (!failed_.empty()) json["failed"] = failed_;
    return json;
}

void SequenceResults::reportFailures() const {
    if (pictures_.empty() || failed_.empty()) return;
    reporter_.error(std::to_string(failed_.size()) + " of " +
                    countText(finished_.size() + failed_.size(), pictures_) + " failed");
}

void makeEach(std::size_t first, std::size_t end, const SequenceOptions& options,
              SequenceResults& results, const std::function<PictureNumber(std::size_t)>& number,
              const std::function<void(std::size_t)>& make,
              const std::function<std::filesystem::path(std::size_t)>& discard) {
    for (std::size_t i = first; i < end; ++i) {
        try {
            make(i);
        } catch (...) {
            const Error error = currentError();
            if (!options.keep_going || error.kind() == ErrorKind::kUsage) throw error;
            results.addFailure(discard(i), number(i), error);
        }
    }
}

void makeEachView(std::size_t first, std::size_t end, const SequenceOptions& options,
                  SequenceResults& results, const std::function<void(std::size_t)>& make,
                  const std::function<std::filesystem::path(std::size_t)>& discard) {
    const auto number = [](std::size_t view) {
        return PictureNumber{.view = static_cast<int>(view)};
    };
    makeEach(first, end, options, results, number, make, discard);
}

}  // namespace peeler::cmd
