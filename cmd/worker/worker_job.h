// SPDX-License-Identifier: Apache-2.0
// The worker protocol's lines (cmd/README.md, "The worker").
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include <peeler/error.h>
#include "cmd/session/reporter.h"

namespace peeler::cmd {

/// The protocol version, sent in a worker's first line. Incremented by incompatible changes.
inline constexpr int kWorkerProtocol = 1;

/// The exit code of a cancelled job, as for a command ended by Ctrl-C.
inline constexpr int kCancelledCode = 130;

/// A client's line: a job, or a request to cancel one.
struct WorkerRequest {
    /// Parses a line. Throws Error (kUsage) if it is neither. Does not check the verb's options.
    explicit WorkerRequest(const std::string& line);

    nlohmann::json id;  ///< a string or an integer
    bool cancels = false;
    bool wants_progress = false;
    std::string verb{};
    std::vector<std::string> arguments{};
};

/// Returns the id in an invalid request if it can be read, else null.
nlohmann::json requestId(const std::string& line);

/// Returns a worker's first line: {"worker": 1, "version": "0.2.0", "jobs": 2}
std::string helloLine(int jobs);

/// The result of a job.
// NOLINTNEXTLINE(bugprone-exception-escape): moving JSON does not throw
struct WorkerResult {
    int exit_code = 0;
    Json result{};  ///< the verb's; null if absent
    std::vector<std::string> warnings{};
    std::optional<Error> error{};  ///< the first error
    std::string error_kind{};      ///< replaces the kind of `error`: "cancelled", "crash"
    double milliseconds = 0;
};

/// Returns {"id": 7, "exitCode": 0, "milliseconds": 812, "warnings": […], "result": {…}}, or with
/// "error" (`kind`, `what`, `where`, `hint`) and "retry".
std::string resultLine(const nlohmann::json& id, const WorkerResult& result);

/// Returns {"id": 7, "progress": 0.42, "stage": "render"}.
std::string progressLine(const nlohmann::json& id, const RunProgress& progress);

}  // namespace peeler::cmd
