// SPDX-License-Identifier: Apache-2.0
// Batch results, one line per job, written as soon as the job ends.
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
/// or, if the exit code is not 0 (128 + n for signal n), "error": {"what": …, "hint": …} instead
/// of the result. `number` counts from 1.
nlohmann::ordered_json resultLine(std::size_t number, const Job& job, const ChildProcess& process);

/// A file of result lines that survives any end of the batch. Lines are appended as jobs end;
/// finish() sorts them into job order. Lines of other jobs stay. Only one batch at a time can open
/// it.
class BatchReport {
  public:
    /// Opens or creates the file and reads it. Truncates a partial last line left by a killed
    /// batch. Throws Error (kUsage) if the file holds anything but results, and leaves it
    /// unchanged; Error (kOutput) if it cannot be opened or another batch has it open.
    explicit BatchReport(std::filesystem::path path);
    ~BatchReport();
    BatchReport(const BatchReport&) = delete;
    BatchReport& operator=(const BatchReport&) = delete;

    /// Returns the results that were in the file.
    const std::vector<nlohmann::ordered_json>& lines() const { return lines_; }

    /// Writes a line immediately. Throws Error (kOutput) if writing fails.
    void add(const nlohmann::ordered_json& line);

    /// Replaces the file's content by the lines of other jobs and `lines`. Throws Error (kOutput)
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
/// else.
std::vector<nlohmann::ordered_json> readBatchReport(const std::filesystem::path& path,
                                                    std::size_t* whole = nullptr);

}  // namespace peeler::cmd
