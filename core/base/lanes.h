// SPDX-License-Identifier: Apache-2.0
// SIMD vectors (GCC and Clang extension) of 16 bytes, which every processor supports. Lanes round
// like scalars. Code compiled for specific processors is selected at run time.
#pragma once

#include <cstdint>

// Code that is compiled for several processors must be inlined into each variant.
#define PEELER_INLINE [[gnu::always_inline]] inline

namespace peeler {

/// Whether this processor supports AVX2; false except on x86-64.
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

/// least() and most() return the second argument if either is NaN.
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
