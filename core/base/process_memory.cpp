// SPDX-License-Identifier: Apache-2.0
#include "core/base/process_memory.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace peeler {

std::uint64_t residentBytes() {
    unsigned long total = 0, resident = 0;
    if (std::FILE* file = std::fopen("/proc/self/statm", "re")) {
        if (std::fscanf(file, "%lu %lu", &total, &resident) != 2) resident = 0;
        std::fclose(file);
    }
    return static_cast<std::uint64_t>(resident) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

std::uint64_t usedBytes(const MemoryBudget& budget) {
    const std::uint64_t resident = residentBytes();
    return resident - std::min(resident, budget.base);
}

std::uint64_t usedBytesWith(const MemoryBudget& budget, std::uint64_t more) {
    const std::uint64_t bytes = usedBytes(budget) + more;
    if (bytes <= budget) return bytes;
    returnFreeMemory();
    return usedBytes(budget) + more;
}

void returnFreeMemory() {
#ifdef __GLIBC__
    malloc_trim(0);
#endif
}

}  // namespace peeler
