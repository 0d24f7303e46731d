// SPDX-License-Identifier: Apache-2.0
#include "formats/file/reading_memory.h"

#include "core/base/error.h"

namespace peeler {

void checkReadingMemory(const MemoryBudget& budget, std::uint64_t needed,
                        const std::string& where) {
    if (budget == 0 || needed <= budget) return;
    throw Error(ErrorKind::kMemory,
                "the memory budget is " + mebibytesText(budget) +
                    ", and to read the input at least " + mebibytesText(needed) +
                    " are needed, at " + where,
                budget.where(), budget.hint(needed));
}

}  // namespace peeler
