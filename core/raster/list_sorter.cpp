// SPDX-License-Identifier: Apache-2.0
#include "core/raster/list_sorter.h"

#include <cstring>
#include <utility>

#include "core/base/lanes.h"

namespace peeler {
namespace {

/// A ListColumn as one SIMD vector. Processors without registers of this size process the vector in
/// parts.
using ColumnLanes = double __attribute__((vector_size(sizeof(ListColumn))));

PEELER_INLINE void loadColumn(const ListColumn& from, ColumnLanes& to) {
    std::memcpy(&to, from.data(), sizeof to);
}
PEELER_INLINE void storeColumn(const ColumnLanes& from, ListColumn& to) {
    std::memcpy(to.data(), &from, sizeof from);
}
PEELER_INLINE void exchangeLanes(ColumnLanes& a, ColumnLanes& b) {
    const ColumnLanes low = a < b ? a : b;
    b = a < b ? b : a;
    a = low;
}

// Lists up to this length are sorted in registers, by specialised code.
constexpr std::size_t kInRegisters = 16;

template <std::size_t N>
struct Comparisons {
    static constexpr std::size_t size() {
        std::size_t all = 0;
        forMergeExchange(N, [&](std::size_t, std::size_t, std::size_t n) { all += n; });
        return all;
    }
    static constexpr std::array<std::array<std::size_t, 2>, size()> pairs() {
        std::array<std::array<std::size_t, 2>, size()> all{};
        std::size_t at = 0;
        forMergeExchange(N, [&](std::size_t i, std::size_t d, std::size_t n) {
            for (std::size_t k = i; k < i + n; ++k)
                all[at++] = {k, k + d};
        });
        return all;
    }
};

template <std::size_t N, std::size_t... I>
PEELER_INLINE void exchangeAll(ColumnLanes* v, std::index_sequence<I...>) {
    constexpr auto kPairs = Comparisons<N>::pairs();
    (exchangeLanes(v[kPairs[I][0]], v[kPairs[I][1]]), ...);
}

template <std::size_t N>
PEELER_INLINE void sortInRegisters(ListColumn* columns) {
    ColumnLanes v[N];
    for (std::size_t i = 0; i < N; ++i)
        loadColumn(columns[i], v[i]);
    exchangeAll<N>(v, std::make_index_sequence<Comparisons<N>::size()>());
    for (std::size_t i = 0; i < N; ++i)
        storeColumn(v[i], columns[i]);
}

PEELER_INLINE void sortInMemory(ListColumn* columns, std::size_t count) {
    forMergeExchange(
        count, [columns](std::size_t i, std::size_t d, std::size_t n)
                   __attribute__((always_inline)) {
                       for (std::size_t k = i; k < i + n; ++k) {
                           ColumnLanes a, b;
                           loadColumn(columns[k], a);
                           loadColumn(columns[k + d], b);
                           exchangeLanes(a, b);
                           storeColumn(a, columns[k]);
                           storeColumn(b, columns[k + d]);
                       }
                   });
}

template <std::size_t... N>
PEELER_INLINE void sortAnywhere(ListColumn* columns, std::size_t count, std::index_sequence<N...>) {
    const bool done = ((count == N + 2 && (sortInRegisters<N + 2>(columns), true)) || ...);
    if (!done && count > kInRegisters) sortInMemory(columns, count);
}

void sortOnEvery(ListColumn* columns, std::size_t count) {
    sortAnywhere(columns, count, std::make_index_sequence<kInRegisters - 1>());
}

#ifdef __x86_64__
[[gnu::target("avx2")]] void sortOnAvx2(ListColumn* columns, std::size_t count) {
    sortAnywhere(columns, count, std::make_index_sequence<kInRegisters - 1>());
}
#endif

}  // namespace

SortLists sortListsFor([[maybe_unused]] bool every_processor) {
#ifdef __x86_64__
    if (hasAvx2() && !every_processor) return sortOnAvx2;
#endif
    return sortOnEvery;
}

}  // namespace peeler
