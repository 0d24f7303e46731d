// SPDX-License-Identifier: Apache-2.0
// Tests writing and reading JSON: any string can be written, and error messages are short.
#include "formats/file/json_text.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include <peeler/error.h>

namespace peeler::test {
namespace {

using Json = nlohmann::json;

TEST(JsonText, IsThatOfTheLibrary) {
    const Json value = {{"b", {1, 2.5, nullptr, true}}, {"a", "Größe \n"}};
    EXPECT_EQ(dumpJson(value), value.dump());
    EXPECT_EQ(dumpJson(value, 2), value.dump(2));
    EXPECT_EQ(dumpJson(value, -1, true), value.dump(-1, ' ', true));
    const nlohmann::ordered_json ordered = {{"b", 1}, {"a", 2}};
    EXPECT_EQ(dumpJson(ordered), R"({"b":1,"a":2})");
}

TEST(JsonText, CanAlwaysBeWritten) {
    const Json value = {{"list", {"*[\xe8g]lass*", "ok"}}, {"\xff", {{"deep", "ä\x80"}}}};
    EXPECT_EQ(dumpJson(value), R"({"\\xff":{"deep":"ä\\x80"},"list":["*[\\xe8g]lass*","ok"]})");
    EXPECT_TRUE(Json::accept(dumpJson(value)));
    // Different strings must stay different, so that hashes of the JSON differ.
    EXPECT_NE(dumpJson(Json("\xe8")), dumpJson(Json("\xe9")));
    EXPECT_EQ(dumpJson(nlohmann::ordered_json{{"z", "\xc0"}, {"a", 1}}), R"({"z":"\\xc0","a":1})");
    EXPECT_EQ(shownJson("\xe8"), R"("\\xe8")");
}

std::string problemOf(const std::string& text) {
    try {
        parseJson(text, "place");
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_EQ(error.where(), "place");
        return error.what();
    }
    return "";
}

TEST(JsonText, ThatIsDamagedIsNotRepeated) {
    EXPECT_NE(problemOf("{\"a\":\n {\"b\": }").find("line 2, column 8"), std::string::npos);
    const std::string long_one = problemOf("{\"uri\": \"" + std::string(20'000'000, 'A') + "\n\"}");
    EXPECT_NE(long_one.find("line 2, column 0"), std::string::npos) << long_one.substr(0, 1000);
    EXPECT_LT(long_one.size(), 500U);
    const std::string odd = problemOf("{\"\x1b]0;title\x07\xff\": 1}");
    EXPECT_FALSE(odd.empty());
    EXPECT_EQ(odd.find('\x1b'), std::string::npos) << odd;
    EXPECT_EQ(odd.find('\xff'), std::string::npos) << odd;
}

TEST(JsonText, ThatCanBeDoneWithoutIsNull) {
    EXPECT_EQ(parseJsonOrNull("{\"a\": 1}"), Json({{"a", 1}}));
    for (const std::string& text : {std::string(), std::string("{"), std::string("\xff"),
                                    std::string(100'000, '[') + std::string(100'000, ']')}) {
        EXPECT_TRUE(parseJsonOrNull(text).is_null());
        EXPECT_TRUE(parseOrderedJsonOrNull(text).is_null());
    }
}

}  // namespace
}  // namespace peeler::test
