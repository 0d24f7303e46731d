// SPDX-License-Identifier: Apache-2.0
#include "core/base/memory_budget.h"

#include <peeler/error.h>

namespace peeler::inline v0 {

Text MemoryBudget::where() const {
    return source.empty() ? Parameter::kMemory + " " + mebibytesText(bytes) : source;
}

Text MemoryBudget::hint(std::uint64_t needed) const {
    if (source.empty()) return "give at least " + mebibytesText(needed);
    return "raise that limit, or give " + Parameter::kMemory + " " + mebibytesText(needed) +
           " to use that much anyway";
}

}  // namespace peeler::inline v0

namespace peeler {

std::string mebibytesText(std::uint64_t bytes) {
    constexpr std::uint64_t kMebibyte = 1ULL << 20;
    return std::to_string(bytes / kMebibyte + (bytes % kMebibyte != 0 ? 1 : 0)) + "M";
}

MemoryUse& MemoryUse::operator+=(const MemoryUse& other) {
    fixed += other.fixed;
    pixel += other.pixel;
    fragment += other.fragment;
    return *this;
}

void checkMemory(const MemoryBudget& budget, std::uint64_t needed, const std::string& purpose,
                 const Text& or_else) {
    if (budget == 0 || needed <= budget) return;
    throw Error(ErrorKind::kMemory,
                "the memory budget is " + mebibytesText(budget) + ", but " + mebibytesText(needed) +
                    " are needed " + purpose,
                budget.where(), budget.hint(needed) + or_else);
}

}  // namespace peeler
