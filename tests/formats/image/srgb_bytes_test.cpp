// SPDX-License-Identifier: Apache-2.0
// Tests that the sRGB table gives the same bytes as the function, at every change of the byte and
// in between.
#include "formats/image/image_writer.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "support/numbers.h"

namespace peeler {
namespace {

long byteOf(float linear) {
    return std::lround(encodeSrgb(linear) * 255);
}

TEST(SrgbBytes, AreThoseOfTheTransferFunction) {
    const SrgbBytes bytes;
    constexpr std::uint32_t kStep = 251, kEnd = std::bit_cast<std::uint32_t>(1.0F) + kStep;
    int changes = 0;
    long before = 0;
    for (std::uint32_t bits = 0; bits < kEnd; bits += kStep) {
        const long byte = byteOf(std::bit_cast<float>(bits));
        ASSERT_EQ(bytes(std::bit_cast<float>(bits)), byte) << std::bit_cast<float>(bits);
        if (byte == before) continue;
        for (std::uint32_t near = bits - kStep; near < bits; ++near) {
            const auto linear = std::bit_cast<float>(near);
            ASSERT_EQ(bytes(linear), byteOf(linear)) << linear;
        }
        changes += static_cast<int>(byte - before);
        before = byte;
    }
    EXPECT_EQ(changes, 255);
}

TEST(SrgbBytes, OfWhatIsNoColour) {
    const SrgbBytes bytes;
    for (const float none : {-0.0F, -1e-30F, -1.0F, -test::kFloatInfinity, std::nanf("")})
        EXPECT_EQ(bytes(none), 0) << none;
    for (const float bright : {1.0F, std::nextafter(1.0F, 2.0F), 7.0F, test::kFloatInfinity})
        EXPECT_EQ(bytes(bright), 255) << bright;
}

}  // namespace
}  // namespace peeler
