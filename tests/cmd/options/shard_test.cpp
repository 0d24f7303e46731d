// SPDX-License-Identifier: Apache-2.0
// Tests the division of work into chunks: together the chunks are all of the work, and their sizes
// are nearly equal.
#include "cmd/cli/parse.h"

#include <gtest/gtest.h>

#include <algorithm>

#include <peeler/error.h>

namespace peeler::cmd {
namespace {

TEST(Shard, IsParsed) {
    EXPECT_EQ(parseShard("1/1").text(), "1/1");
    EXPECT_EQ(parseShard("3/7").index, 3);
    EXPECT_EQ(parseShard("3/7").count, 7);
    for (const char* text : {"", "/", "1", "1/", "/2", "0/2", "3/2", "-1/2", "1/0", "1/-2", "a/b",
                             "1/2/3", " 1/2", "1/2 ", "1.0/2", "1/99999999"}) {
        EXPECT_THROW(parseShard(text), Error) << "'" << text << "'";
    }
}

TEST(Shard, AllOfThemHaveEachItemOnce) {
    for (const std::size_t items : {0, 1, 2, 3, 7, 50, 1000}) {
        for (const int count : {1, 2, 3, 7, 50, 51, 999}) {
            std::size_t next = 0, least = items, most = 0;
            for (int i = 1; i <= count; ++i) {
                const auto [first, end] = Shard{i, count}.of(items);
                ASSERT_EQ(first, next);
                ASSERT_LE(first, end);
                next = end;
                least = std::min(least, end - first);
                most = std::max(most, end - first);
            }
            EXPECT_EQ(next, items);
            EXPECT_LE(most - least, 1U) << items << " in " << count;
        }
    }
}

}  // namespace
}  // namespace peeler::cmd
