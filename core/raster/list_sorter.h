// SPDX-License-Identifier: Apache-2.0
// Sorting of large numbers of short lists of numbers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace peeler {

/// Enumerates the comparisons of a sorting network for `count` numbers: merge exchange (Batcher
/// 1968; Knuth, "The Art of Computer Programming", volume 3, algorithm 5.2.2M). Calls use(i, d, n)
/// for n comparisons: each of the n numbers from index i on is compared with the number d places
/// later.
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

/// The number of lists that are sorted together, and a column with one element of each list.
inline constexpr std::size_t kListsAtOnce = 4;
using ListColumn = std::array<double, kListsAtOnce>;

/// A function that sorts kListsAtOnce lists of equal length. No number may be NaN.
using SortLists = void (*)(ListColumn* columns, std::size_t count);

/// Returns the fastest variant for this processor or, if `every_processor`, the portable one. Both
/// give the same results.
SortLists sortListsFor(bool every_processor = false);

/// The maximum length of lists that are sorted together. std::sort sorts longer lists.
inline constexpr std::size_t kMostAtOnce = 256;

}  // namespace peeler
