// SPDX-License-Identifier: Apache-2.0
// Resource limits of a command, and its memory use from /proc.
#include "cmd/machine/resources.h"

#include <sys/resource.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string>

#include "cmd/machine/limits.h"
#include "core/base/memory_budget.h"
#include "core/base/parallel.h"
#include "core/gl/cuda_devices.h"
#include "formats/image/image_library.h"

namespace peeler::cmd {

Limit allowedThreads() {
    // Affinity is first in the list, because least() returns the first of equal limits.
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

namespace {

/// Returns the number of threads per pool, at most `wanted`, for which the system can start all
/// pools. With n threads per pool, peeler's loops start n − 1 threads, the image libraries and the
/// rasteriser n each, and the file writer and the driver's cache one each.
int startable(int wanted) {
    static int started = 0;  // the last number found to be startable; 0 = none yet
    if (wanted == started) return wanted;
    constexpr int kPlaces = 3, kOthers = 2;
    const int all = kPlaces * wanted - 1 + kOthers;
    const int room = startableThreads(all);
    if (room == all) return started = wanted;
    return std::max(1, (room + 1 - kOthers) / kPlaces);
}

}  // namespace

void setThreads(int threads) {
    setThreadCount(startable(threads > 0 ? threads : static_cast<int>(allowedThreads().amount)));
    setLibraryThreads(threadCount());
    // At first use, OpenImageIO creates a pool with the thread count in CUE_THREADS, even if that
    // is not a number. OPENIMAGEIO_THREADS takes precedence.
    setenv("OPENIMAGEIO_THREADS", std::to_string(threadCount()).c_str(), 1);
    // LP_NUM_THREADS = 0 rasterises in the calling thread; 1 would add a worker thread. By default
    // llvmpipe counts the machine's processors, not those available to the process.
#ifdef __SANITIZE_THREAD__
    // ThreadSanitizer cannot see llvmpipe's synchronisation. It would also report llvmpipe's race,
    // which builds with sanitizers do not work around (cmd/mutex_destroy.cpp).
    const int workers = 0;
#else
    const int workers = threadCount() == 1 ? 0 : threadCount();
#endif
    setenv("LP_NUM_THREADS", std::to_string(workers).c_str(), threads > 0 ? 1 : 0);
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
