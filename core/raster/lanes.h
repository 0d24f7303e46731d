// SPDX-License-Identifier: Apache-2.0
// Several numbers that are calculated with at once, as GCC and Clang have them. 16 bytes are what
// every processor takes; lanes are rounded as single numbers are. What is compiled for some
// processors besides is chosen when it runs.
#pragma once

#include <cstdint>

// What is compiled for several processors has to be inlined in each.
#define PEELER_INLINE [[gnu::always_inline]] inline

namespace peeler {

/// Whether this processor runs what is compiled for AVX2; false on others than x86-64.
inline bool hasAvx2() {
#ifdef __x86_64__
    static const bool has = __builtin_cpu_supports("avx2");
    return has;
#else
    return false;
#endif
}

using TwoDoubles = double __attribute__((vector_size(16)));
using FourFloats = float __attribute__((vector_size(16)));
using FourInts = std::int32_t __attribute__((vector_size(16)));

/// The second one where they are not ordered.
template <class Lanes>
inline Lanes least(const Lanes& a, const Lanes& b) {
    return a < b ? a : b;
}
template <class Lanes>
inline Lanes most(const Lanes& a, const Lanes& b) {
    return a > b ? a : b;
}

inline FourFloats toFloats(const TwoDoubles& first, const TwoDoubles& second) {
    using TwoFloats = float __attribute__((vector_size(8)));
    return __builtin_shufflevector(__builtin_convertvector(first, TwoFloats),
                                   __builtin_convertvector(second, TwoFloats), 0, 1, 2, 3);
}

}  // namespace peeler
