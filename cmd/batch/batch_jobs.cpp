// SPDX-License-Identifier: Apache-2.0
#include "cmd/batch/batch_jobs.h"

#include <algorithm>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <utility>

#include "cmd/cli/arguments.h"
#include "cmd/cli/choices.h"
#include "cmd/cli/command_line.h"
#include "cmd/cli/parse.h"
#include "cmd/options/frames.h"
#include "core/base/error.h"
#include "core/base/printable.h"
#include "formats/file/content_hash.h"
#include "formats/file/file_name.h"
#include "formats/file/json_text.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuseJob(const std::string& what, const std::string& where = "",
                            const std::string& hint = "see peeler batch --help") {
    throw Error(ErrorKind::kUsage, what, where, hint);
}

/// Parses a line like nlohmann::json::parse, but refuses keys that are alike, of which that takes
/// the last.
nlohmann::json parseLine(const std::string& line) {
    std::vector<std::set<std::string>> keys;
    const auto check = [&](int, nlohmann::json::parse_event_t event, nlohmann::json& parsed) {
        if (event == nlohmann::json::parse_event_t::object_start) keys.emplace_back();
        if (event == nlohmann::json::parse_event_t::object_end) keys.pop_back();
        if (event == nlohmann::json::parse_event_t::key && !keys.back().insert(parsed).second)
            refuseJob("a key is there twice", parsed.get<std::string>(), "leave one out");
        return true;
    };
    checkJsonDepth(line, "");
    try {
        return nlohmann::json::parse(line, check);
    } catch (const nlohmann::json::exception& error) {
        // "[json.exception.parse_error.101] parse error at line 1, column 5: …"
        const std::string text = error.what();
        const std::size_t column = text.find("column");
        refuseJob("this is not JSON",
                  column == std::string::npos ? text : printable(text.substr(column)),
                  "a job is one line: {\"verb\": \"render\", \"args\": [\"scene.glb\", \"-o\", "
                  "\"out.exr\"]}");
    }
}

/// Returns `text`. Throws Error (kUsage) if no process can be given it as an argument.
std::string argumentText(const std::string& text, const std::string& key) {
    if (text.find('\0') != std::string::npos)
        refuseJob("a null character cannot be passed on", key);
    return text;
}

std::string takeString(const nlohmann::json& value, const std::string& key) {
    if (!value.is_string()) refuseJob("expected a string", key);
    return argumentText(value, key);
}

// One reader for each key of a job.
void takeArguments(const nlohmann::json& value, Job& job) {
    if (!value.is_array()) refuseJob("expected an array of strings", "args");
    for (const nlohmann::json& argument : value)
        job.arguments.push_back(takeString(argument, "args"));
}

void takeOption(const std::string& name, const nlohmann::json& value, Job& job) {
    if (name.empty() || name.starts_with('-') || name.find('=') != std::string::npos)
        refuseJob("expected an option's long name without its dashes", "options/" + name);
    const std::string option = "--" + argumentText(name, "options");
    if (value.is_array()) {
        for (const nlohmann::json& each : value) {
            if (each.is_array()) refuseJob("expected no array in an array", "options/" + name);
            takeOption(name, each, job);
        }
    } else if (value.is_boolean()) {
        if (value.get<bool>()) job.arguments.push_back(option);
    } else if (value.is_string() || value.is_number()) {
        const std::string text = value.is_string() ? value.get<std::string>() : dumpJson(value);
        // In one piece: a value may begin with a dash.
        job.arguments.push_back(
            std::string(option).append("=").append(argumentText(text, "options/" + name)));
    } else {
        refuseJob("expected a string, a number, true, false or an array of them",
                  "options/" + name);
    }
}

void takeOptions(const nlohmann::json& value, Job& job) {
    if (!value.is_object()) refuseJob("expected an object", "options");
    for (const auto& [name, each] : value.items())
        takeOption(name, each, job);
}

struct JobKey {
    std::string_view name;
    void (*take)(const nlohmann::json& value, Job& job);
};
constexpr JobKey kJobKeys[] = {
    {"id",
     [](const nlohmann::json& value, Job& job) {
         job.id = takeString(value, "id");
         if (job.id.empty()) refuseJob("an id may not be empty", "id");
     }},
    {"verb", [](const nlohmann::json& value, Job& job) { job.verb = takeString(value, "verb"); }},
    {"args", takeArguments},
    {"options", takeOptions},
};

void takeKeys(const nlohmann::json& json, Job& job) {
    if (!json.is_object()) refuseJob("expected an object with a verb and its arguments");
    std::vector<std::string_view> names;
    for (const JobKey& key : kJobKeys)
        names.push_back(key.name);
    for (const auto& [name, value] : json.items()) {
        if (std::find(names.begin(), names.end(), name) == names.end())
            refuseName("key", name, names);
    }
    for (const JobKey& key : kJobKeys) {
        const auto entry = json.find(key.name);
        if (entry != json.end()) key.take(*entry, job);
    }
    if (job.verb.empty()) refuseJob("a key is missing", "verb");
}

const Verb& verbNamed(const std::string& name) {
    std::vector<std::string_view> names;
    for (const Verb& verb : verbs()) {
        if (verb.name == name) return verb;
        names.push_back(verb.name);
    }
    refuseName("verb", name, names);
}

/// A verb's arguments, read as the command line reads them and not carried out.
class ParsedVerb {
  public:
    /// Throws Error (kUsage) for arguments that the verb would refuse for their form, and for
    /// --help: there is nothing to carry out. Files are not looked at.
    ParsedVerb(const Verb& verb, const std::vector<std::string>& arguments)
        : options_(parser_.addVerb(std::string(verb.name), std::string(verb.summary))),
          action_(verb.declare(options_)) {
        std::vector<std::string> all{std::string(verb.name)};
        all.insert(all.end(), arguments.begin(), arguments.end());
        if (parser_.parse(all) != Asked::kVerb)
            throw Error(ErrorKind::kUsage, "there is nothing to do", "--help", "leave it out");
    }

    /// Which options the verb has, and what is given.
    const VerbOptions& options() const { return options_; }

  private:
    ArgumentParser parser_;
    VerbOptions options_;
    VerbAction action_;  ///< owns what the options are stored in
};

/// An option that names a file that is written, of one verb or ("") of all.
struct WritingOption {
    std::string_view verb;
    const char* option;
};
constexpr WritingOption kWritingOptions[] = {
    {"", "--output"},        {"", "--manifest"},
    {"", "--report"},        {"extract", "--depth-complexity"},
    {"extract", "--points"}, {"extract", "--npz"},
};

bool isShards(const fs::path& output) {
    return lowerExtension(output) == ".tar";
}

/// Turns an output with a place for the frame's number into the outputs of all frames. The numbers
/// of shards are not known.
void nameFrames(const std::string& list, const Shard& chunk, Job& job) {
    const std::vector<int> frames = parseFrames(list);
    const auto [first, end] = chunk.of(frames.size());
    std::vector<fs::path> files;
    for (const fs::path& output : job.outputs) {
        if (!hasFrameToken(output.string()) || isShards(output)) {
            files.push_back(output);
            continue;
        }
        for (std::size_t i = first; i < end; ++i)
            files.emplace_back(framePath(output.string(), frames[i]));
    }
    job.outputs = std::move(files);
}

Shard chunkOf(const VerbOptions& options) {
    const bool given = options.knows("--chunk") && options.given("--chunk");
    return given ? parseShard(options.value("--chunk")) : Shard();
}

/// Reads the arguments as the verb does, and fills in what the batch has to know of them.
void readArguments(Job& job) {
    if (job.verb == "batch") refuseJob("a batch in a batch", job.verb, "put its jobs here");
    const ParsedVerb parsed(verbNamed(job.verb), job.arguments);
    const VerbOptions& options = parsed.options();
    if (!options.knows("--output"))
        refuseJob("this verb writes no file", job.verb, "run it by itself");
    for (const WritingOption& row : kWritingOptions) {
        if (!row.verb.empty() && row.verb != job.verb) continue;
        if (options.given(row.option)) job.outputs.emplace_back(options.value(row.option));
    }
    if (job.outputs.empty()) refuseJob("no output is given", job.verb, "add --output");
    for (fs::path& output : job.outputs)
        if (isShards(output)) output = chunkName(output.string(), chunkOf(options));
    const auto leaves = [&](const char* option) {
        return options.knows(option) && !options.given(option);
    };
    job.wants_json = leaves("--json");
    job.wants_quiet = leaves("--quiet");
    job.wants_threads = leaves("--threads");
    job.wants_memory = leaves("--memory");
    if (options.knows("--frames") && options.given("--frames"))
        nameFrames(options.value("--frames"), chunkOf(options), job);
}

Job readJob(const std::string& line) {
    nlohmann::json json = parseLine(line);
    Job job;
    takeKeys(json, job);
    readArguments(job);
    json.erase("id");
    job.hash = hashText(dumpJson(json));
    return job;
}

}  // namespace

std::vector<Job> readJobs(const std::string& name, const std::string& text) {
    std::vector<Job> jobs;
    std::map<std::string, std::size_t> ids;
    std::map<std::string, std::size_t> outputs;
    const auto unique = [](auto& known, const std::string& key, std::size_t line,
                           const std::string& what, const std::string& where) {
        const auto [entry, added] = known.emplace(key, line);
        if (!added)
            refuseJob(what + " of line " + std::to_string(entry->second), where, "choose another");
    };
    std::istringstream lines(text);
    std::size_t number = 0;
    for (std::string line; std::getline(lines, line);) {
        ++number;
        if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
        try {
            Job job = readJob(line);
            job.line = number;
            if (!job.id.empty()) unique(ids, job.id, number, "this is the id", job.id);
            for (const fs::path& output : job.outputs) {
                const std::string file = fs::absolute(output).lexically_normal().string();
                unique(outputs, file, number, "this is an output", output.string());
            }
            jobs.push_back(std::move(job));
        } catch (const Error& error) {
            const std::string place = name + ", line " + std::to_string(number);
            throw Error(error.kind(), error.what(),
                        error.where().empty() ? place : place + ": " + error.where(), error.hint());
        }
    }
    return jobs;
}

}  // namespace peeler::cmd
