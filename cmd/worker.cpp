// SPDX-License-Identifier: Apache-2.0
// peeler worker: a long-lived process that reads jobs and writes results, one per line.
#include <algorithm>
#include <memory>
#include <optional>

#include <peeler/error.h>
#include "cmd/cli/arguments.h"
#include "cmd/cli/parse.h"
#include "cmd/machine/resources.h"
#include "cmd/options/capture_options.h"
#include "cmd/options/output_options.h"
#include "cmd/verbs.h"
#include "cmd/worker/dispatcher.h"
#include "core/base/memory_budget.h"

namespace peeler::cmd {

namespace {

struct WorkerOptions {
    std::optional<std::filesystem::path> socket;
    int jobs = 1;
    int threads = 0;
    MemoryBudget memory;
    std::optional<std::uint64_t> keep;
};

/// Returns the limits of each process: equal shares of threads and memory.
JobLimits shareOf(const WorkerOptions& options) {
    const auto jobs = static_cast<std::uint64_t>(options.jobs);
    JobLimits limits;
    const auto threads =
        options.threads > 0 ? static_cast<std::uint64_t>(options.threads) : allowedThreads().amount;
    limits.threads = static_cast<int>(std::max<std::uint64_t>(1, threads / jobs));
    limits.memory = options.memory / jobs;
    if (limits.memory != 0 && limits.memory < kLeastMemory)
        throw Error(ErrorKind::kMemory,
                    "the memory budget of " + mebibytesText(options.memory) + " leaves only " +
                        mebibytesText(limits.memory) + " for each of " + std::to_string(jobs) +
                        " jobs",
                    options.memory.where(), "run fewer jobs at a time with --jobs");
    constexpr std::uint64_t kKept = std::uint64_t{2} << 30;
    const std::uint64_t keep =
        options.keep.value_or(limits.memory == 0 ? kKept * jobs : limits.memory / 4 * jobs);
    limits.keep = keep / jobs;
    return limits;
}

}  // namespace

VerbAction declareWorker(VerbOptions& verb) {
    const auto options = std::make_shared<WorkerOptions>();
    addFile(verb, "--listen", "PATH", options->socket,
            "accept clients on a Unix socket of this name, for the current user only (mode 600) "
            "(default: one client, on stdin and stdout)")
        .group("Jobs");
    addValue(
        verb, "--jobs", "N", options->jobs,
        [](const std::string& text) { return static_cast<int>(parseInteger(text, 1, 1024)); },
        "number of jobs that run at the same time, each in a process with its share of the threads "
        "and the memory (default: 1)")
        .group("Jobs");
    addValue(verb, "--keep", "SIZE", options->keep, parseBytes,
             "memory limit for scenes that stay open between jobs, for all processes together; 0 "
             "keeps none (default: a quarter of --memory, else 2G per process)")
        .group("Jobs");
    addThreadsOption(verb, options->threads);
    addMemoryOption(verb, options->memory, "for all jobs together");
    verb.footer(
        "A job is a JSON line on stdin; its result is a JSON line on stdout with the same id:\n"
        "  {\"id\": 7, \"verb\": \"render\", \"args\": [\"scene.glb\", \"-o\", \"out.exr\"],\n"
        "   \"options\": {\"size\": \"640x360\"}, \"progress\": true}\n"
        "  {\"cancel\": 7}\n"
        "The protocol is in cmd/README.md, \"The worker\".");
    return [options](Session&) {
        DispatcherOptions wanted;
        wanted.jobs = options->jobs;
        wanted.process = shareOf(*options);
        wanted.socket = options->socket;
        return Dispatcher(wanted).run();
    };
}

}  // namespace peeler::cmd
