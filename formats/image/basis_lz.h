// SPDX-License-Identifier: Apache-2.0
// BasisLZ, which packs ETC1S in KTX 2.0 files ("BasisLZ Global Data" and "BasisLZ/ETC1S Bitstream
// Specification"): bits, Huffman codes, and the codebooks that the levels of a file share.
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

/// A reader of a stream of bits, least significant bit first. Beyond the end of the stream, the
/// reader returns zeros, so that not every bit needs a check. Callers check overrun() from time to
/// time, and at the end.
class BitReader {
  public:
    /// `offset` is the position of `bytes` in the file.
    BitReader(std::span<const std::uint8_t> bytes, std::uint64_t offset)
        : bytes_(bytes), offset_(offset) {}

    /// Returns the next bits without consuming them. At least the lowest 32 bits are valid. The
    /// caller masks off the other bits.
    std::uint64_t peek() {
        if (count_ < kAtOnce) refill();
        return bits_;
    }
    void skip(unsigned count) {
        bits_ >>= count;
        count_ -= count;
    }
    /// Returns and consumes up to 32 bits.
    std::uint32_t take(unsigned count) {
        const std::uint64_t bits = peek() & ((std::uint64_t{1} << count) - 1);
        skip(count);
        return static_cast<std::uint32_t>(bits);
    }

    /// Whether more bits have been consumed than the stream holds.
    bool overrun() const { return at_ - count_ / 8 > bytes_.size(); }
    /// Returns the position in the file of the byte that holds the next bit.
    std::uint64_t position() const { return offset_ + at_ - (count_ + 7) / 8; }

  private:
    static constexpr unsigned kAtOnce = 32;

    void refill() {
        if constexpr (std::endian::native == std::endian::little) {
            if (bytes_.size() >= sizeof(std::uint64_t) &&
                at_ <= bytes_.size() - sizeof(std::uint64_t)) {
                std::uint64_t next = 0;
                std::memcpy(&next, bytes_.data() + at_, sizeof next);
                // Later refills read the bits above count_ again. ORing the same values twice is
                // harmless.
                bits_ |= next << count_;
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
    unsigned count_ = 0;  ///< number of valid bits in bits_
    std::size_t at_ = 0;  ///< index of the next byte; may be beyond the end
};

// Defined in huffman_table.cpp.

/// A canonical Huffman code ("Compressed Huffman Tables"), as in DEFLATE (RFC 1951, section 3.2.2),
/// with codes of up to 16 bits for up to 16,383 symbols.
class HuffmanTable {
  public:
    /// Makes an empty code, which decodes nothing.
    HuffmanTable() : HuffmanTable({}, 0) {}

    /// Builds the code in which symbol i has lengths[i] bits, up to 16; 0 means that the symbol
    /// does not occur. Throws std::runtime_error (failKtx2(), with `at`) unless the code is
    /// complete and prefix-free. If only one symbol occurs, its code may have any length.
    HuffmanTable(std::span<const std::uint8_t> lengths, std::uint64_t at);

    /// Reads the packed lengths from a stream and builds the code. Throws the errors of the
    /// constructor.
    static HuffmanTable read(BitReader& bits);

    /// Returns the next symbol. Throws std::runtime_error for an invalid code.
    std::uint32_t decode(BitReader& bits) const {
        const Entry entry = entries_[bits.peek() & mask_];
        if (entry.length == 0) fail(bits);
        bits.skip(entry.length);
        return entry.symbol;
    }

    /// Returns one more than the largest symbol that occurs, or 0 if no symbol occurs.
    std::uint32_t symbols() const { return symbols_; }

  private:
    struct Entry {
        std::uint16_t symbol = 0;
        std::uint16_t length = 0;  ///< length of the code; 0 if no code has this prefix
    };
    [[noreturn]] static void fail(const BitReader& bits);

    /// Indexed by as many of the next bits as the longest code has.
    std::vector<Entry> entries_;
    std::uint64_t mask_ = 0;
    std::uint32_t symbols_ = 0;
};

// Defined in basis_codebooks.cpp.

/// A block's base colour, 5 bits per channel widened to 8, and the index of its modifier table.
struct Etc1sEndpoint {
    std::array<std::uint8_t, 3> color{};
    std::uint8_t intensity = 0;  ///< index of the modifier table, 0 to 7
};

/// The packed blocks of one plane of a mipmap level.
struct BasisSlice {
    std::span<const std::uint8_t> bytes;
    std::uint64_t offset = 0;  ///< position of `bytes` in the file
};

struct BasisCodebooks {
    std::vector<Etc1sEndpoint> endpoints;
    /// For each selector, the modifier indices of the 16 texels, row-major, two bits each, first
    /// texel in the lowest bits.
    std::vector<std::uint32_t> selectors;
    /// The Huffman codes of the bitstream. All their symbols are valid indices.
    HuffmanTable predictions, endpoint_deltas, selector_codes, selector_runs;
    std::uint32_t history = 0;  ///< number of selectors in the history
    /// The slices of the largest level: colour, and optionally a second plane.
    std::vector<BasisSlice> planes;
};

/// The number of endpoint predictions. Their Huffman code has one more symbol, for repetition.
inline constexpr std::uint32_t kBasisPredictions = 256;
/// The number of symbols in the Huffman code for run lengths. The last symbol means that an
/// explicit length follows.
inline constexpr std::uint32_t kBasisRuns = 64;

/// Reads the codebooks. Throws std::runtime_error (failKtx2()) if data is missing, or if a slice of
/// any level exceeds the level's data.
BasisCodebooks readBasisCodebooks(const Ktx2Container& file);

}  // namespace peeler
