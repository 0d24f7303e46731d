// SPDX-License-Identifier: Apache-2.0
// Tests that OpenEXR headers with contradictory sizes are rejected before a library parses them.
#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <string>

#include <peeler/error.h>
#include "formats/image/exr_headers.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

using namespace std::string_literals;

std::string number(std::uint32_t value) {
    std::string bytes;
    for (unsigned shift = 0; shift < 32; shift += 8)
        bytes += static_cast<char>(value >> shift & 0xFFU);
    return bytes;
}

std::string attribute(const std::string& type, const std::string& value, int more = 0) {
    return "name\0"s + type + '\0' +
           number(static_cast<std::uint32_t>(static_cast<int>(value.size()) + more)) + value;
}

std::string channel(const std::string& name) {
    return name + '\0' + std::string(16, '\1');
}

/// Returns the error for a file with this header attribute and other bytes after it; "" if there is
/// no error.
std::string complaint(const std::string& attribute) {
    const ScratchDir scratch;
    const auto path = scratch / "a.exr";
    std::ofstream(path, std::ios::binary)
        << number(0x01312F76) << number(2) << attribute << '\0' << std::string(200, '\0');
    const RegularFile file(path);
    try {
        checkExrHeaders(file, path.string());
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        return error.what();
    }
    return {};
}

TEST(ExrHeaders, ValuesAreAsLongAsTheirTypesSay) {
    const std::string wrong = "the header is damaged: \"name\" has the wrong length for its type";
    EXPECT_EQ(complaint(attribute("float", std::string(4, '\0'))), "");
    EXPECT_EQ(complaint(attribute("float", std::string(5, '\0'))), wrong);
    EXPECT_EQ(complaint(attribute("m44f", std::string(60, '\0'))), wrong);
    EXPECT_EQ(complaint(attribute("string", "any length")), "");
    EXPECT_EQ(complaint(attribute("theirs", "any length")), "");
    EXPECT_EQ(complaint(attribute("string", "text", 1000)),
              "the header is damaged: \"name\" reaches beyond the end of the file");
}

TEST(ExrHeaders, ChannelsFillTheirList) {
    const std::string wrong = "the header is damaged: \"name\" has the wrong length for its type";
    EXPECT_EQ(complaint(attribute("chlist", "\0"s)), "");
    EXPECT_EQ(complaint(attribute("chlist", channel("R") + channel("alpha") + '\0')), "");
    EXPECT_EQ(complaint(attribute("chlist", "")), wrong);
    EXPECT_EQ(complaint(attribute("chlist", channel("R") + '\0', -1)), wrong);
    EXPECT_EQ(complaint(attribute("chlist", channel("R") + '\0', 1)), wrong);
    EXPECT_EQ(complaint(attribute("chlist", channel("R"))), wrong);
    EXPECT_EQ(complaint(attribute("chlist", channel("R") + "\0more"s)), wrong);
}

TEST(ExrHeaders, PreviewsHaveAsManyPixelsAsTheySay) {
    const std::string wrong = "the header is damaged: \"name\" has the wrong length for its type";
    EXPECT_EQ(complaint(attribute("preview", number(2) + number(3) + std::string(24, '\0'))), "");
    EXPECT_EQ(complaint(attribute("preview", number(0) + number(0))), "");
    EXPECT_EQ(complaint(attribute("preview", number(2) + number(3) + std::string(23, '\0'))),
              wrong);
    EXPECT_EQ(complaint(attribute("preview", number(1U << 31) + number(1U << 31))), wrong);
    EXPECT_EQ(complaint(attribute("preview", number(1U << 30) + number(0))), "");
    EXPECT_EQ(complaint(attribute("preview", "1234")), wrong);
}

}  // namespace
}  // namespace peeler::test
