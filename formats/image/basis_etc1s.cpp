// SPDX-License-Identifier: Apache-2.0
// Decoder of ETC1S slices (KTX 2.0, "ETC1S Slice Decoding").
#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

#include "formats/image/basis_lz.h"

namespace peeler {
namespace {

/// For each intensity, the offsets of the four selectors from the base colour (Khronos Data Format
/// Specification 1.3, "Intensity modifier sets for ETC1 compressed textures").
constexpr int kModifiers[8][4] = {{-8, -2, 2, 8},       {-17, -5, 5, 17},    {-29, -9, 9, 29},
                                  {-42, -13, 13, 42},   {-60, -18, 18, 60},  {-80, -24, 24, 80},
                                  {-106, -33, 33, 106}, {-183, -47, 47, 183}};

std::uint8_t modified(std::uint8_t base, int modifier) {
    return static_cast<std::uint8_t>(std::clamp(base + modifier, 0, 255));
}

/// Reads a number of variable length, stored in pieces of `piece` bits, lowest piece first. The bit
/// after a piece is set if another piece follows.
std::uint32_t takeLength(BitReader& bits, unsigned piece) {
    std::uint64_t value = 0;
    for (unsigned shift = 0;; shift += piece) {
        const std::uint32_t next = bits.take(piece + 1);
        value |= std::uint64_t{next & ((1U << piece) - 1)} << shift;
        if (!(next >> piece)) break;
        if (shift + piece >= 32) failKtx2("the length of a run does not end", bits.position());
    }
    return static_cast<std::uint32_t>(value);
}

/// The recently used selectors. A selector that is used again moves toward the front ("ETC1S
/// Approximate Move to Front Routines").
class SelectorHistory {
  public:
    explicit SelectorHistory(std::size_t size) : values_(size), next_(size / 2) {}

    void add(std::uint32_t selector) {
        if (values_.empty()) return;
        values_[next_++] = selector;
        if (next_ == values_.size()) next_ = values_.size() / 2;
    }
    std::uint32_t use(std::size_t index) {
        const std::uint32_t selector = values_[index];
        std::swap(values_[index / 2], values_[index]);
        return selector;
    }

  private:
    std::vector<std::uint32_t> values_;  // indices of selectors
    std::size_t next_;
};

/// A decoder of a slice's endpoint and selector indices, block by block.
class SliceReader {
  public:
    SliceReader(const BasisCodebooks& books, const BasisSlice& slice, std::size_t columns)
        : books_(books),
          bits_(slice.bytes, slice.offset),
          above_(columns),
          pairs_((columns + 1) / 2),
          history_(books.history) {}

    /// Returns the endpoint index of the next block. Blocks come row by row.
    std::uint32_t nextEndpoint(std::size_t x, std::size_t y) {
        if (x % 2 == 0) predictions_ = y % 2 == 0 ? nextPredictions(x / 2) : pairs_[x / 2];
        const std::uint32_t prediction = predictions_ & 3U;
        predictions_ >>= 2U;
        const std::uint32_t above = above_[x];
        std::uint32_t endpoint = left_;
        if (prediction == kAbove) endpoint = above;
        if (prediction == kAboveLeft) endpoint = above_left_;
        if (prediction == kDifference) {
            endpoint += books_.endpoint_deltas.decode(bits_);
            if (endpoint >= books_.endpoints.size())
                endpoint -= static_cast<std::uint32_t>(books_.endpoints.size());
        } else if ((x == 0 && prediction != kAbove) || (y == 0 && prediction != kLeft)) {
            failKtx2("a block refers to a block outside the picture", bits_.position());
        }
        above_left_ = above;
        above_[x] = left_ = endpoint;
        return endpoint;
    }

    std::uint32_t nextSelector() {
        const auto selectors = static_cast<std::uint32_t>(books_.selectors.size());
        std::uint32_t symbol = selectors;
        if (selector_run_ > 0) {
            --selector_run_;
        } else {
            symbol = books_.selector_codes.decode(bits_);
            if (symbol == selectors + books_.history) {
                constexpr std::uint32_t kLeast = 3;
                const std::uint32_t run = books_.selector_runs.decode(bits_);
                selector_run_ = kLeast - 1 + (run == kBasisRuns - 1 ? takeLength(bits_, 7) : run);
                symbol = selectors;
            }
        }
        if (symbol >= selectors) {
            if (books_.history == 0)
                failKtx2("a block repeats a selector, but there is no history", bits_.position());
            return history_.use(symbol - selectors);
        }
        history_.add(symbol);
        return symbol;
    }

    void checkEnd() const {
        if (bits_.overrun()) failKtx2("a slice of BasisLZ is cut short", bits_.position());
    }

  private:
    enum : std::uint32_t { kLeft, kAbove, kAboveLeft, kDifference };

    /// Returns the endpoint predictions for 2 × 2 blocks, two bits each. The lowest four bits are
    /// for the two upper blocks.
    std::uint32_t nextPredictions(std::size_t pair) {
        if (prediction_run_ > 0) {
            --prediction_run_;
        } else {
            const std::uint32_t symbol = books_.predictions.decode(bits_);
            constexpr std::uint32_t kLeast = 3;
            if (symbol == kBasisPredictions)
                prediction_run_ = takeLength(bits_, 4) + std::uint64_t{kLeast - 1};
            else
                repeated_ = symbol;
        }
        pairs_[pair] = static_cast<std::uint8_t>(repeated_ >> 4U);
        return repeated_;
    }

    const BasisCodebooks& books_;
    BitReader bits_;
    std::vector<std::uint32_t> above_;  // last endpoint in each column
    std::vector<std::uint8_t> pairs_;   // predictions for the blocks in odd rows
    SelectorHistory history_;
    std::uint32_t left_ = 0, above_left_ = 0;
    std::uint32_t predictions_ = 0, repeated_ = 0;
    std::uint64_t prediction_run_ = 0, selector_run_ = 0;
};

using EtcTexel = std::array<std::uint8_t, 4>;
using EtcPalette = std::array<EtcTexel, 4>;

std::vector<EtcPalette> palettesOf(const std::vector<Etc1sEndpoint>& endpoints) {
    std::vector<EtcPalette> palettes(endpoints.size());
    for (std::size_t i = 0; i < endpoints.size(); ++i)
        for (std::size_t s = 0; s < 4; ++s) {
            for (std::size_t c = 0; c < 3; ++c)
                palettes[i][s][c] =
                    modified(endpoints[i].color[c], kModifiers[endpoints[i].intensity][s]);
            palettes[i][s][3] = 255;
        }
    return palettes;
}

/// Decodes a slice: plane 0 into all four channels, plane 1 into A.
void decodeSlice(const BasisCodebooks& books, const std::vector<EtcPalette>& palettes,
                 std::size_t plane, std::size_t width, std::size_t height, std::uint8_t* rgba) {
    constexpr std::size_t kSide = 4;
    const std::size_t columns = (width + kSide - 1) / kSide, rows = (height + kSide - 1) / kSide;
    SliceReader blocks(books, books.planes[plane], columns);
    for (std::size_t y = 0; y < rows; ++y) {
        const std::size_t high = std::min(kSide, height - kSide * y);
        for (std::size_t x = 0; x < columns; ++x) {
            const EtcPalette& palette = palettes[blocks.nextEndpoint(x, y)];
            std::uint32_t selectors = books.selectors[blocks.nextSelector()];
            std::uint8_t* to = rgba + 4 * (kSide * y * width + kSide * x);
            const std::size_t wide = std::min(kSide, width - kSide * x);
            for (std::size_t row = 0; row < high; ++row, selectors >>= 8U, to += 4 * width)
                for (std::size_t i = 0; i < wide; ++i) {
                    const EtcTexel& texel = palette[selectors >> (2 * i) & 3U];
                    if (plane == 0)
                        std::memcpy(to + 4 * i, texel.data(), texel.size());
                    else
                        to[4 * i + 3] = texel[1];
                }
        }
        blocks.checkEnd();
    }
}

}  // namespace

void decodeEtc1s(const Ktx2Container& file, std::uint8_t* rgba) {
    const BasisCodebooks books = readBasisCodebooks(file);
    const std::vector<EtcPalette> palettes = palettesOf(books.endpoints);
    for (std::size_t plane = 0; plane < books.planes.size(); ++plane)
        decodeSlice(books, palettes, plane, static_cast<std::size_t>(file.levels[0].width),
                    static_cast<std::size_t>(file.levels[0].height), rgba);
}

}  // namespace peeler
