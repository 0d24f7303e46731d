// SPDX-License-Identifier: Apache-2.0
#include "cmd/batch/batch_result.h"

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "cmd/cli/report.h"

namespace peeler::cmd {

namespace {

/// The lines of a job's stderr that begin so, without it.
std::vector<std::string> messagesOf(const std::string& err, const std::string& word) {
    std::vector<std::string> lines;
    std::istringstream stream(err);
    const std::string start = "peeler: " + word + ": ";
    for (std::string line; std::getline(stream, line);)
        if (line.starts_with(start)) lines.push_back(line.substr(start.size()));
    return lines;
}

std::string joined(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines)
        text += (text.empty() ? "" : "\n") + line;
    return text;
}

Json errorOf(const ChildProcess& process) {
    Json error;
    error["what"] = joined(messagesOf(process.err(), "error"));
    if (const int number = process.endingSignal())
        error["what"] =
            "ended by signal " + std::to_string(number) + " (" + strsignal(number) + ")";
    else if (error["what"] == "")
        error["what"] = process.err();
    const std::string hint = joined(messagesOf(process.err(), "hint"));
    if (!hint.empty()) error["hint"] = hint;
    return error;
}

}  // namespace

Json resultLine(std::size_t number, const Job& job, const ChildProcess& process) {
    Json line;
    line["job"] = number;
    if (!job.id.empty()) line["id"] = job.id;
    line["verb"] = job.verb;
    line["hash"] = job.hash;
    line["exitCode"] = process.exitCode();
    line["milliseconds"] = std::llround(process.milliseconds());
    const auto warnings = messagesOf(process.err(), "warning");
    if (!warnings.empty()) line["warnings"] = warnings;
    Json result = Json::parse(process.out(), nullptr, false);
    if (!result.is_discarded()) line["result"] = std::move(result);
    if (process.exitCode() != 0) line["error"] = errorOf(process);
    return line;
}

}  // namespace peeler::cmd
