// SPDX-License-Identifier: Apache-2.0
// Lists of every length, in orders that repeat and in orders that do not.
#include "core/raster/list_sorter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace peeler {
namespace {

TEST(ListSorter, SortsListsOfEveryLength) {
    std::mt19937_64 random(5);
    ListSorter sorter;
    for (int time = 0; time < 20; ++time) {
        for (std::size_t length = 0; length < 300; ++length) {
            std::vector<std::uint64_t> list(length), sorted(length + 1, 7);
            // Neighbouring numbers, few different ones, or any.
            for (std::uint64_t& number : list)
                number = time % 3 == 0   ? random() % (length + 1)
                         : time % 3 == 1 ? random() % 4
                                         : random();
            for (int again = 0; again < 3; ++again) {
                sorter.sort(list.data(), length, sorted.data());
                std::vector<std::uint64_t> expected = list;
                std::sort(expected.begin(), expected.end());
                ASSERT_TRUE(std::equal(expected.begin(), expected.end(), sorted.begin())) << length;
                ASSERT_EQ(sorted[length], 7U) << "behind the list";
                // The next ray's list: nearly the same.
                if (length > 1) std::swap(list[random() % length], list[random() % length]);
            }
        }
    }
}

/// A network that sorts all lists of zeros and ones sorts all lists (Knuth, volume 3, theorem Z).
template <std::size_t N>
void expectSortsZerosAndOnes() {
    for (unsigned bits = 0; bits < 1U << N; ++bits) {
        std::array<int, N> list;
        for (std::size_t i = 0; i < N; ++i)
            list[i] = static_cast<int>(bits >> i & 1U);
        for (const auto& [low, high] : SortingNetwork<N>::pairs())
            if (list[high] < list[low]) std::swap(list[low], list[high]);
        EXPECT_TRUE(std::is_sorted(list.begin(), list.end())) << N << " " << bits;
    }
}

TEST(ListSorter, ItsNetworksSort) {
    expectSortsZerosAndOnes<2>();
    expectSortsZerosAndOnes<3>();
    expectSortsZerosAndOnes<5>();
    expectSortsZerosAndOnes<8>();
    expectSortsZerosAndOnes<11>();
    EXPECT_EQ(SortingNetwork<8>::size(), 19U);
}

}  // namespace
}  // namespace peeler
