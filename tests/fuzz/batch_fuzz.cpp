// SPDX-License-Identifier: Apache-2.0
// Fuzz target for the jobs of peeler batch, and its report of an earlier run.
#include <nlohmann/json.hpp>

#include "cmd/batch/batch_jobs.h"
#include "cmd/batch/batch_report.h"
#include "fuzz/fuzz_target.h"

namespace peeler::fuzz {
namespace {

void takeBatch(Input input) {
    attempt([&] { cmd::readJobs("jobs", textOf(input)); });
    const std::string path = fileOf("report", input);
    attempt([&] {
        std::size_t whole = 0;
        for (const auto& line : cmd::readBatchReport(path, &whole))
            cmd::lineText(line);
    });
}

}  // namespace
}  // namespace peeler::fuzz

PEELER_FUZZ_TARGET(batch, peeler::fuzz::takeBatch)
