// SPDX-License-Identifier: Apache-2.0
// Tests that UASTC blocks of every mode decode to the texels of the specification's tables.
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <map>

#include "formats/image/ktx2.h"
#include "formats/image/uastc_builder.h"

namespace peeler::test {
namespace {

using Texels = std::array<std::uint8_t, 64>;
using Color = std::array<std::uint8_t, 4>;

Texels texelsOf(const Bytes& block, bool srgb = false) {
    return uastcTexels(std::span<const std::uint8_t, 16>(block.data(), 16), srgb);
}

Color texel(const Texels& texels, std::size_t i) {
    return {texels[4 * i], texels[4 * i + 1], texels[4 * i + 2], texels[4 * i + 3]};
}

constexpr Color kErrorColor = {255, 0, 255, 255};

/// Returns a weight expanded by "UASTC unquantization values for weight expansion". The expanded
/// 5-bit weights increase by 2, except for a step of 4 in the middle.
unsigned expandedWeight(unsigned bits, unsigned weight) {
    constexpr unsigned kOfFour[] = {0, 4, 8, 12, 17, 21, 25, 29, 35, 39, 43, 47, 52, 56, 60, 64};
    constexpr unsigned kOfThree[] = {0, 9, 18, 27, 37, 46, 55, 64}, kOfTwo[] = {0, 21, 43, 64};
    switch (bits) {
        case 1:
            return 64 * weight;
        case 2:
            return kOfTwo[weight];
        case 3:
            return kOfThree[weight];
        case 4:
            return kOfFour[weight];
        default:
            return 2 * weight + (weight > 15 ? 2 : 0);
    }
}

/// Endpoint values of "UASTC unquantization data for Mode …", 0 to 255, by (digits, bits) and
/// index. In the index, the digit is above the bits.
const std::map<std::pair<unsigned, unsigned>, std::map<unsigned, std::uint8_t>> kUnquantized = {
    {{3, 2},
     {{0, 0},
      {1, 255},
      {2, 69},
      {3, 186},
      {4, 23},
      {5, 232},
      {6, 92},
      {7, 163},
      {8, 46},
      {9, 209},
      {10, 116},
      {11, 139}}},
    {{5, 3}, {{0, 0},   {1, 255},  {2, 32},   {3, 223}, {4, 65},   {7, 158},  {8, 6},
              {10, 39}, {13, 184}, {15, 151}, {16, 13}, {18, 45},  {23, 145}, {24, 19},
              {26, 52}, {31, 138}, {32, 26},  {34, 58}, {37, 164}, {38, 123}, {39, 132}}},
    {{3, 4},
     {{0, 0},
      {1, 255},
      {2, 16},
      {5, 223},
      {8, 65},
      {15, 142},
      {16, 5},
      {17, 250},
      {24, 70},
      {30, 119},
      {31, 136},
      {32, 11},
      {33, 244},
      {40, 76},
      {45, 147},
      {46, 124},
      {47, 131}}},
    {{5, 5},
     {{0, 0},
      {1, 255},
      {2, 8},
      {15, 199},
      {16, 64},
      {31, 135},
      {32, 1},
      {33, 254},
      {63, 134},
      {64, 3},
      {80, 67},
      {95, 132},
      {96, 4},
      {97, 251},
      {127, 131},
      {128, 6},
      {129, 249},
      {158, 126},
      {159, 129}}},
    {{3, 6},
     {{0, 0},
      {1, 255},
      {2, 4},
      {15, 227},
      {31, 195},
      {32, 64},
      {63, 131},
      {64, 1},
      {65, 254},
      {66, 5},
      {96, 65},
      {127, 130},
      {128, 2},
      {129, 253},
      {160, 66},
      {190, 126},
      {191, 129}}},
    // Values without a digit are scaled by repeating their bits.
    {{1, 4}, {{0, 0}, {15, 255}, {1, 0x11}, {7, 0x77}, {8, 0x88}, {10, 0xAA}, {14, 0xEE}}},
    {{1, 5}, {{0, 0}, {31, 255}, {1, 0x08}, {4, 0x21}, {16, 0x84}, {21, 0xAD}, {30, 0xF7}}},
    {{1, 8}, {{0, 0}, {255, 255}, {1, 1}, {77, 77}, {128, 128}, {200, 200}, {254, 254}}},
};

/// Returns endpoint indices and their values, taken from the tables in turn.
std::vector<std::pair<unsigned, std::uint8_t>> endpointsOf(const UastcLayout& mode,
                                                           std::size_t from) {
    const auto& known = kUnquantized.at({mode.digits, mode.endpoint_bits});
    std::vector<std::pair<unsigned, std::uint8_t>> all(known.begin(), known.end()), out;
    for (std::size_t i = 0; i < mode.endpoints(); ++i)
        out.push_back(all[(from + i) % all.size()]);
    return out;
}

/// Returns the subset of a texel by ASTC's algorithm for blocks of 4 × 4 (Khronos Data Format
/// Specification 1.3, "Partition Pattern Generation").
unsigned astcSubset(unsigned seed, unsigned x, unsigned y, unsigned count) {
    x *= 2;  // ASTC doubles x and y in blocks of fewer than 31 texels
    y *= 2;
    seed += (count - 1) * 1024;
    std::uint32_t p = seed;
    p ^= p >> 15U;
    p -= p << 17U;
    p += p << 7U;
    p += p << 4U;
    p ^= p >> 5U;
    p += p << 16U;
    p ^= p >> 7U;
    p ^= p >> 3U;
    p ^= p << 6U;
    p ^= p >> 17U;
    const unsigned odd = (seed & 2U) ? 4 : 5, other = count == 3 ? 6 : 5;
    const unsigned first = (seed & 1U) ? odd : other, second = (seed & 1U) ? other : odd;
    const auto part = [&](unsigned shift, unsigned by) {
        const unsigned four = p >> shift & 0xFU;
        return four * four >> by;
    };
    const unsigned a = (part(0, first) * x + part(4, second) * y + (p >> 14U)) & 0x3FU;
    const unsigned b = (part(8, first) * x + part(12, second) * y + (p >> 10U)) & 0x3FU;
    const unsigned c =
        count < 3 ? 0 : (part(16, first) * x + part(20, second) * y + (p >> 6U)) & 0x3FU;
    return a >= b && a >= c ? 0 : b >= c ? 1 : 2;
}

/// Returns an entry of the table "ASTC Partition Index for UASTC PAT values".
unsigned astcSeed(std::size_t mode, std::size_t pattern) {
    constexpr unsigned kTwo[] = {28,  20,  16,  29,  91,  9,   107, 72,  149, 204,
                                 50,  114, 496, 17,  78,  39,  252, 828, 43,  156,
                                 116, 210, 476, 273, 684, 359, 246, 195, 694, 524};
    constexpr unsigned kOfSeven[] = {36,  48,  61,  137, 161, 183, 226, 281, 302, 307,
                                     479, 495, 593, 594, 605, 799, 812, 988, 993};
    constexpr unsigned kThree[] = {260, 74, 32, 156, 183, 15, 745, 0, 335, 902, 254};
    return mode == 3 ? kThree[pattern] : mode == 7 ? kOfSeven[pattern] : kTwo[pattern];
}

/// The subset of each texel and the first texel (anchor) of each subset.
struct Partition {
    std::array<std::size_t, 16> subset{};
    std::vector<std::size_t> anchors;
};
Partition partitionOf(std::size_t mode, unsigned pattern) {
    const UastcLayout& layout = kUastcLayouts[mode];
    Partition out;
    out.anchors.resize(layout.subsets, 16);
    for (unsigned i = 0; i < 16; ++i) {
        const std::size_t subset =
            layout.subsets == 1 ? 0
                                : astcSubset(astcSeed(mode, pattern), i % 4, i / 4, layout.subsets);
        out.subset[i] = subset;
        out.anchors[subset] = std::min<std::size_t>(out.anchors[subset], i);
    }
    return out;
}

class UastcModes : public testing::TestWithParam<std::size_t> {
  protected:
    const UastcLayout& mode() const { return kUastcLayouts[GetParam()]; }

    UastcFields fields(unsigned pattern, const Partition& partition) const {
        UastcFields out;
        out.mode = GetParam();
        out.pattern = pattern;
        out.anchors = partition.anchors;
        out.weights.assign(std::size_t{16} * mode().planes, 0);
        out.endpoints.assign(mode().endpoints(), 0);
        return out;
    }
};

TEST_P(UastcModes, HaveTheEndpointsOfTheTables) {
    // With all weights 0, every texel has the low endpoint.
    for (std::size_t from = 0; from < 21; ++from) {
        const Partition partition = partitionOf(GetParam(), 0);
        UastcFields block = fields(0, partition);
        const auto endpoints = endpointsOf(mode(), from);
        for (std::size_t i = 0; i < endpoints.size(); ++i)
            block.endpoints[i] = endpoints[i].first;
        const Texels texels = texelsOf(uastcBlock(block));
        for (std::size_t i = 0; i < 16; ++i) {
            const auto low = [&](std::size_t channel) {
                return endpoints[2 * (partition.subset[i] * mode().channels + channel)].second;
            };
            const Color expected = mode().channels == 2
                                       ? Color{low(0), low(0), low(0), low(1)}
                                       : Color{low(0), low(1), low(2),
                                               mode().channels == 4 ? low(3) : std::uint8_t{255}};
            EXPECT_EQ(texel(texels, i), expected) << i;
        }
        EXPECT_EQ(texels, texelsOf(uastcBlock(block), true));
    }
}

TEST_P(UastcModes, HaveTheWeightsOfTheTables) {
    // Endpoints are 0 and 255 in every channel and subset, so the texels are the weights.
    const unsigned levels = 1U << mode().weight_bits;
    const Partition partition = partitionOf(GetParam(), 1 % mode().patterns);
    UastcFields block = fields(1 % mode().patterns, partition);
    for (std::size_t i = 1; i < block.endpoints.size(); i += 2)
        block.endpoints[i] = mode().digits > 1 ? 1 : (1U << mode().endpoint_bits) - 1;
    for (unsigned from = 0; from < levels; ++from) {
        for (std::size_t i = 0; i < block.weights.size(); ++i) {
            const std::size_t place = i / mode().planes;
            const bool anchor =
                std::count(partition.anchors.begin(), partition.anchors.end(), place) > 0;
            const auto weight = static_cast<unsigned>(from + place + 3 * (i % mode().planes));
            block.weights[i] = weight % (anchor ? levels / 2 : levels);
        }
        for (unsigned selector = 0; selector < (mode().selects ? 4U : 1U); ++selector) {
            block.selector = selector;
            const std::size_t own = mode().selects ? selector : 3;
            for (const bool srgb : {false, true}) {
                const Texels texels = texelsOf(uastcBlock(block), srgb);
                for (std::size_t i = 0; i < 16; ++i)
                    for (std::size_t c = 0; c < 4; ++c) {
                        const bool second = mode().planes == 2 && c == own;
                        const unsigned w =
                            expandedWeight(mode().weight_bits,
                                           block.weights[i * mode().planes + (second ? 1 : 0)]);
                        const bool opaque = c == 3 && mode().channels == 3;
                        const unsigned low = opaque ? (srgb ? 0xFF80 : 0xFFFF) : srgb ? 0x80 : 0;
                        const unsigned high = srgb ? 0xFF80 : 0xFFFF;
                        EXPECT_EQ(texels[4 * i + c], ((low * (64 - w) + high * w + 32) >> 6U) >> 8U)
                            << i << ' ' << c << ' ' << w;
                    }
            }
        }
    }
}

TEST_P(UastcModes, HaveThePartitionsOfAstc) {
    for (unsigned pattern = 0; pattern < 1U << mode().pattern_bits; ++pattern) {
        if (pattern >= mode().patterns) {
            const Texels texels = texelsOf(uastcBlock(fields(pattern, {})));
            for (std::size_t i = 0; i < 16; ++i)
                EXPECT_EQ(texel(texels, i), kErrorColor) << pattern;
            continue;
        }
        const Partition partition = partitionOf(GetParam(), pattern);
        UastcFields block = fields(pattern, partition);
        const auto& known = kUnquantized.at({mode().digits, mode().endpoint_bits});
        const std::size_t per_subset = std::size_t{2} * mode().channels;
        std::vector<std::uint8_t> red;
        for (std::size_t s = 0; s < mode().subsets; ++s) {
            const auto value = std::next(known.begin(), static_cast<std::ptrdiff_t>(s));
            red.push_back(value->second);
            std::fill_n(block.endpoints.begin() + static_cast<std::ptrdiff_t>(s * per_subset),
                        per_subset, value->first);
        }
        const Texels texels = texelsOf(uastcBlock(block));
        for (std::size_t i = 0; i < 16; ++i)
            EXPECT_EQ(texels[4 * i], red[partition.subset[i]]) << pattern << ' ' << i;
    }
}

INSTANTIATE_TEST_SUITE_P(All, UastcModes,
                         testing::Values(0, 1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 12, 13, 14, 15, 16, 17,
                                         18),
                         [](const auto& test) { return "Mode" + std::to_string(test.param); });

TEST(UastcBlock, MayBeOfOneColor) {
    const Texels texels = texelsOf(solidUastcBlock(1, 2, 3, 4));
    for (std::size_t i = 0; i < 16; ++i)
        EXPECT_EQ(texel(texels, i), (Color{1, 2, 3, 4}));
}

TEST(UastcBlock, OfNoModeHasTheErrorColor) {
    // Every seven-bit code selects a mode, except the reserved code.
    for (unsigned code = 0; code < 128; ++code) {
        Bytes block(16, 0);
        block[0] = static_cast<std::uint8_t>(code);
        for (std::size_t i = 0; i < 16; ++i)
            EXPECT_EQ(texel(texelsOf(block), i) == kErrorColor, code == 0x45) << code;
    }
}

TEST(UastcBlock, RoundsAsItsColorsAreMeant) {
    // Interpolation from 0 to 6 by 21/64: without sRGB (1542 · 21 + 32) >> 14, with sRGB (128 · 43
    // + 1664 · 21 + 32) >> 14.
    UastcFields block;
    block.mode = 1;
    block.endpoints = {0, 6, 0, 6, 0, 6};
    block.weights.assign(16, 1);
    EXPECT_EQ(texel(texelsOf(uastcBlock(block), false), 3), (Color{1, 1, 1, 255}));
    EXPECT_EQ(texel(texelsOf(uastcBlock(block), true), 3), (Color{2, 2, 2, 255}));
}

TEST(UastcBlock, TakesDigitsThatNoEncoderWrites) {
    // "Implementations should be resilient to ET bytes containing 243..255, which are mapped to
    // 0..12": 255 is read as 12, the trits 0, 1, 1, 0, 0.
    UastcFields block;
    block.mode = 3;
    block.endpoints.assign(18, 0);
    block.weights.assign(16, 0);
    block.anchors = partitionOf(3, 0).anchors;
    Bytes bytes = uastcBlock(block);
    for (unsigned bit = 24; bit < 32; ++bit)
        bytes[bit / 8] |= static_cast<std::uint8_t>(1U << bit % 8);
    // The third trit belongs to the low green endpoint of the first subset. Index 1 of 11 is the
    // value 23.
    EXPECT_EQ(texel(texelsOf(bytes), 0), (Color{0, 23, 0, 255}));
}

TEST(UastcPicture, EndsWhereItDoes) {
    Bytes blocks;
    for (std::uint8_t i = 1; i <= 4; ++i) {
        const Bytes block = solidUastcBlock(i, 0, 0, 255);
        blocks.insert(blocks.end(), block.begin(), block.end());
    }
    constexpr int kWidth = 6, kHeight = 5;
    std::vector<std::uint8_t> rgba(std::size_t{4} * kWidth * kHeight + 1, 99);
    decodeUastc(blocks, kWidth, kHeight, false, rgba.data());
    for (std::size_t y = 0; y < kHeight; ++y)
        for (std::size_t x = 0; x < kWidth; ++x)
            EXPECT_EQ(rgba[4 * (y * kWidth + x)], 1 + x / 4 + 2 * (y / 4)) << x << ' ' << y;
    EXPECT_EQ(rgba.back(), 99);
}

}  // namespace
}  // namespace peeler::test
