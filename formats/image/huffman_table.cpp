// SPDX-License-Identifier: Apache-2.0
// Reader of the Huffman codes of BasisLZ.
#include <algorithm>
#include <array>

#include "formats/image/basis_lz.h"

namespace peeler {
namespace {

constexpr unsigned kMostCodeBits = 16;

/// Reverses the bits of a code. Codes are stored highest bit first, unlike all other data.
std::uint32_t reversedCode(std::uint32_t code, unsigned length) {
    std::uint32_t out = 0;
    for (unsigned i = 0; i < length; ++i)
        out |= (code >> i & 1U) << (length - 1 - i);
    return out;
}

/// A symbol for a run in the list of code lengths: a run of zeros or of the previous length.
struct LengthRun {
    std::uint32_t symbol;
    bool zeros;
    unsigned extra_bits;
    std::uint32_t least;
};
constexpr LengthRun kLengthRuns[] = {
    {17, true, 3, 3}, {18, true, 7, 11}, {19, false, 2, 3}, {20, false, 7, 7}};

/// The order in which the code lengths of the code for code lengths are stored.
constexpr std::uint8_t kLengthOrder[] = {17, 18, 19, 20, 0,  8, 7,  9, 6,  10, 5,
                                         11, 4,  12, 3,  13, 2, 14, 1, 15, 16};

}  // namespace

HuffmanTable::HuffmanTable(std::span<const std::uint8_t> lengths, std::uint64_t at) {
    std::array<std::uint32_t, kMostCodeBits + 1> count{};
    std::uint32_t used = 0, room = 0, longest = 0;
    for (std::size_t i = 0; i < lengths.size(); ++i) {
        if (lengths[i] == 0) continue;
        ++used;
        ++count[lengths[i]];
        room += 1U << (kMostCodeBits - lengths[i]);
        longest = std::max<std::uint32_t>(longest, lengths[i]);
        symbols_ = static_cast<std::uint32_t>(i + 1);
    }
    if (used > 1 && room != 1U << kMostCodeBits)
        failKtx2("a Huffman code has too " +
                     std::string(room > 1U << kMostCodeBits ? "many" : "few") +
                     " codes for its lengths",
                 at);
    std::array<std::uint32_t, kMostCodeBits + 2> next{};
    for (unsigned length = 1; length <= kMostCodeBits; ++length)
        next[length + 1] = (next[length] + count[length]) << 1U;
    entries_.resize(std::size_t{1} << longest);
    mask_ = entries_.size() - 1;
    for (std::size_t i = 0; i < lengths.size(); ++i) {
        const unsigned length = lengths[i];
        if (length == 0) continue;
        const std::uint32_t code = reversedCode(next[length]++, length);
        for (std::size_t bits = code; bits < entries_.size(); bits += std::size_t{1} << length)
            entries_[bits] = {static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(length)};
    }
}

HuffmanTable HuffmanTable::read(BitReader& bits) {
    const std::uint64_t at = bits.position();
    const std::size_t count = bits.take(14);
    if (count == 0) return {};
    const std::size_t stored = bits.take(5);
    if (stored < 1 || stored > std::size(kLengthOrder))
        failKtx2("a Huffman table has " + std::to_string(stored) + " code length codes", at);
    std::array<std::uint8_t, std::size(kLengthOrder)> of_lengths{};
    for (std::size_t i = 0; i < stored; ++i)
        of_lengths[kLengthOrder[i]] = static_cast<std::uint8_t>(bits.take(3));
    const HuffmanTable length_code(of_lengths, at);
    std::vector<std::uint8_t> lengths;
    lengths.reserve(count);
    while (lengths.size() < count) {
        const std::uint32_t symbol = length_code.decode(bits);
        const auto* const run =
            std::ranges::find(kLengthRuns, symbol, [](const LengthRun& row) { return row.symbol; });
        if (run == std::end(kLengthRuns)) {
            lengths.push_back(static_cast<std::uint8_t>(symbol));
            continue;
        }
        const std::size_t length = bits.take(run->extra_bits) + run->least;
        if (!run->zeros && (lengths.empty() || lengths.back() == 0))
            failKtx2("a Huffman table repeats a missing length", bits.position());
        if (length > count - lengths.size())
            failKtx2("a Huffman table has more lengths than symbols", bits.position());
        lengths.insert(lengths.end(), length, run->zeros ? std::uint8_t{0} : lengths.back());
    }
    if (bits.overrun()) failKtx2("a Huffman table is cut short", at);
    return {lengths, at};
}

void HuffmanTable::fail(const BitReader& bits) {
    failKtx2("these bits are not a Huffman code", bits.position());
}

}  // namespace peeler
