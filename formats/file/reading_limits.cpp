// SPDX-License-Identifier: Apache-2.0
#include "formats/file/reading_limits.h"

#include <algorithm>
#include <utility>

#include <peeler/error.h>
#include "core/base/memory_budget.h"
#include "core/base/process_memory.h"

namespace peeler {
namespace {

/// The maximum number of bytes allowed between two checks of the resident memory. (Each check takes
/// time.)
constexpr std::uint64_t kUnseen = 1U << 20U;

}  // namespace

void checkReadingMemory(const MemoryBudget& budget, std::uint64_t needed,
                        const std::string& where) {
    checkMemory(budget, needed, "to read the input, at " + where);
}

ReadingMemory::ReadingMemory(MemoryBudget budget) : budget_(std::move(budget)) {}

void ReadingMemory::allow(std::uint64_t bytes, const std::string& where) {
    if (budget_ == 0 || (unseen_ += bytes) < kUnseen) return;
    // Reserve memory also for the next kUnseen bytes, which will not be checked.
    const std::uint64_t more = std::exchange(unseen_, 0) + kUnseen;
    checkReadingMemory(budget_, usedBytesWith(budget_, more), where);
}

std::uint64_t ReadingMemory::left() const {
    return budget_ - std::min(usedBytes(budget_), budget_.bytes);
}

void SizeLimit::check(std::uint64_t more, const std::string& where) const {
    if (more > most_ - taken_)
        throw Error(ErrorKind::kInput,
                    what_ + (" more than the limit of " + std::to_string(most_)) + " bytes", where,
                    "split the scene");
}

}  // namespace peeler
