// SPDX-License-Identifier: Apache-2.0
#include "core/parts/step_limit.h"

#include <algorithm>

#include "core/base/parallel.h"

namespace peeler {

bool parallelFor(std::size_t items, StepLimit& limit, const Progress& progress,
                 const std::function<void(std::size_t)>& body) {
    constexpr std::size_t kRounds = 100, kLeast = 16;
    const std::size_t round = std::max(items / kRounds + 1, kLeast);
    for (std::size_t first = 0; first < items && !limit.exceeded(); first += round) {
        const std::size_t count = std::min(round, items - first);
        parallelFor(count, [&](std::size_t i) {
            if (!limit.exceeded()) body(first + i);
        });
        if (progress) progress(double(first + count) / double(items));
    }
    return !limit.exceeded();
}

}  // namespace peeler
