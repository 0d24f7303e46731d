// SPDX-License-Identifier: Apache-2.0
// Vectors of eight floats. Processors without registers of this size process them in two parts.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/lanes.h"

namespace peeler {

using EightFloats = float __attribute__((vector_size(32), may_alias));
using EightInts = std::int32_t __attribute__((vector_size(32)));

// These leave `value` as it is if `other` is NaN.
PEELER_INLINE void lower(EightFloats& value, const EightFloats& other) {
    value = other < value ? other : value;
}
PEELER_INLINE void raise(EightFloats& value, const EightFloats& other) {
    value = other > value ? other : value;
}

/// Returns eight floats in memory, aligned to 32 bytes.
PEELER_INLINE const EightFloats& lanesAt(const float* lanes) {
    return *reinterpret_cast<const EightFloats*>(lanes);
}

/// Returns a bit for each lane that is true.
PEELER_INLINE unsigned bitsOf(const FourInts& lanes) {
#ifdef __SSE2__
    return static_cast<unsigned>(__builtin_ia32_movmskps(reinterpret_cast<FourFloats>(lanes)));
#else
    unsigned bits = 0;
    for (int i = 0; i < 4; ++i)
        bits |= static_cast<unsigned>(lanes[i]) & 1U << i;
    return bits;
#endif
}
PEELER_INLINE unsigned bitsOf(const EightInts& lanes) {
    return bitsOf(__builtin_shufflevector(lanes, lanes, 0, 1, 2, 3)) |
           bitsOf(__builtin_shufflevector(lanes, lanes, 4, 5, 6, 7)) << 4;
}

}  // namespace peeler
