// SPDX-License-Identifier: Apache-2.0
// Tests the conversion of strings from files to printable text for messages, and the maximum length
// of error texts.
#include "core/base/printable.h"

#include <gtest/gtest.h>

#include <string>

#include <peeler/error.h>

namespace peeler::test {
namespace {

TEST(Printable, LeavesTextsAlone) {
    for (const char* text : {"", "a name.glb", "\\x41", "Größe ❤♻ 漢字", "👩\u200d🚀", "\U0010FFFD"})
        EXPECT_EQ(printable(text), text);
}

TEST(Printable, EscapesWhatSteersATerminal) {
    EXPECT_EQ(printable("a\x1b[31m\r\nb\x7f"), "a\\x1b[31m\\x0d\\x0ab\\x7f");
    EXPECT_EQ(printable("\u009b31m"), "\\xc2\\x9b31m") << "CSI of one character";
    EXPECT_EQ(printable("a\u202egpj.exe"), "a\\xe2\\x80\\xaegpj.exe") << "right to left";
    EXPECT_EQ(printable("a\u2028b\u2066c\ufeff"),
              "a\\xe2\\x80\\xa8b\\xe2\\x81\\xa6c\\xef\\xbb\\xbf");
    EXPECT_EQ(printable(std::string_view("a\0b", 3)), "a\\x00b");
}

TEST(Printable, EscapesWhatIsNoUtf8) {
    EXPECT_EQ(printable("*[\xe8g]lass*"), "*[\\xe8g]lass*");
    for (const char* bad :
         {"\x80", "\xc0\xaf", "\xc1\xbf", "\xe0\x9f\xbf", "\xed\xa0\x80", "\xf0\x8f\xbf\xbf",
          "\xf4\x90\x80\x80", "\xf5\x80\x80\x80", "\xe2\x82"}) {
        std::string expected;
        for (const char* byte = bad; *byte; ++byte)
            expected += escapedByte(*byte);
        EXPECT_EQ(printable(std::string("<") + bad + ">"), "<" + expected + ">");
    }
}

TEST(Printable, CutsBetweenCharacters) {
    EXPECT_EQ(printable("abcd", 4), "abcd");
    EXPECT_EQ(printable("abcde", 4), "abcd…");
    EXPECT_EQ(printable("ab漢字", 6), "ab漢…");
    EXPECT_LT(printable(std::string(20'000'000, 'x')).size(), kMostOfName + 10);
}

TEST(Printable, NoErrorIsEndless) {
    const std::string endless = "a" + std::string(10'000'000, 'x');
    const Error error(ErrorKind::kInput, endless, endless, endless);
    for (const std::string& text : {std::string(error.what()), error.where(), error.hint()}) {
        EXPECT_EQ(text.size(), kMostOfLine + 3);
        EXPECT_TRUE(text.ends_with("x…"));
    }
    std::string wide;
    while (wide.size() < 10'000)
        wide += "漢";
    EXPECT_EQ(printable(Error(ErrorKind::kInput, wide).what(), 9'000).find('\\'), std::string::npos)
        << "cut within a character";
    EXPECT_STREQ(Error(ErrorKind::kInput, "short").what(), "short");
}

}  // namespace
}  // namespace peeler::test
