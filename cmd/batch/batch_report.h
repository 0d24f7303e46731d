// SPDX-License-Identifier: Apache-2.0
// Batch results, one line per job. Each line is written as soon as the job ends.
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cmd/batch/batch_jobs.h"
#include "cmd/machine/child_process.h"

namespace peeler::cmd {

/// Returns the result line of a job whose process has ended:
///
///     {"job": 1, "id": "front", "verb": "render", "hash": …, "exitCode": 0, "milliseconds": 812,
///      "warnings": […], "result": the verb's --json output}
///
/// or, if the exit code is not 0 (128 + n for signal n), with "error": {"what": …, "hint": …}
/// instead of the result. `number` is the job's number, from 1.
nlohmann::ordered_json resultLine(std::size_t number, const Job& job, const ChildProcess& process);

/// A file of result lines that stays valid even if the batch is killed. Lines are appended as jobs
/// end; finish() sorts them into job order and keeps the lines of other batches. Only one batch at
/// a time can open the file.
class BatchReport {
  public:
    /// Opens or creates the file and reads it. Removes the partial last line that a killed batch
    /// may have left. Throws Error (kUsage), without changing the file, if it holds anything but
    /// results. Throws Error (kOutput) if the file cannot be opened or another batch has it open.
    explicit BatchReport(std::filesystem::path path);
    ~BatchReport();
    BatchReport(const BatchReport&) = delete;
    BatchReport& operator=(const BatchReport&) = delete;

    /// Returns the results that were in the file when it was opened.
    const std::vector<nlohmann::ordered_json>& lines() const { return lines_; }

    /// Writes a line immediately. Throws Error (kOutput) if writing fails.
    void add(const nlohmann::ordered_json& line);

    /// Rewrites the file: the results of other batches, followed by `lines`. Throws Error (kOutput)
    /// if writing fails.
    void finish(const std::vector<nlohmann::ordered_json>& lines);

  private:
    void open();
    void readLines();

    std::filesystem::path path_;
    int file_ = -1;
    std::vector<nlohmann::ordered_json> lines_;
};

/// Returns a result as one line with a final newline; invalid UTF-8 is replaced.
std::string lineText(const nlohmann::ordered_json& line);

/// Reads the results of an earlier batch; empty if the file does not exist. `whole`, unless null,
/// receives the number of bytes in complete lines. Throws Error (kUsage) if the file holds anything
/// but results.
std::vector<nlohmann::ordered_json> readBatchReport(const std::filesystem::path& path,
                                                    std::size_t* whole = nullptr);

}  // namespace peeler::cmd
