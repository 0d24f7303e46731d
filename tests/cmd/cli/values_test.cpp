// SPDX-License-Identifier: Apache-2.0
// Tests the parsing of values and names on the command line.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include <peeler/error.h>
#include "cmd/cli/parse.h"
#include "cmd/options/capture_options.h"
#include "cmd/session/choices.h"

namespace peeler::cmd {
namespace {

/// Returns the kind of the Error that `work` throws; kInternal if it throws none.
template <class Work>
ErrorKind thrown(Work&& work) {
    try {
        work();
    } catch (const Error& error) {
        EXPECT_STRNE(error.what(), "");
        return error.kind();
    }
    return ErrorKind::kInternal;
}

TEST(ParseNumber, TakesDecimalNumbersOnly) {
    EXPECT_EQ(parseNumber("-1.5e3"), -1500);
    EXPECT_EQ(parseNumber("+2"), 2);
    EXPECT_EQ(parseNumber(".5"), 0.5);
    for (const char* text :
         {"", "nan", "inf", "-inf", "1e999", "1,5", "0x10", "1 ", " 1", "++1", "+-1", "one"}) {
        EXPECT_EQ(thrown([&] { parseNumber(text); }), ErrorKind::kUsage) << text;
    }
}

TEST(ParseNumber, PositiveAndInfinite) {
    EXPECT_EQ(parsePositive("1e-30"), 1e-30);
    EXPECT_EQ(parsePositiveOrInfinite("inf"), std::numeric_limits<double>::infinity());
    EXPECT_EQ(thrown([] { parsePositive("0"); }), ErrorKind::kUsage);
    EXPECT_EQ(thrown([] { parsePositiveOrInfinite("-inf"); }), ErrorKind::kUsage);
}

TEST(ParseSize, TakesSidesAndAWidthAlone) {
    EXPECT_EQ(parseSize("1920x1080"), (Size{1920, 1080}));
    EXPECT_EQ(parseSize("1920"), (Size{1920, 0}));
    EXPECT_EQ(parseSize("65536x16384"), (Size{65536, 16384}));
    EXPECT_EQ(parseSize("1x1"), (Size{1, 1}));
    EXPECT_EQ(parseSize("100X80"), (Size{100, 80}));
}

TEST(ParseSize, RefusesTheAbsurd) {
    for (const char* text : {"",
                             "x",
                             "0x0",
                             "0x10",
                             "10x0",
                             "-1x10",
                             "10x-1",
                             "10x",
                             "x10",
                             "1x1x1",
                             "65537x1",
                             "1x65537",
                             "65536x65536",
                             "99999999999999999999x1",
                             "1e3x10",
                             "nan",
                             "10 x 10",
                             "10,10",
                             "10x10X10",
                             "4294967297x1"}) {
        EXPECT_EQ(thrown([&] { parseSize(text); }), ErrorKind::kUsage) << text;
    }
}

TEST(ParseCrop, IsPlaceAndSize) {
    EXPECT_EQ(parseCrop("10,20,30,40"), (Window{10, 20, 40, 60}));
    for (const char* text :
         {"", "1,2,3", "-1,0,5,5", "0,0,0,5", "0,0,5,0", "0,0,99999999999,1", "a,b,c,d"}) {
        EXPECT_EQ(thrown([&] { parseCrop(text); }), ErrorKind::kUsage) << text;
    }
}

TEST(ParseBytes, KnowsBothKindsOfUnits) {
    EXPECT_EQ(parseBytes("8G"), std::uint64_t{8} << 30);
    EXPECT_EQ(parseBytes("8GiB"), std::uint64_t{8} << 30);
    EXPECT_EQ(parseBytes("8gb"), 8'000'000'000U);
    EXPECT_EQ(parseBytes("1.5M"), 1'572'864U);
    EXPECT_EQ(parseBytes("123"), 123U);
    EXPECT_EQ(parseBytes("2TB"), 2'000'000'000'000U);
    for (const char* text : {"", "G", "-8G", "8X", "8 G", "1e30", "nan", "0", "9999999T", "8GG"}) {
        EXPECT_EQ(thrown([&] { parseBytes(text); }), ErrorKind::kUsage) << text;
    }
}

TEST(ParseColor, LinearAndSrgb) {
    EXPECT_EQ(parseColor("transparent"), (std::array<float, 4>{0, 0, 0, 0}));
    EXPECT_EQ(parseColor("0.25,2,0"), (std::array<float, 4>{0.25F, 2, 0, 1}));
    EXPECT_EQ(parseColor("1,1,1,0.5"), (std::array<float, 4>{1, 1, 1, 0.5F}));
    EXPECT_EQ(parseColor("#ff0000"), (std::array<float, 4>{1, 0, 0, 1}));
    // 0x80 / 255 decodes to 0.21586…; alpha is not encoded.
    const auto grey = parseColor("#80808080");
    EXPECT_NEAR(grey[0], 0.2158605F, 1e-6F);
    EXPECT_FLOAT_EQ(grey[3], 128.0F / 255.0F);
    EXPECT_EQ(parseColor("#fff"), parseColor("#ffffff"));
    EXPECT_EQ(parseColor("#8468"), parseColor("#88446688"));
    EXPECT_EQ(parseColor("white"), (std::array<float, 4>{1, 1, 1, 1}));
    EXPECT_EQ(parseColor("Teal"), parseColor("#008080"));
    EXPECT_EQ(parseColor("grey"), parseColor("gray"));
    for (const char* text : {"", "#", "#ff", "#fffff", "#ggg", "#gg0000", "#-10000", "1,1",
                             "1,1,1,2", "-1,0,0", "nan,0,0", "1,1,1,1,1", "reddish", "1e9,0,0"}) {
        EXPECT_EQ(thrown([&] { parseColor(text); }), ErrorKind::kUsage) << text;
    }
}

TEST(ParseVector, TakesThreeNumbers) {
    EXPECT_EQ(parseVector("-1,.5,2e3"), glm::dvec3(-1, 0.5, 2000));
    for (const char* text : {"", "1,2", "1,2,3,4", "1,,3", "1;2;3", "nan,0,0"}) {
        EXPECT_EQ(thrown([&] { parseVector(text); }), ErrorKind::kUsage) << text;
    }
}

TEST(ParseLayers, AllOrANumber) {
    EXPECT_EQ(parseLayers("all"), 0U);
    EXPECT_EQ(parseLayers("0"), 0U);
    EXPECT_EQ(parseLayers("12"), 12U);
    for (const char* text : {"", "-1", "none", "1.5", "4294967296"}) {
        EXPECT_EQ(thrown([&] { parseLayers(text); }), ErrorKind::kUsage) << text;
    }
}

TEST(NearestName, FindsWhatWasMeant) {
    constexpr std::string_view kNames[] = {"a-buffer", "front-to-back", "dual"};
    const auto nearest = [&](std::string_view text) { return nearestName(text, kNames); };
    EXPECT_EQ(nearest("abuffer"), "a-buffer");
    EXPECT_EQ(nearest("A-Bufer"), "a-buffer");
    EXPECT_EQ(nearest("a-bufefr"), "a-buffer");
    EXPECT_EQ(nearest("fr"), "front-to-back");
    EXPECT_EQ(nearest("daul"), "dual");
    EXPECT_EQ(nearest("raytrace"), "");
    EXPECT_EQ(nearest(""), "");
    EXPECT_EQ(nearestName("x", {}), "");
}

TEST(NearestName, BearsNamesOfAnyLength) {
    const std::string long_name(100'000, 'n');
    const std::string_view names[] = {long_name};
    EXPECT_EQ(nearestName(std::string(100'000, 'm'), names), "");
}

TEST(ListedNames, AreThoseBetweenCommas) {
    constexpr std::string_view kNames[] = {"all", "visible", "transparent"};
    const auto listed = [&](std::string_view text) { return listedNames("choice", text, kNames); };
    EXPECT_EQ(listed("visible"), (std::vector<std::string_view>{"visible"}));
    EXPECT_EQ(listed("visible,all"), (std::vector<std::string_view>{"visible", "all"}));
    for (const char* text : {"", ",", "all,", ",all", "all,,visible", "all, visible", "All", "x"})
        EXPECT_EQ(thrown([&] { listed(text); }), ErrorKind::kUsage) << text;
}

TEST(RefuseName, ListsTheChoices) {
    constexpr std::string_view kNames[] = {"all", "visible"};
    try {
        refuseName("choice", "visibel", kNames);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_STREQ(error.what(), "unknown choice 'visibel'");
        EXPECT_EQ(error.hint(), "did you mean 'visible'?\nthe choices are: all, visible");
    }
}

TEST(Choices, NamesAndValuesAreOneToOne) {
    for (const auto& row : kSurfaces) {
        EXPECT_EQ(choose<Surfaces>("surfaces", kSurfaces, row.name), row.value);
        EXPECT_EQ(nameOf<Surfaces>(kSurfaces, row.value), row.name);
    }
    for (const auto& row : kFaces)
        EXPECT_EQ(nameOf<Faces>(kFaces, row.value), row.name);
}

}  // namespace
}  // namespace peeler::cmd
