// SPDX-License-Identifier: Apache-2.0
// What became of a job of peeler batch.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>

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

}  // namespace peeler::cmd
