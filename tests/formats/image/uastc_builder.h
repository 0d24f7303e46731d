// SPDX-License-Identifier: Apache-2.0
// A writer of UASTC blocks of every mode, field by field (Khronos Data Format Specification 1.3,
// "Universal ASTC Compressed Texture Images").
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "formats/image/bit_writer.h"

namespace peeler::test {

struct UastcLayout {
    unsigned code, code_bits;
    /// Number of the first bit after the transcoding hints ("mode encoding summary").
    unsigned first;
    unsigned pattern_bits, patterns;  ///< number of bits of the field PAT, and number of patterns
    bool selects;                     ///< whether the mode has the field CSEL
    unsigned subsets, channels, planes;
    unsigned digits;  ///< values of a digit: 3 = trits, 5 = quints, 1 = no digits
    unsigned endpoint_bits, weight_bits;

    std::size_t endpoints() const { return std::size_t{2} * subsets * channels; }
};

/// The layouts by mode index. For the single-colour mode, only the code is set.
inline constexpr UastcLayout kUastcLayouts[] = {
    {0x01, 4, 19, 0, 1, false, 1, 3, 1, 3, 6, 4},  {0x35, 6, 21, 0, 1, false, 1, 3, 1, 1, 8, 2},
    {0x1D, 5, 20, 5, 30, false, 2, 3, 1, 1, 4, 3}, {0x03, 5, 20, 4, 11, false, 3, 3, 1, 3, 2, 2},
    {0x13, 5, 20, 5, 30, false, 2, 3, 1, 5, 3, 2}, {0x0B, 5, 20, 0, 1, false, 1, 3, 1, 1, 8, 3},
    {0x1B, 5, 20, 0, 1, true, 1, 3, 2, 5, 5, 2},   {0x07, 5, 20, 5, 19, false, 2, 3, 1, 5, 3, 2},
    {0x17, 5, 5, 0, 1, false, 0, 0, 0, 1, 0, 0},   {0x0F, 5, 28, 5, 30, false, 2, 4, 1, 1, 4, 2},
    {0x02, 3, 20, 0, 1, false, 1, 4, 1, 3, 4, 4},  {0x00, 2, 19, 0, 1, true, 1, 4, 2, 3, 4, 2},
    {0x06, 3, 20, 0, 1, false, 1, 4, 1, 3, 6, 3},  {0x1F, 5, 28, 0, 1, true, 1, 4, 2, 1, 8, 1},
    {0x0D, 5, 28, 0, 1, false, 1, 4, 1, 1, 8, 2},  {0x05, 7, 30, 0, 1, false, 1, 2, 1, 1, 8, 4},
    {0x15, 6, 29, 5, 30, false, 2, 2, 1, 1, 8, 2}, {0x25, 6, 29, 0, 1, false, 1, 2, 2, 1, 8, 2},
    {0x09, 4, 19, 0, 1, false, 1, 3, 1, 1, 5, 5},
};

struct UastcFields {
    std::size_t mode = 0;
    unsigned pattern = 0, selector = 0;
    /// Low and high value for each subset and channel. The digit (trit or quint) is above the
    /// endpoint_bits.
    std::vector<unsigned> endpoints{};
    /// One weight per texel, or two in modes with two planes. Anchors are stored without their
    /// highest bit.
    std::vector<unsigned> weights{};
    std::vector<std::size_t> anchors = {0};  ///< texels whose weights lack the highest bit
};

inline Bytes uastcBlock(const UastcFields& fields) {
    const UastcLayout& mode = kUastcLayouts[fields.mode];
    BitWriter bits;
    bits.put(mode.code, mode.code_bits);
    bits.put(0, mode.first - mode.code_bits);
    bits.put(fields.pattern, mode.pattern_bits);
    if (mode.selects) bits.put(fields.selector, 2);
    const std::size_t together = mode.digits == 3 ? 5 : 3;
    for (std::size_t i = 0; mode.digits > 1 && i < fields.endpoints.size(); i += together) {
        const std::size_t count = std::min(together, fields.endpoints.size() - i);
        unsigned packed = 0, states = 1;
        for (std::size_t k = count; k-- > 0; states *= mode.digits)
            packed = packed * mode.digits + (fields.endpoints[i + k] >> mode.endpoint_bits);
        bits.put(packed, static_cast<std::size_t>(std::ceil(std::log2(states))));
    }
    for (const unsigned endpoint : fields.endpoints)
        bits.put(endpoint, mode.endpoint_bits);
    for (std::size_t i = 0; i < fields.weights.size(); ++i) {
        const bool anchor = std::find(fields.anchors.begin(), fields.anchors.end(),
                                      i / mode.planes) != fields.anchors.end();
        bits.put(fields.weights[i], mode.weight_bits - (anchor ? 1 : 0));
    }
    Bytes block = bits.bytes();
    block.resize(16);
    return block;
}

inline Bytes solidUastcBlock(std::uint8_t r, std::uint8_t g, std::uint8_t b, std::uint8_t a) {
    BitWriter bits;
    bits.put(0x17, 5);
    for (const std::uint8_t channel : {r, g, b, a})
        bits.put(channel, 8);
    Bytes block = bits.bytes();
    block.resize(16);
    return block;
}

}  // namespace peeler::test
