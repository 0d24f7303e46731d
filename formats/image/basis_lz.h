// SPDX-License-Identifier: Apache-2.0
// BasisLZ, the packing of ETC1S in KTX 2.0 files ("BasisLZ Global Data" and "BasisLZ/ETC1S
// Bitstream Specification"): bits, Huffman codes, and the codebooks shared by a file's levels.
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

/// Bit stream reader, least significant bit first. Reads zeros beyond the end, so no check per bit
/// is needed; callers check overrun() now and then, and at the end.
class BitReader {
  public:
    /// `offset` is the position of the bytes in their file.
    BitReader(std::span<const std::uint8_t> bytes, std::uint64_t offset)
        : bytes_(bytes), offset_(offset) {}

    /// Returns the next bits without consuming them; at least 32 are valid, and the caller masks.
    std::uint64_t peek() {
        if (count_ < kAtOnce) refill();
        return bits_;
    }
    /// Consumes peeked bits.
    void skip(unsigned count) {
        bits_ >>= count;
        count_ -= count;
    }
    /// Consumes up to 32 bits.
    std::uint32_t take(unsigned count) {
        const std::uint64_t bits = peek() & ((std::uint64_t{1} << count) - 1);
        skip(count);
        return static_cast<std::uint32_t>(bits);
    }

    /// Whether bits beyond the end were consumed.
    bool overrun() const { return at_ - count_ / 8 > bytes_.size(); }
    /// Returns the file position of the byte with the next bit.
    std::uint64_t position() const { return offset_ + at_ - (count_ + 7) / 8; }

  private:
    static constexpr unsigned kAtOnce = 32;

    void refill() {
        if constexpr (std::endian::native == std::endian::little) {
            if (bytes_.size() >= sizeof(std::uint64_t) &&
                at_ <= bytes_.size() - sizeof(std::uint64_t)) {
                std::uint64_t next = 0;
                std::memcpy(&next, bytes_.data() + at_, sizeof next);
                bits_ |= next << count_;  // bits above count_ are the same when they are read again
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
    std::size_t at_ = 0;  ///< next byte, possibly beyond the end
};

// huffman_table.cpp.

/// A canonical Huffman code ("Compressed Huffman Tables"), as in DEFLATE (RFC 1951, section 3.2.2),
/// with up to 16 bits and 16,383 symbols.
class HuffmanTable {
  public:
    /// Makes an empty code, which decodes nothing.
    HuffmanTable() : HuffmanTable({}, 0) {}

    /// Builds the code in which symbol i has lengths[i] bits, up to 16, or does not occur (0).
    /// Throws std::runtime_error (failKtx2(), with `at`) unless the code is complete and
    /// prefix-free; a single symbol may have a code of any length.
    HuffmanTable(std::span<const std::uint8_t> lengths, std::uint64_t at);

    /// Reads the packed lengths and builds the code. Throws like the constructor.
    static HuffmanTable read(BitReader& bits);

    /// Returns the next symbol. Throws std::runtime_error for an invalid code.
    std::uint32_t decode(BitReader& bits) const {
        const Entry entry = entries_[bits.peek() & mask_];
        if (entry.length == 0) fail(bits);
        bits.skip(entry.length);
        return entry.symbol;
    }

    /// Returns one more than the largest symbol that occurs, 0 if there is no symbol.
    std::uint32_t symbols() const { return symbols_; }

  private:
    struct Entry {
        std::uint16_t symbol = 0;
        std::uint16_t length = 0;  ///< 0: no code has this prefix
    };
    [[noreturn]] static void fail(const BitReader& bits);

    std::vector<Entry> entries_;  ///< indexed by the next bits, as many as in the longest code
    std::uint64_t mask_ = 0;
    std::uint32_t symbols_ = 0;
};

// basis_codebooks.cpp.

/// A block's base colour, 5 bits per channel widened to 8, and its modifier table.
struct Etc1sEndpoint {
    std::array<std::uint8_t, 3> color{};
    std::uint8_t intensity = 0;  ///< 0 to 7
};

/// The packed blocks of one plane of a level.
struct BasisSlice {
    std::span<const std::uint8_t> bytes;
    std::uint64_t offset = 0;  ///< in the file
};

struct BasisCodebooks {
    std::vector<Etc1sEndpoint> endpoints;
    /// Modifier index of each of the 16 texels, row-major, lowest bits first.
    std::vector<std::uint32_t> selectors;
    /// Symbols are below the count that each one indexes.
    HuffmanTable predictions, endpoint_deltas, selector_codes, selector_runs;
    std::uint32_t history = 0;       ///< number of selectors in the history
    std::vector<BasisSlice> planes;  ///< of the largest level: colour, then an optional second
};

/// Code of kBasisPredictions + 1 symbols; the last one means repetition.
inline constexpr std::uint32_t kBasisPredictions = 256;
/// In the run-length code the last symbol means that the length follows.
inline constexpr std::uint32_t kBasisRuns = 64;

/// Reads the codebooks. Throws std::runtime_error (failKtx2()) if data is missing or a slice of any
/// level lies outside its level.
BasisCodebooks readBasisCodebooks(const Ktx2Container& file);

}  // namespace peeler
