// SPDX-License-Identifier: Apache-2.0
// Sorting many short lists of numbers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace peeler {

/// The comparisons that sort N numbers whatever they are: merge exchange (Batcher 1968; Knuth, "The
/// Art of Computer Programming", volume 3, algorithm 5.2.2M). Calls use(i, d, n): the n numbers
/// from i on are each to be compared with the one d places farther on.
template <class Use>
[[gnu::always_inline]] constexpr void forMergeExchange(std::size_t count, Use&& use) {
    std::size_t top = 1;
    while (2 * top < count)
        top *= 2;
    for (std::size_t p = top; p > 0; p /= 2) {
        for (std::size_t q = top, r = 0, d = p;; d = q - p, q /= 2, r = p) {
            for (std::size_t i = r; i + d < count; i += 2 * p)
                use(i, d, i + p + d < count ? p : count - d - i);
            if (q == p) break;
        }
    }
}

/// Numbers of the same place in several lists: compared all at once.
inline constexpr std::size_t kListsAtOnce = 4;
using ListColumn = std::array<double, kListsAtOnce>;

/// Sorts the lists, which are of the same length. No number is NaN.
using SortLists = void (*)(ListColumn* columns, std::size_t count);

/// The one that is fastest on this processor, or that every processor can run. All do the same.
SortLists sortListsFor(bool every_processor = false);

/// What lists of that length or shorter are sorted at once; longer ones are left to std::sort.
inline constexpr std::size_t kMostAtOnce = 256;

}  // namespace peeler
