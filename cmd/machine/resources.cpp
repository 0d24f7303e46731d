// SPDX-License-Identifier: Apache-2.0
// What limits mean for a command, and the memory it used by /proc.
#include "cmd/machine/resources.h"

#include <sys/resource.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string>

#include "core/base/parallel.h"
#include "core/gl/context.h"
#include "formats/image/image_library.h"

namespace peeler::cmd {

Limit allowedThreads() {
    // Affinity comes first, so that it is named where another limit is the same.
    std::vector<Limit> limits{{static_cast<std::uint64_t>(affinityCount()), "CPU affinity"}};
    for (const Limit& limit : processorLimits(processLimitSources()))
        limits.push_back(limit);
    return *least(limits);
}

std::optional<Limit> allowedMemory() {
    return least(memoryLimits(processLimitSources()));
}

MemoryBudget budgetUnder(const Limit& limit) {
    return {limit.amount - limit.amount / 8,
            limit.source + " allows " + mebibytesText(limit.amount)};
}

MemoryBudget inheritedBudget() {
    const auto limit = allowedMemory();
    return limit ? budgetUnder(*limit) : MemoryBudget();
}

void setThreads(int threads) {
    setThreadCount(threads > 0 ? threads : static_cast<int>(allowedThreads().amount));
    setLibraryThreads(threadCount());
    // OpenImageIO makes its pool at the first use, with as many threads as the variable CUE_THREADS
    // says, be that a number or not; its own variable goes before that one.
    setenv("OPENIMAGEIO_THREADS", std::to_string(threadCount()).c_str(), 1);
    // llvmpipe: 0 rasterises in the calling thread, 1 would add a worker to it. Left to itself it
    // counts the processors of the machine, not those that the process may run on.
    const int wanted = threadCount();
    setenv("LP_NUM_THREADS", std::to_string(wanted == 1 ? 0 : wanted).c_str(), threads > 0 ? 1 : 0);
}

void takeVisibleGpus() {
    constexpr const char* kName = "CUDA_VISIBLE_DEVICES";
    const char* const value = std::getenv(kName);
    if (!value) return;
    gl::setCudaVisibleDevices(value);
    unsetenv(kName);
}

std::uint64_t peakMemory() {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;) {
        std::uint64_t kibibytes = 0;
        if (word == "VmHWM:" && status >> kibibytes) return kibibytes * 1024;
    }
    struct rusage usage {};
    if (getrusage(RUSAGE_SELF, &usage) != 0) return 0;
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace peeler::cmd
