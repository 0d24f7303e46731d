// SPDX-License-Identifier: Apache-2.0
// The results of a batch, a line a job, on disk as soon as the job has ended.
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cmd/batch/batch_jobs.h"
#include "cmd/machine/child_process.h"

namespace peeler::cmd {

/// The line of a job whose process has ended:
///
///     {"job": 1, "id": "front", "verb": "render", "hash": …, "exitCode": 0, "milliseconds": 812,
///      "warnings": […], "result": what the verb's --json says}
///
/// or with an exit code that is not 0, 128 + n for signal n, and "error": {"what": …, "hint": …} in
/// place of the result. `number` counts from 1.
nlohmann::ordered_json resultLine(std::size_t number, const Job& job, const ChildProcess& process);

/// A file of result lines that outlives the batch, however it ends. While jobs run their lines are
/// added in the order in which they end; finish() puts them into the order of the jobs. Lines of
/// other jobs stay. Only one batch at a time can have it open.
class BatchReport {
  public:
    /// Opens or makes the file and reads it. The rest of a line that was being written when a batch
    /// was killed is taken off. Throws Error (kUsage) if the file holds anything but results, and
    /// leaves it as it is; (kOutput) if it cannot be opened or another batch has it.
    explicit BatchReport(std::filesystem::path path);
    ~BatchReport();
    BatchReport(const BatchReport&) = delete;
    BatchReport& operator=(const BatchReport&) = delete;

    /// The results that were in the file.
    const std::vector<nlohmann::ordered_json>& lines() const { return lines_; }

    /// Writes a line at once. Throws Error (kOutput).
    void add(const nlohmann::ordered_json& line);

    /// Replaces the file by the lines of other jobs, and `lines`. Throws Error (kOutput).
    void finish(const std::vector<nlohmann::ordered_json>& lines);

  private:
    void open();
    void readLines();

    std::filesystem::path path_;
    int file_ = -1;
    std::vector<nlohmann::ordered_json> lines_;
};

/// A result as one line with a newline at its end; bytes that are not UTF-8 are replaced.
std::string lineText(const nlohmann::ordered_json& line);

/// Reads the results of an earlier batch; none if there is no such file. `whole`, unless null,
/// receives how many bytes are whole lines. Throws Error (kUsage) if the file holds anything else.
std::vector<nlohmann::ordered_json> readBatchReport(const std::filesystem::path& path,
                                                    std::size_t* whole = nullptr);

}  // namespace peeler::cmd
