// SPDX-License-Identifier: Apache-2.0
// Threads by environment variable, memory by /proc.
#include "cmd/resources.h"

#include <sys/resource.h>

#include <cstdlib>
#include <fstream>
#include <string>

#include "core/parallel.h"

namespace peeler::cmd {

void setThreads(int threads) {
    setThreadCount(threads);
    // llvmpipe: 0 rasterises in the calling thread, 1 would add a worker to it. Left to itself it
    // counts the processors of the machine, not those that the process may run on.
    const int wanted = threadCount();
    setenv("LP_NUM_THREADS", std::to_string(wanted == 1 ? 0 : wanted).c_str(), threads > 0 ? 1 : 0);
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
