// SPDX-License-Identifier: Apache-2.0
// SIMD vectors (GCC and Clang extension) of 16 bytes, which every processor supports. Lanes round
// like scalars. Code compiled for specific processors is selected at run time.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

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

/// Returns four half-precision numbers as floats, which represent them exactly. Unlike Imath's
/// function, this one has no branches. (Giesen, "Half to float done quic", 2012)
inline FourFloats halfsToFloats(const std::uint16_t* halfs) {
    using FourHalfs = std::uint16_t __attribute__((vector_size(8)));
    FourHalfs loaded;
    std::memcpy(&loaded, halfs, sizeof(loaded));
    const auto bits = __builtin_convertvector(loaded, FourInts);
    constexpr std::int32_t kOne = 1 << 23, kBias = 112 * kOne;  // of a float's exponent
    const FourInts magnitude = (bits & 0x7fff) << 13, exponent = magnitude & 31 * kOne;
    const FourInts normal = magnitude + kBias;
    // A subnormal number is a normal one without the leading one. Subtracting it also works if the
    // processor takes subnormal floats for zero.
    const FourInts least_normal = FourInts{} + (kBias + kOne);
    const auto subnormal = std::bit_cast<FourInts>(std::bit_cast<FourFloats>(normal + kOne) -
                                                   std::bit_cast<FourFloats>(least_normal));
    const FourInts not_finite = normal + kBias;
    FourInts result = exponent == 0 ? subnormal : normal;
    result = exponent == 31 * kOne ? not_finite : result;
    return std::bit_cast<FourFloats>(result | (bits & 0x8000) << 16);
}

inline FourFloats toFloats(const TwoDoubles& first, const TwoDoubles& second) {
    using TwoFloats = float __attribute__((vector_size(8)));
    return __builtin_shufflevector(__builtin_convertvector(first, TwoFloats),
                                   __builtin_convertvector(second, TwoFloats), 0, 1, 2, 3);
}

}  // namespace peeler
