// SPDX-License-Identifier: Apache-2.0
#include "core/base/lanes.h"

#include <gtest/gtest.h>

#define IMATH_HALF_NO_LOOKUP_TABLE
#include <Imath/half.h>

#include <array>
#include <bit>

namespace peeler {
namespace {

TEST(Lanes, HalfsBecomeTheFloatsOfImath) {
    for (std::uint32_t first = 0; first < 1U << 16; first += 4) {
        std::array<std::uint16_t, 4> halfs;
        for (std::uint32_t i = 0; i < 4; ++i)
            halfs[i] = static_cast<std::uint16_t>(first + i);
        const auto floats =
            std::bit_cast<std::array<std::uint32_t, 4>>(halfsToFloats(halfs.data()));
        for (std::size_t i = 0; i < 4; ++i)
            ASSERT_EQ(floats[i], std::bit_cast<std::uint32_t>(imath_half_to_float(halfs[i])))
                << halfs[i];
    }
}

}  // namespace
}  // namespace peeler
