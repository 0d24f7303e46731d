// SPDX-License-Identifier: Apache-2.0
// peeler batch: runs the jobs in a file, each in its own process, several in parallel.
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <list>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>

#include <peeler/error.h>
#include "cmd/batch/batch_jobs.h"
#include "cmd/batch/batch_report.h"
#include "cmd/cli/arguments.h"
#include "cmd/cli/parse.h"
#include "cmd/cli/report.h"
#include "cmd/machine/child_process.h"
#include "cmd/machine/resources.h"
#include "cmd/options/capture_options.h"
#include "cmd/options/output_checks.h"
#include "cmd/options/output_options.h"
#include "cmd/session/progress_report.h"
#include "cmd/session/session.h"
#include "cmd/verbs.h"
#include "core/base/memory_budget.h"
#include "formats/file/file_name.h"
#include "formats/file/regular_file.h"

namespace peeler::cmd {

namespace {

namespace fs = std::filesystem;

struct BatchOptions {
    fs::path file;  ///< "-" = stdin
    int jobs = 1;
    bool fail_fast = false;
    bool dry_run = false;
    int threads = 0;
    MemoryBudget memory;
    ReportOptions report;  ///< without `json`, because results are always JSON
};

/// A batch, from reading the job file to the last result. Jobs start only after the whole file has
/// been checked.
class Batch {
  public:
    Batch(const BatchOptions& options, Reporter& reporter)
        : options_(options), reporter_(reporter) {}
    int run();

  private:
    struct Running {
        std::size_t job;
        ChildProcess process;
    };

    void readFile();
    void openReport();
    void takeEarlierResults(const std::vector<Json>& lines);
    void share();
    std::vector<std::string> commandOf(const Job& job) const;
    void printPlan();
    void runJobs();
    void startJobs();
    void wait();
    void takeSignals();
    void takeEnded();
    [[noreturn]] void endBySignal(int number);
    void finish(const Running& running);
    void store(std::size_t job, Json result);
    void printInOrder();

    const BatchOptions& options_;
    Reporter& reporter_;
    std::vector<Job> jobs_;
    std::optional<BatchReport> report_;
    std::vector<std::optional<Json>> results_;  ///< one per job
    std::size_t printed_ = 0, done_ = 0, next_ = 0;
    int worst_ = 0;
    int threads_ = 0;  ///< threads for each job without --threads; 0 = the verb's default
    /// Memory limit for each job without --memory, bytes; 0 = the verb's default.
    std::uint64_t memory_ = 0;
    std::optional<SignalFile> signals_;
    std::list<Running> running_;
    std::optional<ProgressReport> progress_;
};

/// Whether all outputs of a job exist. A name with a number pattern is taken to exist, because the
/// number of its files is unknown.
bool outputsExist(const Job& job) {
    return std::ranges::all_of(job.outputs, [](const fs::path& output) {
        return hasFrameToken(output.string()) || fileExists(output, ErrorKind::kOutput);
    });
}

/// Thrown to end the batch, after a signal has ended its jobs.
struct EndedBySignal {
    int number;
};

int Batch::run() {
    options_.report.applyTo(reporter_);
    readFile();
    share();
    if (options_.dry_run) {
        if (options_.report.file) takeEarlierResults(readBatchReport(*options_.report.file));
        printPlan();
        return 0;
    }
    openReport();
    try {
        runJobs();
    } catch (const EndedBySignal& ended) {
        return 128 + ended.number;
    }
    return worst_;
}

void Batch::readFile() {
    std::string text;
    if (options_.file == "-") {
        text.assign(std::istreambuf_iterator<char>(std::cin), {});
    } else {
        try {
            text = readRegularText(options_.file);
        } catch (const Error& problem) {
            throw Error(problem.kind(), "cannot read the jobs: " + problem.whatText(),
                        options_.file.string(),
                        "give a file with one job per line, as in peeler batch --help, or - for "
                        "standard input");
        }
        const FileKind kind = fileKind(options_.file.string());
        if (kind != FileKind::kUnknown && !text.starts_with('{'))
            throw Error(ErrorKind::kInput, "this is a scene or a picture, not a list of jobs",
                        options_.file.string(),
                        "give a file with one job per line, as in peeler batch --help");
    }
    jobs_ = readJobs(options_.file == "-" ? "standard input" : options_.file.string(), text);
    results_.resize(jobs_.size());
}

void Batch::openReport() {
    if (!options_.report.file) return;
    std::vector<fs::path> others{options_.file};
    for (const Job& job : jobs_)
        others.insert(others.end(), job.outputs.begin(), job.outputs.end());
    checkExtraFile(*options_.report.file, others, "the report", "--report");
    report_.emplace(*options_.report.file);
    takeEarlierResults(report_->lines());
}

/// Reuses the results of jobs that succeeded in an earlier batch, if their outputs still exist.
/// These jobs do not run again.
void Batch::takeEarlierResults(const std::vector<Json>& lines) {
    std::map<std::string, const Json*> last;
    std::set<std::string> ids;
    for (const Json& line : lines) {
        last[line["hash"]] = &line;
        if (const auto id = line.find("id"); id != line.end() && id->is_string())
            ids.insert(id->get<std::string>());
    }
    for (std::size_t i = 0; i < jobs_.size(); ++i) {
        const auto again = [&](const char* why) {
            reporter_.note("job " + std::to_string(i + 1) +
                           (jobs_[i].id.empty() ? "" : " (" + jobs_[i].id + ")") +
                           " runs again: " + why);
        };
        const auto earlier = last.find(jobs_[i].hash);
        if (earlier == last.end()) {
            if (ids.contains(jobs_[i].id)) again("its line has changed");
            continue;
        }
        if ((*earlier->second)["exitCode"] != 0) continue;
        if (!outputsExist(jobs_[i])) {
            again("its output is missing");
            continue;
        }
        results_[i] = *earlier->second;
        (*results_[i])["job"] = i + 1;
        ++done_;
    }
    if (done_ > 0) {
        reporter_.note("done already: " + groupedText(done_) + " of " +
                       countText(jobs_.size(), "job"));
    }
}

/// Divides threads and memory equally among concurrent jobs. Throws Error (kMemory) if a job gets
/// less than kLeastMemory.
void Batch::share() {
    const auto parts = static_cast<std::uint64_t>(std::clamp<std::size_t>(jobs_.size(), 1, 1024));
    const std::uint64_t jobs = std::min(parts, static_cast<std::uint64_t>(options_.jobs));
    const auto threads = options_.threads > 0 ? static_cast<std::uint64_t>(options_.threads)
                                              : allowedThreads().amount;
    if (jobs > 1 || options_.threads > 0)
        threads_ = static_cast<int>(std::max<std::uint64_t>(1, threads / jobs));
    // A single job reads an inherited limit itself, to report the limit's source.
    if (jobs > 1 || options_.memory.source.empty()) memory_ = options_.memory / jobs;
    if (memory_ != 0 && memory_ < kLeastMemory) {
        throw Error(ErrorKind::kMemory,
                    "the memory budget of " + mebibytesText(options_.memory) + " leaves only " +
                        mebibytesText(memory_) + " for each of " + std::to_string(jobs) + " jobs",
                    options_.memory.where(), "run fewer jobs at a time with --jobs");
    }
}

std::vector<std::string> Batch::commandOf(const Job& job) const {
    std::vector<std::string> command{job.verb};
    command.insert(command.end(), job.arguments.begin(), job.arguments.end());
    if (job.wants_json) command.emplace_back("--json");
    if (job.wants_quiet) command.emplace_back("--quiet");
    if (job.wants_threads && threads_ > 0)
        command.insert(command.end(), {"--threads", std::to_string(threads_)});
    if (job.wants_memory && memory_ > 0)
        command.insert(command.end(), {"--memory", std::to_string(memory_)});
    return command;
}

void Batch::printPlan() {
    for (std::size_t i = 0; i < jobs_.size(); ++i) {
        Json line;
        line["job"] = i + 1;
        if (!jobs_[i].id.empty()) line["id"] = jobs_[i].id;
        line["verb"] = jobs_[i].verb;
        line["hash"] = jobs_[i].hash;
        line["done"] = results_[i].has_value();
        line["command"] = {"peeler"};
        for (const std::string& argument : commandOf(jobs_[i]))
            line["command"].push_back(argument);
        reporter_.text(lineText(line));
    }
}

void Batch::runJobs() {
    signals_.emplace();
    progress_.emplace(reporter_, "batch");
    printInOrder();
    while (true) {
        startJobs();
        if (running_.empty()) break;
        wait();
        takeSignals();
        takeEnded();
    }
    progress_.reset();
    std::vector<Json> lines;
    for (const auto& result : results_)
        if (result) lines.push_back(*result);
    // Prints the remaining results: printInOrder() has stopped at the first job that --fail-fast
    // skipped.
    for (std::size_t i = printed_; i < results_.size(); ++i)
        if (results_[i]) reporter_.text(lineText(*results_[i]));
    if (report_) report_->finish(lines);
}

void Batch::startJobs() {
    while (next_ < jobs_.size() && running_.size() < static_cast<std::size_t>(options_.jobs)) {
        if (options_.fail_fast && worst_ != 0) return;
        const std::size_t job = next_++;
        if (results_[job]) continue;
        running_.push_back({job, ChildProcess(commandOf(jobs_[job]))});
    }
}

void Batch::wait() {
    std::vector<pollfd> files{{signals_->file(), POLLIN, 0}};
    for (const Running& running : running_) {
        // A process that has closed a file has the descriptor −1, which poll() ignores.
        files.push_back({running.process.outFile(), POLLIN, 0});
        files.push_back({running.process.errFile(), POLLIN, 0});
    }
    // A signal (EINTR) needs no treatment, because all files are read afterwards.
    poll(files.data(), files.size(), -1);
}

void Batch::takeSignals() {
    while (const int number = signals_->take())
        if (number != SIGCHLD) endBySignal(number);
}

void Batch::takeEnded() {
    for (auto running = running_.begin(); running != running_.end();) {
        running->process.read();
        if (!running->process.ended()) {
            ++running;
            continue;
        }
        finish(*running);
        running = running_.erase(running);
    }
}

/// Forwards a signal to the jobs, which remove their temporary files and end. Kills jobs that take
/// too long.
void Batch::endBySignal(int number) {
    using namespace std::chrono_literals;
    takeEnded();
    const struct {
        int signal;
        std::chrono::milliseconds patience;
    } steps[] = {{number == SIGHUP ? SIGTERM : number, 700ms}, {SIGKILL, 200ms}};
    for (const auto& [signal, patience] : steps) {
        const auto until = std::chrono::steady_clock::now() + patience;
        for (const Running& running : running_)
            running.process.signal(signal);
        while (!running_.empty() && std::chrono::steady_clock::now() < until) {
            pollfd file{signals_->file(), POLLIN, 0};
            poll(&file, 1, 20);
            while (signals_->take() != 0) {
            }
            for (Running& running : running_)
                running.process.read();
            std::erase_if(running_, [](Running& running) { return running.process.ended(); });
        }
    }
    // A process that survives SIGKILL hangs in the kernel. Do not wait for it.
    for (Running& running : running_)
        running.process.abandon();
    running_.clear();
    throw EndedBySignal{number};
}

void Batch::finish(const Running& running) {
    const Job& job = jobs_[running.job];
    Json line = resultLine(running.job + 1, job, running.process);
    const std::string name = "job " + std::to_string(running.job + 1) +
                             (job.id.empty() ? "" : " (" + job.id + ")") + ": ";
    if (line.contains("warnings")) {
        for (const auto& warning : line["warnings"])
            reporter_.warning(name + warning.get<std::string>());
    }
    if (line.contains("error")) {
        std::istringstream errors(line["error"]["what"].get<std::string>());
        for (std::string error; std::getline(errors, error);)
            reporter_.error(name + error);
    }
    store(running.job, std::move(line));
}

void Batch::store(std::size_t job, Json result) {
    worst_ = std::max(worst_, result["exitCode"].get<int>());
    if (report_) report_->add(result);
    results_[job] = std::move(result);
    ++done_;
    progress_->update(static_cast<double>(done_) / static_cast<double>(jobs_.size()));
    printInOrder();
}

void Batch::printInOrder() {
    for (; printed_ < results_.size() && results_[printed_]; ++printed_)
        reporter_.text(lineText(*results_[printed_]));
}

}  // namespace

VerbAction declareBatch(VerbOptions& verb) {
    const auto options = std::make_shared<BatchOptions>();
    addFile(verb, "JOBS", "", options->file,
            "file with one job per line, or - for standard input: {\"verb\": \"render\", \"args\": "
            "[\"scene.glb\", \"-o\", \"out.exr\"], \"options\": {\"size\": \"640x360\", "
            "\"shadows\": true}, \"id\": \"first\"}; args, options and id are optional; verb is "
            "any verb with --output; ids are unique strings; jobs do not depend on each other; the "
            "results are JSON lines on stdout, in the order of the jobs")
        .required();
    addValue(
        verb, "--jobs", "N", options->jobs,
        [](const std::string& text) { return static_cast<int>(parseInteger(text, 1, 1024)); },
        "number of jobs that run at the same time, each in a process with its share of the threads "
        "and the memory (default: 1)")
        .group("Jobs");
    addFile(verb, "--report", "FILE", options->report.file,
            "also write the results to a file; with the same file, the next run skips jobs that "
            "are done and whose output exists")
        .group("Jobs");
    verb.addFlag("--fail-fast", options->fail_fast,
                 "start no further jobs after one fails (default: run all; the exit code is the "
                 "highest of all)")
        .group("Jobs");
    verb.addFlag("--dry-run", options->dry_run,
                 "print the commands of all jobs as JSON lines, and run none")
        .group("Jobs");
    addThreadsOption(verb, options->threads);
    addMemoryOption(verb, options->memory, "for all jobs together");
    addChoice<ProgressStyle>(verb, "--progress", options->report.progress, kProgressStyles,
                             "progress style", "style of progress reports on stderr:")
        .group("Messages");
    verb.addFlag("-q,--quiet", options->report.quiet, "print warnings and errors only")
        .group("Messages");
    return [options](Session& session) { return Batch(*options, session.reporter()).run(); };
}

}  // namespace peeler::cmd
