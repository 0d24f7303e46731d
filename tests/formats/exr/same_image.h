// SPDX-License-Identifier: Apache-2.0
// Bit-by-bit comparison of fragment lists.
#pragma once

#include <gtest/gtest.h>

#include <peeler/layered_image.h>

namespace peeler::test {

inline void expectSame(const LayeredImage& a, const LayeredImage& b) {
    EXPECT_EQ(a.window, b.window);
    EXPECT_TRUE(a.offsets == b.offsets);
    EXPECT_TRUE(a.z == b.z);
    EXPECT_EQ(a.color.type, b.color.type);
    EXPECT_EQ(a.color.channels, b.color.channels);
    EXPECT_TRUE(a.color.data == b.color.data);
    ASSERT_EQ(a.extra.size(), b.extra.size());
    for (std::size_t i = 0; i < a.extra.size(); ++i) {
        EXPECT_EQ(a.extra[i].channels, b.extra[i].channels);
        EXPECT_EQ(a.extra[i].type, b.extra[i].type);
        EXPECT_TRUE(a.extra[i].data == b.extra[i].data);
    }
}

}  // namespace peeler::test
