// SPDX-License-Identifier: Apache-2.0
// Tests messages that name parameters.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <peeler/error.h>
#include <peeler/text.h>
#include "core/base/printable.h"

namespace peeler {
namespace {

std::string capitals(const Text& text) {
    return text.spelled([](Parameter) { return std::string("P"); });
}

TEST(Text, NamesParametersInBackquotes) {
    const Text text = "give " + Parameter::kSize + " or " + Parameter::kMaxLayers;
    EXPECT_EQ(text.str(), "give `size` or `max_layers`");
    EXPECT_EQ(capitals(text), "give P or P");
    EXPECT_EQ(Text(Parameter::kEye).str(), "`eye`");
    EXPECT_EQ((Parameter::kEye + ", " + Parameter::kUp).str(), "`eye`, `up`");
    EXPECT_EQ(Text().str(), "");
}

TEST(Text, SpellsNoWordsThatLookLikeAParameter) {
    const std::string file = "`size`";
    EXPECT_EQ(capitals(file + ": " + Parameter::kSize + " " + file), "`size`: P `size`");
}

TEST(Text, PutsPiecesTogether) {
    Text text = "a " + Parameter::kUp;
    text += text;
    EXPECT_EQ(text.str(), "a `up`a `up`");
    EXPECT_EQ(capitals(text), "a Pa P");
    EXPECT_EQ(capitals(Text(Parameter::kUp + ".").withoutEnd('.')), "P");
    EXPECT_EQ(capitals(Text(Parameter::kUp).withoutEnd('`')), "P");
}

TEST(Text, IsMadePrintableBetweenItsParameters) {
    const Text text = printableText("a\nb " + Parameter::kUp + " c\r", 100);
    EXPECT_EQ(text.str(), "a\\x0ab `up` c\\x0d");
    EXPECT_EQ(capitals(text), "a\\x0ab P c\\x0d");
}

TEST(Error, KeepsItsParameters) {
    const Error error(ErrorKind::kUsage, "no " + Parameter::kSize, Parameter::kSize + " 4",
                      "leave " + Parameter::kSize + " out");
    EXPECT_STREQ(error.what(), "no `size`");
    EXPECT_EQ(capitals(error.whatText()), "no P");
    EXPECT_EQ(capitals(error.whereText()), "P 4");
    EXPECT_EQ(capitals(error.hintText()), "leave P out");
}

TEST(Error, CutsTextsBetweenCharacters) {
    const std::string words(7999, 'a');
    EXPECT_EQ(std::string(Error(ErrorKind::kInput, words + "b").what()), words + "b");
    EXPECT_EQ(std::string(Error(ErrorKind::kInput, words + "bc").what()), words + "b…");
    EXPECT_EQ(std::string(Error(ErrorKind::kInput, words + "éc").what()), words + "…");
    const Error named(ErrorKind::kInput, Parameter::kSize + words);
    EXPECT_EQ(capitals(named.whatText()), "P" + words.substr(0, 8000 - 6) + "…");
}

}  // namespace
}  // namespace peeler
