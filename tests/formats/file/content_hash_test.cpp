// SPDX-License-Identifier: Apache-2.0
#include "formats/file/content_hash.h"

#include <OpenImageIO/hash.h>
#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace peeler::test {
namespace {

std::uint64_t hashOf(std::string_view text, std::uint64_t seed) {
    return contentHash(std::as_bytes(std::span(text)), seed);
}

// From xxHash's specification, and from python3-xxhash: xxh64("Nobody inspects the spammish
// repetition").
TEST(ContentHash, IsXxh64) {
    EXPECT_EQ(hashOf("", 0), 0xEF46DB3751D8E999U);
    EXPECT_EQ(hashOf("Nobody inspects the spammish repetition", 0), 0xFBCEA83C8A378BF1U);
}

TEST(ContentHash, IsThatOfFilesWrittenWithOpenImageIosHash) {
    const std::string text(1000, 'p');
    for (const std::size_t size : {0U, 1U, 7U, 31U, 32U, 33U, 1000U})
        for (const std::uint64_t seed : {std::uint64_t{0}, ~std::uint64_t{5}})
            EXPECT_EQ(hashOf(std::string_view(text).substr(0, size), seed),
                      OIIO::xxhash::xxhash(text.data(), size, seed))
                << size;
}

}  // namespace
}  // namespace peeler::test
