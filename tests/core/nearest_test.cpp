// SPDX-License-Identifier: Apache-2.0
// A layer limit keeps the beginning of every list, in every array.
#include "core/image/nearest.h"

#include <gtest/gtest.h>

#include "formats/synthetic_image.h"

namespace peeler {
namespace {

TEST(KeepNearest, KeepsTheBeginningOfEveryList) {
    const LayeredImage all = test::makePicture({.seed = 5, .extra = true}).image;
    for (const std::uint32_t limit : {0U, 1U, 3U, 99U}) {
        LayeredImage kept = all;
        keepNearest(kept, limit);
        ASSERT_EQ(kept.offsets.size(), all.offsets.size());
        ASSERT_EQ(kept.offsets.back(), kept.fragments());
        for (std::size_t p = 0; p < all.window.pixels(); ++p) {
            ASSERT_EQ(kept.count(p), std::min(all.count(p), limit));
            for (std::uint32_t k = 0; k < kept.count(p); ++k) {
                const std::size_t from = all.offsets[p] + k, to = kept.offsets[p] + k;
                ASSERT_EQ(kept.z[to], all.z[from]);
                for (std::size_t c = 0; c < 4; ++c) {
                    ASSERT_EQ(kept.color.as<std::uint16_t>()[4 * to + c],
                              all.color.as<std::uint16_t>()[4 * from + c]);
                }
                ASSERT_EQ(kept.extra[1].as<std::uint32_t>()[to],
                          all.extra[1].as<std::uint32_t>()[from]);
            }
        }
        EXPECT_EQ(kept.color.data.size(), kept.fragments() * kept.color.stride());
    }
}

}  // namespace
}  // namespace peeler
