// SPDX-License-Identifier: Apache-2.0
// The lines that a worker and its client exchange (cmd/README.md, "The worker").
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include <peeler/error.h>
#include "cmd/session/reporter.h"

namespace peeler::cmd {

/// The version of the protocol, which the first line of a worker says. It grows where a client of
/// the version before would go wrong.
inline constexpr int kWorkerProtocol = 1;

/// The exit code of a job that was cancelled: that of a command that Ctrl-C ends.
inline constexpr int kCancelledCode = 130;

/// A line of a client: a job, or a request to cancel one.
struct WorkerRequest {
    /// Throws Error (kUsage) for a line that is neither; the options of the verb are not looked at.
    explicit WorkerRequest(const std::string& line);

    nlohmann::json id;  ///< a string or an integer
    bool cancels = false;
    bool wants_progress = false;
    std::string verb{};
    std::vector<std::string> arguments{};
};

/// Returns the id in a line that is no good request, as far as one can be read; else null.
nlohmann::json requestId(const std::string& line);

/// The first line of a worker: {"worker": 1, "version": "0.1.0", "jobs": 2}
std::string helloLine(int jobs);

/// How a job ended.
// NOLINTNEXTLINE(bugprone-exception-escape): moving JSON does not throw
struct WorkerResult {
    int exit_code = 0;
    Json result{};  ///< of the verb; null if there is none
    std::vector<std::string> warnings{};
    std::optional<Error> error{};  ///< the first one
    std::string error_kind{};      ///< in place of that of `error`: "cancelled", "crash"
    double milliseconds = 0;
};

/// {"id": 7, "exitCode": 0, "milliseconds": 812, "warnings": […], "result": {…}}, or with "error"
/// (`kind`, `what`, `where`, `hint`) and "retry".
std::string resultLine(const nlohmann::json& id, const WorkerResult& result);

/// {"id": 7, "progress": 0.42, "stage": "render"}
std::string progressLine(const nlohmann::json& id, const RunProgress& progress);

}  // namespace peeler::cmd
