// SPDX-License-Identifier: Apache-2.0
// Tests the grammar of frame lists, and the names of frames' files.
#include "cmd/options/frames.h"

#include <gtest/gtest.h>

#include <fstream>
#include <optional>
#include <utility>
#include <vector>

#include <peeler/error.h>
#include "formats/file/file_name.h"
#include "support/test_support.h"

namespace peeler::cmd {
namespace {

using Frames = std::vector<int>;

TEST(Frames, AreListedInTheOrderGiven) {
    const struct {
        const char* text;
        Frames frames;
    } rows[] = {
        {"7", {7}},
        {"-7", {-7}},
        {"1-4", {1, 2, 3, 4}},
        {"4-1", {4, 3, 2, 1}},
        {"1-10x3", {1, 4, 7, 10}},
        {"1-10:4", {1, 5, 9}},
        {"10-1x4", {10, 6, 2}},
        {"-3--1", {-3, -2, -1}},
        {"-1-1", {-1, 0, 1}},
        {"2--2x2", {2, 0, -2}},
        {"5,1-3,5,2-4", {5, 1, 2, 3, 4}},
        {"1-5x2,150,20-18", {1, 3, 5, 150, 20, 19, 18}},
        {"3-3", {3}},
        {"0001-0003", {1, 2, 3}},
        {"1-2x100", {1}},
    };
    for (const auto& row : rows)
        EXPECT_EQ(parseFrames(row.text), row.frames) << row.text;
}

TEST(Frames, RefusesWhatIsNone) {
    for (const char* text : {"",
                             ",",
                             "1,",
                             ",1",
                             "a",
                             "1-",
                             "-",
                             "--1",
                             "1-2-3",
                             "1-10x",
                             "1-10x0",
                             "1-10x-2",
                             "1x2",
                             "1.5",
                             "1 2",
                             " 1",
                             "1-10x2x2",
                             "99999999999",
                             "1-999999999",
                             "1-100000000",
                             "1-1000000000",
                             "-1000000000-1"}) {
        EXPECT_THROW(parseFrames(text), Error) << "'" << text << "'";
    }
    EXPECT_THROW(parseFrames("1-99999999"), Error);  // too many frames
    EXPECT_EQ(parseFrames("1-1000000").size(), 1000000U);
    EXPECT_THROW(parseFrames("1-1000000,2000000"), Error);
}

TEST(FramePath, PutsTheNumberWhereTheTokenIs) {
    const struct {
        const char* path;
        int frame;
        const char* expected;
    } rows[] = {
        {"a.####.exr", 7, "a.0007.exr"},
        {"a.####.exr", -7, "a.-0007.exr"},
        {"a.####.exr", 123456, "a.123456.exr"},
        {"a.##.exr", 7, "a.07.exr"},
        {"a#.exr", 7, "a0007.exr"},
        {"a.%04d.exr", 7, "a.0007.exr"},
        {"a.%04d.exr", -7, "a.-007.exr"},
        {"a.%d.exr", 7, "a.7.exr"},
        {"a.%02d.exr", 123, "a.123.exr"},
        {"100%%.#.exr", 7, "100%.0007.exr"},
        {"##/a.##.exr", 7, "##/a.07.exr"},
        {"##_##.exr", 7, "07_07.exr"},
    };
    for (const auto& row : rows) {
        EXPECT_TRUE(hasFrameToken(row.path)) << row.path;
        EXPECT_EQ(framePath(row.path, row.frame), row.expected);
    }
    for (const char* plain : {"a.exr", "##/a.exr", "a%.exr", "a%s.exr", "a%%04d.exr", "a.%4d.exr"})
        EXPECT_FALSE(hasFrameToken(plain)) << plain;
}

TEST(FrameNames, OfFilesThatExistAreFound) {
    const test::ScratchDir scratch;
    for (const char* const name : {"a.1.0002.exr", "a.0.0010.exr", "a.1.exr", "b.@.0003.exr", "c"})
        std::ofstream(scratch / name).put('x');
    const auto numbers = [&](const char* name) {
        std::vector<std::pair<int, int>> found;
        for (const FileNumbers& file : numbersThere(scratch / name))
            found.emplace_back(file.frame, file.view);
        return found;
    };
    using Pairs = std::vector<std::pair<int, int>>;
    EXPECT_EQ(numbers("a.@@@@.####.exr"), Pairs());
    EXPECT_EQ(numbers("a.1.####.exr"), (Pairs{{2, 0}}));
    EXPECT_EQ(numbers("a.%d.%04d.exr"), Pairs()) << "both are the frame";
    EXPECT_EQ(numbers("c"), (Pairs{{0, 0}}));
    EXPECT_EQ(numbers("d"), Pairs());
    for (const char* const name : {"v00.0002.exr", "v01.0002.exr", "v00.0010.exr"})
        std::ofstream(scratch / name).put('x');
    EXPECT_EQ(numbers("v@@.####.exr"), (Pairs{{2, 0}, {2, 1}, {10, 0}}));
    EXPECT_EQ(numbers("v@@.0002.exr"), (Pairs{{0, 0}, {0, 1}}));
    // framesThere() does not treat @ as a pattern.
    EXPECT_EQ(framesThere(scratch / "b.@.####.exr"), (Frames{3}));
    EXPECT_EQ(framesThere(scratch / "v01.####.exr"), (Frames{2}));
}

}  // namespace
}  // namespace peeler::cmd
