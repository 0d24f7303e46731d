// SPDX-License-Identifier: Apache-2.0
#include "cmd/batch/batch_jobs.h"

#include <algorithm>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <utility>

#include <peeler/error.h>
#include "cmd/cli/job_line.h"
#include "cmd/cli/parse.h"
#include "cmd/cli/parsed_verb.h"
#include "cmd/options/frames.h"
#include "core/base/printable.h"
#include "formats/file/content_hash.h"
#include "formats/file/file_name.h"
#include "formats/file/json_text.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

constexpr const char* kHelp = "see peeler batch --help";

[[noreturn]] void refuseJob(const std::string& what, const std::string& where = "",
                            const std::string& hint = kHelp) {
    throw Error(ErrorKind::kUsage, what, where, hint);
}

constexpr std::string_view kMoreKeys[] = {"id"};

/// An option that names an output file. The verb "" means all verbs.
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

/// Replaces each output that has a frame-number pattern by one output per frame. Shards keep their
/// pattern, because the number of shards is unknown.
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

/// Parses the arguments like the verb does, and fills in the remaining fields of the job.
void readArguments(Job& job) {
    if (job.verb == "batch")
        refuseJob("a batch cannot run a batch", job.verb, "put its jobs into this file");
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
    JobLine read(line, kMoreKeys, kHelp);
    nlohmann::json& json = read.json;
    Job job;
    if (const auto id = json.find("id"); id != json.end()) {
        if (!id->is_string()) refuseJob("expected a string", "id");
        job.id = id->get<std::string>();
        if (job.id.empty()) refuseJob("the id is empty", "id");
    }
    job.verb = std::move(read.verb);
    job.arguments = std::move(read.arguments);
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
            refuseJob("line " + std::to_string(entry->second) + " already " + what, where,
                      "choose another");
    };
    std::istringstream lines(text);
    std::size_t number = 0;
    for (std::string line; std::getline(lines, line);) {
        ++number;
        if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
        try {
            Job job = readJob(line);
            job.line = number;
            if (!job.id.empty()) unique(ids, job.id, number, "has this id", job.id);
            for (const fs::path& output : job.outputs) {
                const std::string file = fs::absolute(output).lexically_normal().string();
                unique(outputs, file, number, "writes this output", output.string());
            }
            jobs.push_back(std::move(job));
        } catch (const Error& error) {
            const std::string place = name + ", line " + std::to_string(number);
            throw error.at(error.where().empty() ? place : place + ": " + error.whereText());
        }
    }
    return jobs;
}

}  // namespace peeler::cmd
