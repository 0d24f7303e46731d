// SPDX-License-Identifier: Apache-2.0
// Sorting many short lists of numbers.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>

namespace peeler {

/// The comparisons that sort N numbers whatever they are: merge exchange (Batcher 1968; Knuth, "The
/// Art of Computer Programming", volume 3, algorithm 5.2.2M).
template <std::size_t N>
struct SortingNetwork {
    using Pair = std::array<std::size_t, 2>;

    template <class Use>
    static constexpr void forEach(Use&& use) {
        for (std::size_t p = std::bit_ceil(N) / 2; p > 0; p /= 2) {
            std::size_t q = std::bit_ceil(N) / 2, r = 0, d = p;
            while (true) {
                for (std::size_t i = 0; i + d < N; ++i)
                    if ((i & p) == r) use(Pair{i, i + d});
                if (q == p) break;
                d = q - p;
                q /= 2;
                r = p;
            }
        }
    }
    static constexpr std::size_t size() {
        std::size_t pairs = 0;
        forEach([&](const Pair&) { ++pairs; });
        return pairs;
    }
    static constexpr std::array<Pair, size()> pairs() {
        std::array<Pair, size()> all{};
        std::size_t at = 0;
        forEach([&](const Pair& pair) { all[at++] = pair; });
        return all;
    }
};

/// Sorts lists, one after the other. Very short ones take no branch. Of longer ones neighbours
/// mostly come in the same order (rays that see the same surfaces, found in the same order): each
/// begins with the order of the last list of its length, and an insertion sort has next to nothing
/// left to do.
class ListSorter {
  public:
    /// From `from` to `to`, which are not the same.
    void sort(const std::uint64_t* from, std::size_t count, std::uint64_t* to) {
        if (count <= kNetworks) return kShort[count](from, to);
        if (count <= kLongest && sortLikeLast(from, count, to)) return;
        std::copy_n(from, count, to);
        std::sort(to, to + count);
    }

  private:
    static constexpr std::size_t kNetworks = 8, kLongest = 96;
    static constexpr std::size_t kMoves = 12;  ///< a number; more cost more than a general sort

    template <std::size_t N, std::size_t... I>
    static void exchange(std::uint64_t* v, std::index_sequence<I...>) {
        constexpr auto kPairs = SortingNetwork<N>::pairs();
        const auto one = [v](std::size_t i, std::size_t k) {
            const std::uint64_t a = v[i], b = v[k];
            v[i] = a < b ? a : b;
            v[k] = a < b ? b : a;
        };
        (one(kPairs[I][0], kPairs[I][1]), ...);
    }
    template <std::size_t N>
    static void sortShort(const std::uint64_t* from, std::uint64_t* to) {
        std::array<std::uint64_t, N> v;
        for (std::size_t i = 0; i < N; ++i)
            v[i] = from[i];
        if constexpr (N > 1)
            exchange<N>(v.data(), std::make_index_sequence<SortingNetwork<N>::size()>());
        for (std::size_t i = 0; i < N; ++i)
            to[i] = v[i];
    }
    static constexpr void (*kShort[kNetworks + 1])(const std::uint64_t*, std::uint64_t*) = {
        [](const std::uint64_t*, std::uint64_t*) {},
        sortShort<1>,
        sortShort<2>,
        sortShort<3>,
        sortShort<4>,
        sortShort<5>,
        sortShort<6>,
        sortShort<7>,
        sortShort<8>};

    bool sortLikeLast(const std::uint64_t* from, std::size_t count, std::uint64_t* to) {
        std::uint8_t* const order = order_[count];
        if (order[0] == order[1]) std::iota(order, order + count, std::uint8_t{0});
        std::size_t moves_left = kMoves * count;
        for (std::size_t i = 0; i < count; ++i) {
            const std::uint8_t place = order[i];
            const std::uint64_t number = from[place];
            std::size_t at = i;
            for (; at > 0 && to[at - 1] > number; --at) {
                to[at] = to[at - 1];
                order[at] = order[at - 1];
            }
            to[at] = number;
            order[at] = place;
            if (i - at > moves_left) return false;
            moves_left -= i - at;
        }
        return true;
    }

    std::uint8_t order_[kLongest + 1][kLongest] = {};  // by length; all zeros: none yet
};

}  // namespace peeler
