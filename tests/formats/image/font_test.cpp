// SPDX-License-Identifier: Apache-2.0
#include "formats/image/font.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

namespace peeler {
namespace {

using Pixel = std::array<float, 4>;
constexpr Pixel kInk{0, 0.5F, 1, 1};

CompositeImage drawn(const std::string& text, int scale, int x, int y, int width, int height) {
    CompositeImage picture;
    picture.window = {0, 0, width, height};
    picture.rgba.resize(picture.window.pixels());
    drawText(picture, x, y, scale, kInk, text);
    return picture;
}

/// Returns the coverage of a character, from one row above its capital height to three rows below
/// its baseline.
std::vector<float> coverage(const std::string& character, int scale) {
    std::vector<float> alphas;
    const int width = kTextAdvance * scale, height = kGlyphRows * scale;
    for (const Pixel& pixel : drawn(character, scale, 0, kGlyphTop * scale, width, height).rgba)
        alphas.push_back(pixel[3]);
    return alphas;
}

/// Returns the first and the last row of a character with ink, counted from the top of capitals.
std::pair<int, int> rowsOf(char character, int scale) {
    const std::vector<float> all = coverage(std::string(1, character), scale);
    const auto inked = [](float alpha) { return alpha > 0.4F; };
    const auto first = std::ranges::find_if(all, inked) - all.begin();
    const auto last = std::find_if(all.rbegin(), all.rend(), inked).base() - all.begin() - 1;
    const int width = kTextAdvance * scale;
    return {static_cast<int>(first) / width - kGlyphTop * scale,
            static_cast<int>(last) / width - kGlyphTop * scale};
}

TEST(Font, HasAGlyphForEachCharacter) {
    for (int scale = 1; scale <= kMostTextScale; ++scale) {
        std::set<std::vector<float>> glyphs;
        for (char c = kFirstGlyph; c <= kLastGlyph; ++c)
            EXPECT_TRUE(glyphs.insert(coverage(std::string(1, c), scale)).second) << c;
        EXPECT_EQ(coverage("\xc3", scale), coverage("?", scale));
        EXPECT_EQ(std::ranges::count(coverage(" ", scale), 0.0F),
                  kTextAdvance * kGlyphRows * scale * scale);
    }
}

TEST(Font, CapitalsAreSevenDotsHigh) {
    for (int scale = 1; scale <= kMostTextScale; ++scale) {
        const auto [top, bottom] = rowsOf('H', scale);
        EXPECT_NEAR(top, 0, 1) << scale;
        EXPECT_EQ(bottom, kTextHeight * scale - 1) << scale;
        EXPECT_GT(rowsOf('g', scale).second, bottom);
        EXPECT_GT(rowsOf('x', scale).first, top);
    }
}

TEST(Font, BlendsTheColourAndAdvances) {
    const CompositeImage two = drawn("||", 2, 0, 2, 24, 22);
    for (int y = 0; y < 22; ++y) {
        for (int x = 0; x < 12; ++x) {
            const Pixel& first = two.rgba[static_cast<std::size_t>(y * 24 + x)];
            EXPECT_EQ(first, two.rgba[static_cast<std::size_t>(y * 24 + x + 12)]);
            EXPECT_FLOAT_EQ(first[1], 0.5F * first[3]);
            EXPECT_FLOAT_EQ(first[2], first[3]);
        }
    }
    EXPECT_GT(std::ranges::max(two.rgba, {}, [](const Pixel& p) { return p[3]; })[3], 0.8F);
}

TEST(Font, ClipsToThePicture) {
    const CompositeImage whole = drawn("M", 3, 0, 3, 18, 33), part = drawn("M", 3, -5, -4, 9, 9);
    for (int y = 0; y < 9; ++y)
        for (int x = 0; x < 9; ++x)
            EXPECT_EQ(part.rgba[static_cast<std::size_t>(y * 9 + x)],
                      whole.rgba[static_cast<std::size_t>((y + 7) * 18 + x + 5)]);
}

}  // namespace
}  // namespace peeler
