// SPDX-License-Identifier: Apache-2.0
// Tests the sorting of lists of every length, in registers and in memory, with the code for every
// processor.
#include "core/raster/list_sorter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

namespace peeler {
namespace {

TEST(ListSorter, SortsListsOfEveryLength) {
    std::mt19937_64 random(5);
    for (const bool every_processor : {false, true}) {
        const SortLists sort = sortListsFor(every_processor);
        for (std::size_t length = 0; length <= kMostAtOnce; ++length) {
            for (int time = 0; time < 6; ++time) {
                // The values are random, with some, many or hardly any duplicates.
                const std::uint64_t different = time % 3 == 0   ? length + 1
                                                : time % 3 == 1 ? 4
                                                                : std::uint64_t{1} << 52;
                std::vector<ListColumn> columns(length + 1);
                std::vector<std::vector<double>> expected(kListsAtOnce);
                for (std::size_t i = 0; i < length; ++i)
                    for (std::size_t list = 0; list < kListsAtOnce; ++list) {
                        columns[i][list] = static_cast<double>(random() % different) - 2;
                        expected[list].push_back(columns[i][list]);
                    }
                columns[length].fill(-7);
                sort(columns.data(), length);
                for (std::size_t list = 0; list < kListsAtOnce; ++list) {
                    std::ranges::sort(expected[list]);
                    for (std::size_t i = 0; i < length; ++i)
                        ASSERT_EQ(columns[i][list], expected[list][i]) << length << " " << i;
                    ASSERT_EQ(columns[length][list], -7) << "behind the list";
                }
            }
        }
    }
}

TEST(ListSorter, TakesNumbersOfAllSizes) {
    std::vector<ListColumn> columns;
    for (const double number :
         {std::numeric_limits<double>::max(), 5e-324, -1e308, 1.0, -5e-324, 0.0, 1e-300, -1e-310})
        columns.push_back({number, -number, number, number});
    for (const bool every_processor : {false, true}) {
        auto sorted = columns;
        sortListsFor(every_processor)(sorted.data(), sorted.size());
        for (std::size_t list = 0; list < kListsAtOnce; ++list)
            for (std::size_t i = 1; i < sorted.size(); ++i)
                EXPECT_LE(sorted[i - 1][list], sorted[i][list]) << list << " " << i;
    }
}

/// The 0-1 principle: a network that sorts all lists of zeros and ones sorts all lists (Knuth,
/// volume 3, theorem Z).
TEST(ListSorter, ComparesEnough) {
    for (const std::size_t length : {2U, 3U, 5U, 8U, 11U, 16U}) {
        std::size_t comparisons = 0;
        forMergeExchange(length,
                         [&](std::size_t, std::size_t, std::size_t n) { comparisons += n; });
        EXPECT_EQ(comparisons, length == 8 ? 19U : length == 16 ? 63U : comparisons);
        for (unsigned bits = 0; bits < 1U << length; ++bits) {
            std::vector<int> list(length);
            for (std::size_t i = 0; i < length; ++i)
                list[i] = static_cast<int>(bits >> i & 1U);
            forMergeExchange(length, [&](std::size_t i, std::size_t d, std::size_t n) {
                for (std::size_t k = i; k < i + n; ++k)
                    if (list[k + d] < list[k]) std::swap(list[k], list[k + d]);
            });
            ASSERT_TRUE(std::ranges::is_sorted(list)) << length << " " << bits;
        }
    }
}

}  // namespace
}  // namespace peeler
