// SPDX-License-Identifier: Apache-2.0
// UASTC decoder.
//
// The tables are those of the specification; comments quote its section titles. The partitions are
// those that ASTC generates from the numbers in "Multi-subset blocks".
#include <algorithm>
#include <cstring>

#include "formats/image/ktx2.h"

namespace peeler {
namespace {

/// A mode of a block ("Mode Index", "Block configuration bits", "Endpoint bits for each mode",
/// "UASTC weight bits for each mode").
struct UastcMode {
    std::uint8_t code, code_bits;
    std::uint8_t hint_bits;     ///< number of bits that only transcoders to other formats use
    std::uint8_t pattern_bits;  ///< number of bits of the field PAT
    std::uint8_t subsets;       ///< number of subsets, each with its own endpoints
    std::uint8_t channels;      ///< 2 for LA, 3 for RGB, 4 for RGBA
    /// The number of values of the digit above the endpoint bits: 3 for trits, 5 for quints, 1 for
    /// no digit.
    std::uint8_t digits;
    std::uint8_t endpoint_bits;
    std::uint8_t weight_bits;
    std::uint8_t planes;  ///< number of weight planes; if 2, one channel has its own weights
    /// Whether CSEL selects the channel with its own weights; otherwise this channel is alpha.
    bool selects;
};
constexpr UastcMode kUastcModes[] = {
    {0x01, 4, 15, 0, 1, 3, 3, 6, 4, 1, false},  //
    {0x35, 6, 15, 0, 1, 3, 1, 8, 2, 1, false},  //
    {0x1D, 5, 15, 5, 2, 3, 1, 4, 3, 1, false},  //
    {0x03, 5, 15, 4, 3, 3, 3, 2, 2, 1, false},  //
    {0x13, 5, 15, 5, 2, 3, 5, 3, 2, 1, false},  //
    {0x0B, 5, 15, 0, 1, 3, 1, 8, 3, 1, false},  //
    {0x1B, 5, 15, 0, 1, 3, 5, 5, 2, 2, true},   //
    {0x07, 5, 15, 5, 2, 3, 5, 3, 2, 1, false},  //
    {0x17, 5, 0, 0, 0, 4, 1, 8, 0, 0, false},   // block of a single colour
    {0x0F, 5, 23, 5, 2, 4, 1, 4, 2, 1, false},  //
    {0x02, 3, 17, 0, 1, 4, 3, 4, 4, 1, false},  //
    {0x00, 2, 17, 0, 1, 4, 3, 4, 2, 2, true},   //
    {0x06, 3, 17, 0, 1, 4, 3, 6, 3, 1, false},  //
    {0x1F, 5, 23, 0, 1, 4, 1, 8, 1, 2, true},   //
    {0x0D, 5, 23, 0, 1, 4, 1, 8, 2, 1, false},  //
    {0x05, 7, 23, 0, 1, 2, 1, 8, 4, 1, false},  //
    {0x15, 6, 23, 5, 2, 2, 1, 8, 2, 1, false},  //
    {0x25, 6, 23, 0, 1, 2, 1, 8, 2, 2, false},  //
    {0x09, 4, 15, 0, 1, 3, 1, 5, 5, 1, false},  //
};
constexpr std::size_t kSolidMode = 8, kModeOfSevenPatterns = 7;
constexpr unsigned kMostModeBits = 7;

/// The mode for the lowest 7 bits of a block; std::size(kUastcModes) if the bits are invalid.
constexpr auto kModeOfBits = [] {
    std::array<std::uint8_t, 1U << kMostModeBits> modes{};
    for (std::size_t bits = 0; bits < modes.size(); ++bits) {
        modes[bits] = std::size(kUastcModes);
        for (std::size_t i = 0; i < std::size(kUastcModes); ++i)
            if ((bits & ((1U << kUastcModes[i].code_bits) - 1)) == kUastcModes[i].code)
                modes[bits] = static_cast<std::uint8_t>(i);
    }
    return modes;
}();

/// For each pattern, one bit per texel, first texel in the lowest bit. The bit is set if the texel
/// is in the second subset ("Partition table for 2-subset Mode Indices 2, 4, 9, and 16").
constexpr std::uint16_t kTwoSubsets[] = {
    0xCCCC, 0x8888, 0x1111, 0xECC8, 0x377F, 0xFEEC, 0x0137, 0x137F, 0xC800, 0x0013,
    0xFE80, 0x17FF, 0x0017, 0x00FF, 0xFFF0, 0x0FFF, 0xFF71, 0x8EFF, 0x08CE, 0x008C,
    0x7310, 0xCEFF, 0x7331, 0x088C, 0xCEEF, 0x6666, 0xF00F, 0x5555, 0x0F0F, 0x36C9};
/// Like kTwoSubsets, for mode 7 ("Partition table for 2-subset Mode Index 7").
constexpr std::uint16_t kTwoSubsetsOfSeven[] = {
    0x00F0, 0x4444, 0x0133, 0xCC80, 0xF0FF, 0x2222, 0xFFC8, 0xCCCE, 0x3C03, 0x00EE,
    0x7700, 0x3003, 0x00CE, 0xFF80, 0x6FFF, 0x1333, 0x11FF, 0x136C, 0x00EF};
/// For each pattern, two bits per texel, first texel in the lowest bits: the texel's subset
/// ("Partition table for 3-subset Mode Index 3").
constexpr std::uint32_t kThreeSubsets[] = {0xA5A50000, 0xAA005555, 0xAA000055, 0x0000AA55,
                                           0x25252525, 0x94949494, 0x58585858, 0x56560202,
                                           0x92929292, 0x55AA0055, 0xA05050A0};

constexpr std::size_t kUastcTexels = 16, kMostSubsets = 3, kUastcChannels = 4;

struct UastcPattern {
    std::array<std::uint8_t, kUastcTexels> subset{};  ///< subset of each texel
    /// Bit mask of the anchors: the first texel of each subset. An anchor's weight is stored
    /// without its top bit.
    std::uint32_t anchors = 1;
};

template <std::size_t n, class Mask>
constexpr std::array<UastcPattern, n> patternsFrom(const Mask (&masks)[n]) {
    constexpr unsigned kBits = sizeof(Mask) * 8 / kUastcTexels;
    std::array<UastcPattern, n> all{};
    for (std::size_t i = 0; i < n; ++i) {
        std::uint32_t seen = 0;
        all[i].anchors = 0;
        for (std::size_t texel = 0; texel < kUastcTexels; ++texel) {
            const std::uint32_t subset = masks[i] >> (kBits * texel) & ((1U << kBits) - 1);
            all[i].subset[texel] = static_cast<std::uint8_t>(subset);
            if ((seen >> subset & 1U) == 0) all[i].anchors |= 1U << texel;
            seen |= 1U << subset;
        }
    }
    return all;
}
constexpr UastcPattern kOneSubset[] = {{}};
constexpr auto kPatternsOfTwo = patternsFrom(kTwoSubsets);
constexpr auto kPatternsOfSeven = patternsFrom(kTwoSubsetsOfSeven);
constexpr auto kPatternsOfThree = patternsFrom(kThreeSubsets);

std::span<const UastcPattern> patternsOf(std::size_t mode) {
    if (kUastcModes[mode].subsets == 3) return kPatternsOfThree;
    if (kUastcModes[mode].subsets == 1) return kOneSubset;
    if (mode == kModeOfSevenPatterns) return kPatternsOfSeven;
    return kPatternsOfTwo;
}

/// The parameters C and B of "Endpoint Unquantization" in ASTC. B consists of the bits above the
/// lowest bit, times `factor`, shifted right by `shift`.
struct DigitRow {
    unsigned digits, bits, c, factor, shift;
};
constexpr DigitRow kDigitRows[] = {
    {3, 2, 93, 0x116, 0}, {5, 3, 26, 0x105, 1}, {3, 4, 22, 0x41, 0},
    {5, 5, 6, 0x101, 3},  {3, 6, 5, 0x101, 4},
};

/// Returns the 8-bit value of a packed endpoint: its bits and, above the bits, its trit or quint,
/// if any.
constexpr std::uint8_t widenedEndpoint(const UastcMode& mode, unsigned packed) {
    const unsigned bits = mode.endpoint_bits, number = packed & ((1U << bits) - 1);
    unsigned out = bits < 4 ? 0 : number << (8 - bits) | number >> (2 * bits - 8);
    for (const DigitRow& row : kDigitRows) {
        if (row.digits != mode.digits || row.bits != bits) continue;
        const unsigned a = number & 1U ? 0x1FF : 0;
        const unsigned b = (number >> 1U) * row.factor >> row.shift;
        out = (a & 0x80U) | (((packed >> bits) * row.c + b) ^ a) >> 2U;
    }
    return static_cast<std::uint8_t>(out);
}
constexpr auto kUastcEndpoints = [] {
    std::array<std::array<std::uint8_t, 256>, std::size(kUastcModes)> tables{};
    for (std::size_t mode = 0; mode < tables.size(); ++mode)
        for (unsigned packed = 0;
             packed >> kUastcModes[mode].endpoint_bits < kUastcModes[mode].digits; ++packed)
            tables[mode][packed] = widenedEndpoint(kUastcModes[mode], packed);
    return tables;
}();

/// The weights of "Weight Unquantization" in ASTC, by number of bits and stored weight. The bits
/// are repeated to 6 bits. Then values above 32 are increased by 1, so that 63 becomes 64.
constexpr auto kUastcWeights = [] {
    std::array<std::array<std::uint8_t, 32>, 6> tables{};
    for (unsigned bits = 1; bits < tables.size(); ++bits)
        for (unsigned weight = 0; weight < 1U << bits; ++weight) {
            unsigned six = 0;
            for (unsigned i = 0; i < 6; ++i)
                six = six << 1U | (weight >> (bits - 1 - i % bits) & 1U);
            tables[bits][weight] = static_cast<std::uint8_t>(six + (six > 32 ? 1 : 0));
        }
    return tables;
}();

/// A reader of the bits of a block, lowest bit first.
class UastcBits {
  public:
    explicit UastcBits(std::span<const std::uint8_t, kUastcBytes> block) {
        for (std::size_t i = 8; i-- > 0;) {
            low_ = low_ << 8U | block[i];
            high_ = high_ << 8U | block[8 + i];
        }
    }
    /// Consumes and returns the next bits, up to 32.
    unsigned take(unsigned count) {
        const auto value = static_cast<unsigned>(low_ & ((std::uint64_t{1} << count) - 1));
        low_ = low_ >> count | high_ << 1U << (63 - count);
        high_ >>= count;
        return value;
    }
    unsigned peek() const { return static_cast<unsigned>(low_ & ((1U << kMostModeBits) - 1)); }

  private:
    std::uint64_t low_ = 0, high_ = 0;
};

/// The line between the endpoints of a subset, widened to 16 bits. The value at weight w, from 0 to
/// 64, is (start + w · step) >> 14 ("Decoding pixel values").
struct UastcLine {
    std::array<std::int32_t, kUastcChannels> start{}, step{};

    void set(std::size_t channel, std::uint8_t low, std::uint8_t high, bool srgb) {
        const auto wide = [srgb](std::int32_t value) { return value << 8 | (srgb ? 0x80 : value); };
        start[channel] = 64 * wide(low) + 32;
        step[channel] = wide(high) - wide(low);
    }
};

/// Reads "Endpoint encoding": first all trits or quints, several packed into a number, then all
/// bits. For each subset and channel, the low endpoint comes before the high endpoint.
std::array<UastcLine, kMostSubsets> takeEndpoints(UastcBits& bits, std::size_t index, bool srgb) {
    const UastcMode& mode = kUastcModes[index];
    constexpr std::size_t kMost = 2 * kMostSubsets * kUastcChannels;
    const std::size_t count = std::size_t{2} * mode.subsets * mode.channels;
    std::array<unsigned, kMost> digits{};
    if (mode.digits > 1) {
        constexpr unsigned kBitsOfTrits[] = {0, 2, 4, 5, 7, 8}, kBitsOfQuints[] = {0, 3, 5, 7};
        const bool trits = mode.digits == 3;
        const std::size_t together = trits ? 5 : 3;
        for (std::size_t i = 0; i < count; i += together) {
            const std::size_t left = std::min(together, count - i);
            unsigned packed = bits.take(trits ? kBitsOfTrits[left] : kBitsOfQuints[left]);
            for (std::size_t k = 0; k < left; ++k, packed /= mode.digits)
                digits[i + k] = packed % mode.digits;
        }
    }
    std::array<UastcLine, kMostSubsets> lines;
    const auto& widened = kUastcEndpoints[index];
    std::size_t i = 0;
    const auto take = [&] {
        return widened[digits[i++] << mode.endpoint_bits | bits.take(mode.endpoint_bits)];
    };
    for (std::size_t subset = 0; subset < mode.subsets; ++subset) {
        UastcLine& line = lines[subset];
        if (mode.channels < 4) line.set(3, 255, 255, srgb);
        for (std::size_t channel = 0; channel < mode.channels; ++channel) {
            const std::uint8_t low = take(), high = take();
            if (mode.channels == 2 && channel == 0)
                for (std::size_t c = 0; c < 3; ++c)
                    line.set(c, low, high, srgb);
            else
                line.set(mode.channels == 2 ? 3 : channel, low, high, srgb);
        }
    }
    return lines;
}

}  // namespace

std::array<std::uint8_t, 64> uastcTexels(std::span<const std::uint8_t, kUastcBytes> block,
                                         bool srgb) {
    std::array<std::uint8_t, kUastcTexels * kUastcChannels> out{};
    const auto fill = [&](const std::array<std::uint8_t, kUastcChannels>& color) {
        for (std::size_t i = 0; i < out.size(); ++i)
            out[i] = color[i % kUastcChannels];
        return out;
    };
    constexpr std::array<std::uint8_t, kUastcChannels> kNoBlock = {255, 0, 255, 255};
    UastcBits bits(block);
    const std::size_t index = kModeOfBits[bits.peek()];
    if (index == std::size(kUastcModes)) return fill(kNoBlock);
    const UastcMode& mode = kUastcModes[index];
    bits.take(mode.code_bits);
    if (index == kSolidMode) {
        std::array<std::uint8_t, kUastcChannels> color{};
        for (std::uint8_t& channel : color)
            channel = static_cast<std::uint8_t>(bits.take(8));
        return fill(color);
    }
    bits.take(mode.hint_bits);
    const std::size_t number = bits.take(mode.pattern_bits);
    const std::span<const UastcPattern> patterns = patternsOf(index);
    if (number >= patterns.size()) return fill(kNoBlock);
    const UastcPattern& pattern = patterns[number];
    const bool two_planes = mode.planes == 2;
    const std::size_t own = mode.selects ? bits.take(2) : two_planes ? 3 : kUastcChannels;

    const std::array<UastcLine, kMostSubsets> lines = takeEndpoints(bits, index, srgb);
    const auto& weights = kUastcWeights[mode.weight_bits];
    for (std::size_t texel = 0; texel < kUastcTexels; ++texel) {
        const unsigned size = mode.weight_bits - (pattern.anchors >> texel & 1U);
        std::array<std::int32_t, kUastcChannels> weight{};
        weight.fill(weights[bits.take(size)]);
        if (two_planes) weight[own] = weights[bits.take(size)];
        const UastcLine& line = lines[pattern.subset[texel]];
        for (std::size_t c = 0; c < kUastcChannels; ++c)
            out[texel * kUastcChannels + c] =
                static_cast<std::uint8_t>((line.start[c] + weight[c] * line.step[c]) >> 14);
    }
    return out;
}

void decodeUastc(std::span<const std::uint8_t> blocks, int width, int height, bool srgb,
                 std::uint8_t* rgba) {
    constexpr std::size_t kSide = 4;
    const auto columns = static_cast<std::size_t>(width), rows = static_cast<std::size_t>(height);
    for (std::size_t y = 0; y < rows; y += kSide)
        for (std::size_t x = 0; x < columns; x += kSide) {
            const auto texels = uastcTexels(blocks.first<kUastcBytes>(), srgb);
            blocks = blocks.subspan(kUastcBytes);
            const std::size_t wide = std::min(kSide, columns - x) * kUastcChannels;
            for (std::size_t row = 0; row < std::min(kSide, rows - y); ++row)
                std::memcpy(rgba + ((y + row) * columns + x) * kUastcChannels,
                            texels.data() + row * kSide * kUastcChannels, wide);
        }
}

}  // namespace peeler
