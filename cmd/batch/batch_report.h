// SPDX-License-Identifier: Apache-2.0
// The results of peeler batch: a line a job, on disk as soon as the job has ended.
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
/// other jobs stay. One batch at a time has it.
class BatchReport {
  public:
    /// Opens or makes the file and reads it. The rest of a line that was being written when a batch
    /// was killed is taken off. Throws Error (kUsage) if it holds anything but results (it is left
    /// as it is), (kOutput) if it cannot be opened or another batch has it.
    explicit BatchReport(std::filesystem::path path);
    ~BatchReport();
    BatchReport(const BatchReport&) = delete;
    BatchReport& operator=(const BatchReport&) = delete;

    /// What was in it.
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

/// A result as one line, with its end; bytes that are not UTF-8 replaced.
std::string lineText(const nlohmann::ordered_json& line);

/// The results of an earlier batch, read only; none if there is no such file. `whole` is how many
/// bytes are whole lines. Throws Error (kUsage) if it holds anything else.
std::vector<nlohmann::ordered_json> readBatchReport(const std::filesystem::path& path,
                                                    std::size_t* whole = nullptr);

}  // namespace peeler::cmd
