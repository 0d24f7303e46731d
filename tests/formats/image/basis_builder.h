// SPDX-License-Identifier: Apache-2.0
// A writer of BasisLZ, symbol by symbol: Huffman tables, codebooks and slices (KTX 2.0,
// "BasisLZ/ETC1S Bitstream Specification").
#pragma once

#include <array>
#include <vector>

#include "formats/image/bit_writer.h"
#include "formats/image/ktx2_builder.h"

namespace peeler::test {

/// A canonical Huffman code (RFC 1951, section 3.2.2).
class BasisCode {
  public:
    explicit BasisCode(std::vector<std::uint8_t> lengths)
        : lengths_(std::move(lengths)), codes_(lengths_.size()) {
        unsigned code = 0;
        for (unsigned length = 1; length <= 16; ++length, code <<= 1U)
            for (std::size_t i = 0; i < lengths_.size(); ++i)
                if (lengths_[i] == length) codes_[i] = code++;
    }
    /// Returns a code for `count` symbols. All code lengths differ by at most one bit.
    static BasisCode flat(std::size_t count) {
        std::uint8_t bits = 0;
        while (std::size_t{1} << bits < count)
            ++bits;
        std::vector<std::uint8_t> lengths(count, bits);
        const std::size_t shorter = (std::size_t{1} << bits) - count;
        std::fill_n(lengths.begin(), shorter, static_cast<std::uint8_t>(bits - 1));
        if (count == 1) lengths = {1};
        return BasisCode(lengths);
    }

    /// Writes the code of a symbol, highest bit first.
    void put(BitWriter& bits, std::size_t symbol) const {
        for (unsigned i = lengths_.at(symbol); i-- > 0;)
            bits.put(codes_[symbol] >> i & 1U, 1);
    }

    /// Returns the code for code lengths: lengths 0 to 10 take 4 bits, 11 to 20 take 5.
    static BasisCode ofLengths() {
        std::vector<std::uint8_t> lengths(21, 4);
        std::fill(lengths.begin() + 11, lengths.end(), std::uint8_t{5});
        return BasisCode(lengths);
    }
    static void putHeader(BitWriter& bits, std::size_t symbols) {
        bits.put(symbols, 14);
        bits.put(21, 5);
        for (const unsigned i :
             {17, 18, 19, 20, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15, 16})
            bits.put(i < 11 ? 4 : 5, 3);
    }
    void putTable(BitWriter& bits) const {
        putHeader(bits, lengths_.size());
        const BasisCode code = ofLengths();
        for (const std::uint8_t length : lengths_)
            code.put(bits, length);
    }

  private:
    std::vector<std::uint8_t> lengths_;
    std::vector<unsigned> codes_;
};

/// The codebooks and tables of a picture. The callers write the slices.
struct BasisBooks {
    using Endpoint = std::array<unsigned, 4>;  ///< R, G and B with 5 bits each, and the intensity
    std::vector<Endpoint> endpoints = {{16, 16, 16, 0}};
    std::vector<std::uint32_t> selectors = {0};  ///< two bits per texel
    std::size_t history = 0;
    bool grey = false;   ///< whether endpoints have only one channel
    bool plain = false;  ///< whether selectors are stored without a code
    BasisCode predictions = BasisCode::flat(257);
    BasisCode runs = BasisCode::flat(64);

    BasisCode deltas() const { return BasisCode::flat(endpoints.size()); }
    BasisCode codes() const { return BasisCode::flat(selectors.size() + history + 1); }

    Bytes endpointBytes() const {
        BitWriter bits;
        const BasisCode color = BasisCode::flat(32), intensity = BasisCode::flat(8);
        for (int i = 0; i < 3; ++i)
            color.putTable(bits);
        intensity.putTable(bits);
        bits.put(grey ? 1 : 0, 1);
        Endpoint before = {16, 16, 16, 0};
        for (const Endpoint& endpoint : endpoints) {
            intensity.put(bits, (endpoint[3] - before[3]) & 7U);
            for (std::size_t c = 0; c < (grey ? 1U : 3U); ++c)
                color.put(bits, (endpoint[c] - before[c]) & 31U);
            before = endpoint;
        }
        return bits.bytes();
    }
    Bytes selectorBytes() const {
        BitWriter bits;
        bits.put(0, 2);
        bits.put(plain ? 1 : 0, 1);
        const BasisCode code = BasisCode::flat(256);
        if (!plain) code.putTable(bits);
        for (std::size_t i = 0; i < selectors.size(); ++i)
            for (unsigned row = 0; row < 4; ++row) {
                const unsigned now = selectors[i] >> (8 * row) & 255U;
                if (plain || i == 0)
                    bits.put(now, 8);
                else
                    code.put(bits, now ^ (selectors[i - 1] >> (8 * row) & 255U));
            }
        return bits.bytes();
    }
    Bytes tableBytes() const {
        BitWriter bits;
        predictions.putTable(bits);
        deltas().putTable(bits);
        codes().putTable(bits);
        runs.putTable(bits);
        bits.put(history, 13);
        return bits.bytes();
    }
};

/// Returns a file of one level with these slices: one for colour and, optionally, one for alpha.
inline Ktx2File basisFile(std::uint32_t width, std::uint32_t height, const BasisBooks& books,
                          const std::vector<Bytes>& slices) {
    Ktx2File file;
    file.width = width;
    file.height = height;
    file.scheme = 1;
    file.model = 163;
    file.channels = slices.size() == 1 ? Bytes{0} : Bytes{0, 15};
    const Bytes parts[] = {books.endpointBytes(), books.selectorBytes(), books.tableBytes()};
    appendNumber(file.global, books.endpoints.size(), 2);
    appendNumber(file.global, books.selectors.size(), 2);
    for (const Bytes& part : parts)
        appendNumber(file.global, part.size());
    appendNumber(file.global, 0);
    appendNumber(file.global, 0);  // the flags: none
    Bytes level;
    for (std::size_t i = 0; i < 2; ++i) {
        appendNumber(file.global, i < slices.size() ? level.size() : 0);
        appendNumber(file.global, i < slices.size() ? slices[i].size() : 0);
        if (i < slices.size()) level.insert(level.end(), slices[i].begin(), slices[i].end());
    }
    for (const Bytes& part : parts)
        file.global.insert(file.global.end(), part.begin(), part.end());
    file.levels = {{level, 0}};
    return file;
}

/// Codebook indices of a block.
struct BasisBlock {
    std::size_t endpoint = 0, selector = 0;
};

/// Returns a slice in which every block has explicit indices, without references to other blocks.
inline Bytes plainSlice(const BasisBooks& books, std::size_t columns,
                        const std::vector<BasisBlock>& blocks) {
    BitWriter bits;
    std::size_t before = 0;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
        // Each group of 2 × 2 blocks shares a symbol, which its first block stores.
        const bool first = i % columns % 2 == 0 && i / columns % 2 == 0;
        if (first) books.predictions.put(bits, 0xFF);
        const std::size_t all = books.endpoints.size();
        books.deltas().put(bits, (blocks[i].endpoint + all - before) % all);
        books.codes().put(bits, blocks[i].selector);
        before = blocks[i].endpoint;
    }
    return bits.bytes();
}

}  // namespace peeler::test
