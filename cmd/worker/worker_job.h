// SPDX-License-Identifier: Apache-2.0
// The lines of the worker protocol (cmd/README.md, "The worker").
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include <peeler/error.h>
#include "cmd/session/reporter.h"

namespace peeler::cmd {

/// The protocol version, sent in a worker's first line. Incremented by every incompatible change.
inline constexpr int kWorkerProtocol = 1;

/// The exit code of a cancelled job, the same as after Ctrl-C.
inline constexpr int kCancelledCode = 130;

/// A line from a client: a job, or a request to cancel one.
struct WorkerRequest {
    /// Parses a line. Throws Error (kUsage) if it is neither a job nor a cancellation. Does not
    /// check the verb's options.
    explicit WorkerRequest(const std::string& line);

    nlohmann::json id;  ///< id of the job, a string or an integer
    bool cancels = false;
    bool wants_progress = false;
    std::string verb{};
    std::vector<std::string> arguments{};
};

/// Returns the id of an invalid request, or null if the id cannot be read.
nlohmann::json requestId(const std::string& line);

/// Returns the worker's first line: {"worker": 1, "version": "0.2.0", "jobs": 2}
std::string helloLine(int jobs);

/// The result of a job.
// NOLINTNEXTLINE(bugprone-exception-escape): moving JSON does not throw
struct WorkerResult {
    int exit_code = 0;
    Json result{};  ///< the verb's result; null if it has none
    std::vector<std::string> warnings{};
    std::optional<Error> error{};  ///< the first error
    /// "cancelled" or "crash" replaces the error's kind; "" = keep the kind.
    std::string error_kind{};
    double milliseconds = 0;
};

/// Returns a result line: {"id": 7, "exitCode": 0, "milliseconds": 812, "warnings": […], "result":
/// {…}}, or the same with "error" (`kind`, `what`, `where`, `hint`) and "retry".
std::string resultLine(const nlohmann::json& id, const WorkerResult& result);

/// Returns a progress line: {"id": 7, "progress": 0.42, "stage": "render"}.
std::string progressLine(const nlohmann::json& id, const RunProgress& progress);

}  // namespace peeler::cmd
