// SPDX-License-Identifier: Apache-2.0
#include "cmd/render/sequence_results.h"

#include <algorithm>

#include "cmd/cli/errors.h"

namespace peeler::cmd {

void SequenceResults::add(const PictureResult& result) {
    if (sequence_)
        console_.note(summary(result));
    else
        reportResult(flags_, result, console_);
    finished_.push_back(result);
}

void SequenceResults::addFailure(const std::filesystem::path& output, std::optional<int> frame,
                                 const Error& error) {
    const std::string of = frame ? "frame " + std::to_string(*frame) + ": " : "";
    const int code =
        reportError(console_, Error(error.kind(), of + error.what(), error.where(), error.hint()));
    worst_ = std::max(worst_, code);
    nlohmann::ordered_json json;
    if (frame) json["frame"] = *frame;
    json["output"] = output.string();
    json["exitCode"] = code;
    json["error"] = error.what();
    json["where"] = error.where();
    json["hint"] = error.hint();
    failed_.push_back(std::move(json));
}

void SequenceResults::report() const {
    if (!sequence_) return;
    nlohmann::ordered_json json;
    json["frames"] = nlohmann::ordered_json::array();
    for (const PictureResult& result : finished_)
        json["frames"].push_back(toJson(result));
    if (!failed_.empty()) json["failed"] = failed_;
    if (flags_.file) writeReport(*flags_.file, json);
    if (flags_.json) console_.result(jsonText(json));
    if (failed_.empty()) return;
    console_.error(std::to_string(failed_.size()) + " of " +
                   countText(finished_.size() + failed_.size(), "frame") + " failed");
}

}  // namespace peeler::cmd
