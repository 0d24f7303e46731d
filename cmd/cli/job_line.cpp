// SPDX-License-Identifier: Apache-2.0
#include "cmd/cli/job_line.h"

#include <algorithm>
#include <set>
#include <utility>

#include <peeler/error.h>
#include "cmd/session/choices.h"
#include "core/base/printable.h"
#include "formats/file/json_text.h"

namespace peeler::cmd {

namespace {

/// Throws Error (kUsage). The constructor of JobLine adds a hint to errors without one.
[[noreturn]] void refuseLine(const std::string& what, const std::string& where = "",
                             const std::string& hint = "") {
    throw Error(ErrorKind::kUsage, what, where, hint);
}

/// Parses a line. Unlike nlohmann::json::parse(), refuses duplicate keys.
nlohmann::json parseLine(const std::string& line) {
    std::vector<std::set<std::string>> keys;
    const auto check = [&](int, nlohmann::json::parse_event_t event, nlohmann::json& parsed) {
        if (event == nlohmann::json::parse_event_t::object_start) keys.emplace_back();
        if (event == nlohmann::json::parse_event_t::object_end) keys.pop_back();
        if (event == nlohmann::json::parse_event_t::key && !keys.back().insert(parsed).second)
            refuseLine("duplicate key", parsed.get<std::string>(), "leave one out");
        return true;
    };
    checkJsonDepth(line, "");
    try {
        return nlohmann::json::parse(line, check);
    } catch (const nlohmann::json::exception& error) {
        // Keeps only "column 5: …" of "[json.exception.parse_error.101] parse error at line 1,
        // column 5: …".
        const std::string text = error.what();
        const std::size_t column = text.find("column");
        refuseLine("this is not JSON",
                   column == std::string::npos ? text : printable(text.substr(column)),
                   "write each job on one line: {\"verb\": \"render\", \"args\": [\"scene.glb\", "
                   "\"-o\", \"out.exr\"]}");
    }
}

/// Returns `text`. Throws Error (kUsage) if `text` cannot be a process argument.
std::string argumentText(const std::string& text, const std::string& key) {
    if (text.find('\0') != std::string::npos) refuseLine("a string contains a null character", key);
    return text;
}

std::string takeString(const nlohmann::json& value, const std::string& key) {
    if (!value.is_string()) refuseLine("expected a string", key);
    return argumentText(value, key);
}

void takeArguments(const nlohmann::json& value, JobLine& job) {
    if (!value.is_array()) refuseLine("expected an array of strings", "args");
    for (const nlohmann::json& argument : value)
        job.arguments.push_back(takeString(argument, "args"));
}

void takeOption(const std::string& name, const nlohmann::json& value, JobLine& job) {
    if (name.empty() || name.starts_with('-') || name.find('=') != std::string::npos)
        refuseLine("expected an option's long name without its dashes", "options/" + name);
    const std::string option = "--" + argumentText(name, "options");
    if (value.is_array()) {
        for (const nlohmann::json& each : value) {
            if (each.is_array()) refuseLine("arrays cannot be nested", "options/" + name);
            takeOption(name, each, job);
        }
    } else if (value.is_boolean()) {
        if (value.get<bool>()) job.arguments.push_back(option);
    } else if (value.is_string() || value.is_number()) {
        const std::string text = value.is_string() ? value.get<std::string>() : dumpJson(value);
        // A single argument "--name=value", because a value may begin with a dash.
        job.arguments.push_back(
            std::string(option).append("=").append(argumentText(text, "options/" + name)));
    } else {
        refuseLine("expected a string, a number, true, false or an array of them",
                   "options/" + name);
    }
}

void takeOptions(const nlohmann::json& value, JobLine& job) {
    if (!value.is_object()) refuseLine("expected an object", "options");
    for (const auto& [name, each] : value.items())
        takeOption(name, each, job);
}

void takeKeys(std::span<const std::string_view> more_keys, JobLine& job) {
    if (!job.json.is_object()) refuseLine("expected an object with a verb and its arguments");
    std::vector<std::string_view> names{"verb", "args", "options"};
    names.insert(names.begin(), more_keys.begin(), more_keys.end());
    for (const auto& [name, value] : job.json.items()) {
        if (std::ranges::find(names, name) == names.end()) refuseName("key", name, names);
    }
    const auto take = [&](const char* name, auto&& taken_by) {
        const auto entry = job.json.find(name);
        if (entry != job.json.end()) taken_by(*entry);
    };
    take("verb", [&](const nlohmann::json& value) { job.verb = takeString(value, "verb"); });
    take("args", [&](const nlohmann::json& value) { takeArguments(value, job); });
    take("options", [&](const nlohmann::json& value) { takeOptions(value, job); });
    if (job.verb.empty()) refuseLine("a key is missing", "verb");
}

}  // namespace

JobLine::JobLine(const std::string& line, std::span<const std::string_view> more_keys,
                 const std::string& help) {
    try {
        json = parseLine(line);
        takeKeys(more_keys, *this);
    } catch (const Error& error) {
        if (!error.hint().empty()) throw;
        throw Error(error.kind(), error.whatText(), error.whereText(), help);
    }
}

}  // namespace peeler::cmd
