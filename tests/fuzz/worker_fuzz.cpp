// SPDX-License-Identifier: Apache-2.0
// Fuzz target for the lines that a client sends to peeler worker.
#include <sstream>
#include <string>

#include "cmd/cli/parsed_verb.h"
#include "cmd/worker/worker_job.h"
#include "fuzz/fuzz_target.h"

namespace peeler::fuzz {
namespace {

void takeLines(Input input) {
    std::istringstream lines(textOf(input));
    for (std::string line; std::getline(lines, line);) {
        const nlohmann::json id = cmd::requestId(line);
        attempt([&] {
            const cmd::WorkerRequest request(line);
            if (!request.cancels) cmd::ParsedVerb(cmd::verbNamed(request.verb), request.arguments);
        });
        cmd::WorkerResult result;
        result.error = Error(ErrorKind::kUsage, line, line, line);
        cmd::resultLine(id, result);
    }
}

}  // namespace
}  // namespace peeler::fuzz

PEELER_FUZZ_TARGET(worker, peeler::fuzz::takeLines)
