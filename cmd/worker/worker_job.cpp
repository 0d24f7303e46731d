// SPDX-License-Identifier: Apache-2.0
#include "cmd/worker/worker_job.h"

#include <cmath>
#include <string_view>

#include "cmd/cli/errors.h"
#include "cmd/cli/job_line.h"
#include "formats/file/json_text.h"

namespace peeler::cmd {

namespace {

constexpr std::string_view kRequestKeys[] = {"id", "progress"};
constexpr const char* kWorkerHelp = "see peeler worker --help";

bool isId(const nlohmann::json& value) {
    return value.is_string() || value.is_number_integer();
}

/// Throws Error (kUsage) if the JSON in a line is nested too deeply.
void checkJson(const std::string& line) {
    try {
        checkJsonDepth(line, "");
    } catch (const Error& error) {
        throw Error(ErrorKind::kUsage, error.what(), "", kWorkerHelp);
    }
}

void checkId(const nlohmann::json& value, const char* key) {
    if (!isId(value))
        throw Error(ErrorKind::kUsage, "expected a string or an integer", key, kWorkerHelp);
}

/// Whether the job may succeed if it runs again, later or on another machine.
bool isWorthRetrying(const WorkerResult& result) {
    if (result.error_kind == "crash") return true;
    return result.error && (result.error->kind() == ErrorKind::kDevice ||
                            result.error->kind() == ErrorKind::kMemory);
}

std::string lineOf(const Json& json) {
    return dumpJson(json) + '\n';
}

}  // namespace

WorkerRequest::WorkerRequest(const std::string& line) {
    const nlohmann::json json = parseJsonOrNull(line);
    if (json.is_object() && json.contains("cancel")) {
        if (json.size() > 1)
            throw Error(ErrorKind::kUsage, "a cancel request cannot have other keys", "cancel",
                        kWorkerHelp);
        id = json["cancel"];
        checkId(id, "cancel");
        cancels = true;
        return;
    }
    if (json.is_null()) checkJson(line);
    JobLine job(line, kRequestKeys, kWorkerHelp);
    if (!job.json.contains("id"))
        throw Error(ErrorKind::kUsage, "a key is missing", "id", kWorkerHelp);
    id = job.json["id"];
    checkId(id, "id");
    if (const auto wanted = job.json.find("progress"); wanted != job.json.end()) {
        if (!wanted->is_boolean())
            throw Error(ErrorKind::kUsage, "expected true or false", "progress", kWorkerHelp);
        wants_progress = wanted->get<bool>();
    }
    verb = std::move(job.verb);
    arguments = std::move(job.arguments);
}

nlohmann::json requestId(const std::string& line) {
    const nlohmann::json json = parseJsonOrNull(line);
    if (!json.is_object()) return nullptr;
    for (const char* const key : {"id", "cancel"})
        if (const auto found = json.find(key); found != json.end() && isId(*found)) return *found;
    return nullptr;
}

std::string helloLine(int jobs) {
    Json json;
    json["worker"] = kWorkerProtocol;
    json["version"] = PEELER_VERSION;
    json["jobs"] = jobs;
    return lineOf(json);
}

std::string resultLine(const nlohmann::json& id, const WorkerResult& result) {
    Json json;
    json["id"] = id;
    json["exitCode"] = result.exit_code;
    json["milliseconds"] = std::round(result.milliseconds * 1e3) / 1e3;
    if (!result.warnings.empty()) json["warnings"] = result.warnings;
    if (!result.result.is_null()) json["result"] = result.result;
    if (result.error) {
        const Error& error = *result.error;
        Json& found = json["error"];
        found["kind"] =
            result.error_kind.empty() ? std::string(kindName(error.kind())) : result.error_kind;
        found["what"] = error.what();
        if (!error.where().empty()) found["where"] = error.where();
        if (!error.hint().empty()) found["hint"] = error.hint();
        json["retry"] = isWorthRetrying(result);
    }
    return lineOf(json);
}

std::string progressLine(const nlohmann::json& id, const RunProgress& progress) {
    Json json;
    json["id"] = id;
    json["progress"] = std::round(progress.of_run * 1e4) / 1e4;
    json["stage"] = progress.stage;
    return lineOf(json);
}

}  // namespace peeler::cmd
