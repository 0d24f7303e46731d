// SPDX-License-Identifier: Apache-2.0
// BasisLZ, by which ETC1S is packed in KTX 2.0 files ("BasisLZ Global Data" and "BasisLZ/ETC1S
// Bitstream Specification"): bits, Huffman codes, and what the levels of a file share.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "formats/image/ktx2.h"

namespace peeler {

/// Bits of a stream in which each byte begins with its lowest. Beyond the end are zeros, so that
/// nobody has to ask before each bit; who reads asks overrun() now and then, and at the end.
class BitReader {
  public:
    /// `offset` is where the bytes lie in their file.
    BitReader(std::span<const std::uint8_t> bytes, std::uint64_t offset)
        : bytes_(bytes), offset_(offset) {}

    /// The next bits, as many as the caller masks, 32 at most. They are left where they are.
    std::uint64_t peek() {
        if (count_ < kAtOnce) refill();
        return bits_;
    }
    /// Takes bits that were peeked at.
    void skip(unsigned count) {
        bits_ >>= count;
        count_ -= count;
    }
    /// Up to 32 bits.
    std::uint32_t take(unsigned count) {
        const std::uint64_t bits = peek() & ((std::uint64_t{1} << count) - 1);
        skip(count);
        return static_cast<std::uint32_t>(bits);
    }

    /// Whether bits were taken that are not there.
    bool overrun() const { return at_ - count_ / 8 > bytes_.size(); }
    /// The place in the file of the byte that the next bit is in.
    std::uint64_t position() const { return offset_ + at_ - (count_ + 7) / 8; }

  private:
    static constexpr unsigned kAtOnce = 32;

    void refill() {
        if constexpr (std::endian::native == std::endian::little) {
            if (bytes_.size() >= sizeof(std::uint64_t) &&
                at_ <= bytes_.size() - sizeof(std::uint64_t)) {
                std::uint64_t next = 0;
                std::memcpy(&next, bytes_.data() + at_, sizeof next);
                bits_ |= next << count_;  // those above count_ are the same when they come again
                const unsigned whole = (63 - count_) / 8;
                at_ += whole;
                count_ += 8 * whole;
                return;
            }
        }
        for (; count_ <= 56; count_ += 8, ++at_)
            if (at_ < bytes_.size()) bits_ |= std::uint64_t{bytes_[at_]} << count_;
    }

    std::span<const std::uint8_t> bytes_;
    std::uint64_t offset_;
    std::uint64_t bits_ = 0;
    unsigned count_ = 0;  ///< valid bits
    std::size_t at_ = 0;  ///< the next byte, maybe beyond the end
};

// huffman_table.cpp.

/// A canonical Huffman code ("Compressed Huffman Tables"): one of DEFLATE (RFC 1951, section
/// 3.2.2), with up to 16 bits and 16,383 symbols.
class HuffmanTable {
  public:
    /// A code without symbols, which none can be read by.
    HuffmanTable() : HuffmanTable({}, 0) {}

    /// The code in which symbol i has lengths[i] bits, up to 16, or does not occur (0). Throws
    /// std::runtime_error (failKtx2(), with `at`) unless every sequence of bits begins with
    /// exactly one code; a symbol that is the only one may have a code of any length.
    HuffmanTable(std::span<const std::uint8_t> lengths, std::uint64_t at);

    /// Reads the lengths, which are packed. Throws likewise.
    static HuffmanTable read(BitReader& bits);

    /// The next symbol. Throws where the bits are no code.
    std::uint32_t decode(BitReader& bits) const {
        const Entry entry = entries_[bits.peek() & mask_];
        if (entry.length == 0) fail(bits);
        bits.skip(entry.length);
        return entry.symbol;
    }

    /// One more than the largest symbol that occurs, 0 if none does.
    std::uint32_t symbols() const { return symbols_; }

  private:
    struct Entry {
        std::uint16_t symbol = 0;
        std::uint16_t length = 0;  ///< 0: no code begins so
    };
    [[noreturn]] static void fail(const BitReader& bits);

    std::vector<Entry> entries_;  ///< by the next bits, as many as the longest code has
    std::uint64_t mask_ = 0;
    std::uint32_t symbols_ = 0;
};

// basis_codebooks.cpp.

/// The base colour of a block, 5 bits a channel widened to 8, and which modifiers it has.
struct Etc1sEndpoint {
    std::array<std::uint8_t, 3> color{};
    std::uint8_t intensity = 0;  ///< 0 to 7
};

/// The packed blocks of one plane of a level.
struct BasisSlice {
    std::span<const std::uint8_t> bytes;
    std::uint64_t offset = 0;  ///< of those in the file
};

struct BasisCodebooks {
    std::vector<Etc1sEndpoint> endpoints;
    /// Of each of the 16 texels, row by row from the lowest bits on, which modifier it has.
    std::vector<std::uint32_t> selectors;
    /// Whose symbols are all below what they count.
    HuffmanTable predictions, endpoint_deltas, selector_codes, selector_runs;
    std::uint32_t history = 0;       ///< so many selectors are remembered
    std::vector<BasisSlice> planes;  ///< of the largest level: colours, then the second, if any
};

/// In a code of kPredictions + 1 symbols the last one repeats.
inline constexpr std::uint32_t kBasisPredictions = 256;
/// In the code of runs the last one says that the length follows.
inline constexpr std::uint32_t kBasisRuns = 64;

/// Throws (failKtx2()) unless all of it is there and every slice of every level within its level.
BasisCodebooks readBasisCodebooks(const Ktx2Container& file);

}  // namespace peeler
