// SPDX-License-Identifier: Apache-2.0
// Tests the sRGB transfer function at known points, and its inverse.
#include "core/base/color.h"

#include <gtest/gtest.h>

namespace peeler {
namespace {

TEST(Srgb, KnownPoints) {
    EXPECT_EQ(linearFromSrgb(0.0F), 0);
    EXPECT_FLOAT_EQ(linearFromSrgb(1.0F), 1);
    EXPECT_FLOAT_EQ(srgbFromLinear(1.0F), 1);
    EXPECT_NEAR(linearFromSrgb(0.5), 0.21404114, 1e-8);
    EXPECT_NEAR(srgbFromLinear(0.18), 0.46135612, 1e-8);
    // The linear segment meets the curve here.
    EXPECT_NEAR(linearFromSrgb(0.04045), 0.0031308, 1e-7);
    EXPECT_NEAR(linearFromSrgb(0.040451), 0.0031308, 1e-6);
}

TEST(Srgb, EveryByteAndWordComesBack) {
    for (int i = 0; i <= 255; ++i) {
        const float value = static_cast<float>(i) / 255;
        EXPECT_EQ(std::lround(srgbFromLinear(linearFromSrgb(value)) * 255), i);
    }
    for (int i = 0; i <= 65535; i += 13) {
        const float value = static_cast<float>(i) / 65535;
        EXPECT_EQ(std::lround(srgbFromLinear(linearFromSrgb(value)) * 65535), i);
    }
}

}  // namespace
}  // namespace peeler
