// SPDX-License-Identifier: Apache-2.0
#include "core/base/memory_budget.h"

#include <peeler/memory_budget.h>

namespace peeler::inline v0 {

std::string MemoryBudget::where() const {
    return source.empty() ? "`memory` " + mebibytesText(bytes) : source;
}

std::string MemoryBudget::hint(std::uint64_t needed) const {
    if (source.empty()) return "give at least " + mebibytesText(needed);
    return "raise that limit, or say `memory` " + mebibytesText(needed) +
           " if so much may be used all the same";
}

}  // namespace peeler::inline v0

namespace peeler {

std::string mebibytesText(std::uint64_t bytes) {
    constexpr std::uint64_t kMebibyte = 1ULL << 20;
    return std::to_string(bytes / kMebibyte + (bytes % kMebibyte != 0 ? 1 : 0)) + "M";
}

}  // namespace peeler
