// SPDX-License-Identifier: Apache-2.0
// BMP decoder: 1 to 32 bits per pixel, palettes, run lengths, masks, rows in either order.
#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <stdexcept>

#include "formats/image/image_codecs.h"

namespace peeler {
namespace {

/// The values of biCompression.
enum BmpPacking : std::uint32_t {
    kBmpRgb = 0,
    kBmpRle8 = 1,
    kBmpRle4 = 2,
    kBmpMasks = 3,
    kBmpAlphaMasks = 6
};

using BmpTexel = std::array<std::uint8_t, 4>;

[[noreturn]] void failBmp(const std::string& what) {
    throw std::runtime_error("BMP: " + what);
}

/// The bits of a pixel that hold one component.
struct BmpMask {
    std::uint32_t bits = 0;

    /// Returns the component of a pixel as 8 bits, or 255 if the mask is empty.
    std::uint8_t of(std::uint32_t pixel) const {
        if (bits == 0) return 255;
        const int shift = std::countr_zero(bits);
        const std::uint64_t value = (pixel & bits) >> shift, most = bits >> shift;
        return static_cast<std::uint8_t>((value * 255 + most / 2) / most);
    }
};

class BmpDecoder final : public RgbaDecoder {
  public:
    explicit BmpDecoder(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
        const std::uint32_t header = number(14, 4);
        const bool is_core = header == 12;  // the header of OS/2 1.x (BITMAPCOREHEADER)
        if (!is_core && (header < 40 || header > 124)) failBmp("an unknown header");
        const auto width = static_cast<std::int32_t>(is_core ? number(18, 2) : number(18, 4));
        const auto height = static_cast<std::int32_t>(is_core ? number(20, 2) : number(22, 4));
        if (width < 1 || height == 0 || height == INT32_MIN) failBmp("it has no pixels");
        top_down_ = height < 0;
        setSize(width, std::abs(height));
        bits_ = number(is_core ? 24 : 28, 2);
        packing_ = is_core ? kBmpRgb : number(30, 4);
        constexpr std::uint32_t kDepths[] = {1, 4, 8, 16, 24, 32};
        if (std::ranges::find(kDepths, bits_) == std::end(kDepths)) failBmp("an unknown depth");
        const bool has_masks = packing_ == kBmpMasks || packing_ == kBmpAlphaMasks;
        const bool is_possible = packing_ == kBmpRgb || (packing_ == kBmpRle8 && bits_ == 8) ||
                                 (packing_ == kBmpRle4 && bits_ == 4) ||
                                 (has_masks && (bits_ == 16 || bits_ == 32));
        if (!is_possible) failBmp("an unknown compression");
        readMasks(header, has_masks);
        if (bits_ <= 8) readPalette(is_core ? 26 : 14 + header, is_core ? 3 : 4);
        data_ = number(10, 4);
        stride_ = (static_cast<std::uint64_t>(width) * bits_ + 31) / 32 * 4;
        const std::uint64_t rows = static_cast<std::uint64_t>(image_.height);
        if (data_ > bytes_.size() || (!isPacked() && rows > (bytes_.size() - data_) / stride_))
            failBmp("the file ends before its pixels do");
    }

  private:
    /// Returns a little-endian number of `size` bytes.
    std::uint32_t number(std::size_t at, std::size_t size) const {
        if (at + size > bytes_.size()) failBmp("the file ends in its header");
        std::uint32_t value = 0;
        for (std::size_t i = size; i-- > 0;)
            value = value << 8U | bytes_[at + i];
        return value;
    }

    bool isPacked() const { return packing_ == kBmpRle8 || packing_ == kBmpRle4; }

    void readMasks(std::uint32_t header, bool has_masks) {
        if (bits_ == 16) masks_ = {{{0x7C00}, {0x3E0}, {0x1F}, {0}}};
        if (bits_ == 32) masks_ = {{{0xFF0000}, {0xFF00}, {0xFF}, {0xFF000000}}};
        if (!has_masks) return;
        constexpr std::size_t kMasksAt = 54;
        const std::size_t count = header >= 56 || packing_ == kBmpAlphaMasks ? 4 : 3;
        masks_[3] = {};
        for (std::size_t i = 0; i < count; ++i)
            masks_[i].bits = number(kMasksAt + 4 * i, 4);
    }

    /// Reads the palette. Missing entries are black.
    void readPalette(std::size_t at, std::size_t size) {
        palette_.fill({0, 0, 0, 255});
        const std::uint32_t used = size == 3 ? 0 : number(46, 4);
        const std::uint32_t most = 1U << bits_;
        const std::uint32_t count = used == 0 ? most : std::min(used, most);
        for (std::size_t i = 0; i < count && at + size <= bytes_.size(); ++i, at += size)
            palette_[i] = {bytes_[at + 2], bytes_[at + 1], bytes_[at], 255};
    }

    std::uint8_t* row(std::uint8_t* rgba, std::size_t y) const {
        const auto height = static_cast<std::size_t>(image_.height);
        return rgba + 4 * static_cast<std::size_t>(image_.width) * (top_down_ ? y : height - 1 - y);
    }

    void decode(std::uint8_t* rgba) const override {
        if (isPacked()) return decodeRuns(rgba);
        const auto width = static_cast<std::size_t>(image_.width);
        for (std::size_t y = 0; y < static_cast<std::size_t>(image_.height); ++y) {
            const std::uint8_t* const from = bytes_.data() + data_ + stride_ * y;
            std::uint8_t* to = row(rgba, y);
            for (std::size_t x = 0; x < width; ++x, to += 4)
                std::ranges::copy(texel(from, x), to);
        }
        if (bits_ == 32 && packing_ == kBmpRgb) fillUnusedAlpha(rgba);
    }

    BmpTexel texel(const std::uint8_t* from, std::size_t x) const {
        if (bits_ <= 8) {
            const std::size_t bit = x * bits_;
            const std::uint32_t shift = 8 - bits_ - bit % 8;
            return palette_[from[bit / 8] >> shift & ((1U << bits_) - 1)];
        }
        from += x * (bits_ / 8);
        if (bits_ == 24) return {from[2], from[1], from[0], 255};
        std::uint32_t pixel = from[0] | std::uint32_t{from[1]} << 8U;
        if (bits_ == 32) pixel |= std::uint32_t{from[2]} << 16U | std::uint32_t{from[3]} << 24U;
        return {masks_[0].of(pixel), masks_[1].of(pixel), masks_[2].of(pixel), masks_[3].of(pixel)};
    }

    /// Sets alpha to 255 if alpha is 0 everywhere: without masks, the fourth byte of a pixel is
    /// undefined.
    void fillUnusedAlpha(std::uint8_t* rgba) const {
        for (std::size_t i = 0; i < pixels(); ++i)
            if (rgba[4 * i + 3] != 0) return;
        for (std::size_t i = 0; i < pixels(); ++i)
            rgba[4 * i + 3] = 255;
    }

    /// Decodes runs, literal pixels and jumps. Pixels skipped by jumps get the palette's first
    /// colour.
    void decodeRuns(std::uint8_t* rgba) const {
        for (std::size_t i = 0; i < pixels(); ++i)
            std::ranges::copy(palette_[0], rgba + 4 * i);
        const auto width = static_cast<std::size_t>(image_.width);
        const auto height = static_cast<std::size_t>(image_.height);
        std::size_t at = data_, x = 0, y = 0;
        const auto next = [&]() -> std::uint32_t {
            if (at >= bytes_.size()) failBmp("the file ends before its pixels do");
            return bytes_[at++];
        };
        const auto put = [&](std::uint32_t index) {
            if (x < width && y < height) std::ranges::copy(palette_[index], row(rgba, y) + 4 * x);
            ++x;
        };
        const auto nibble = [](std::uint32_t byte, std::uint32_t i) {
            return i % 2 == 0 ? byte >> 4U : byte & 15U;
        };
        while (y < height) {
            const std::uint32_t count = next(), value = next();
            if (count > 0) {
                for (std::uint32_t i = 0; i < count; ++i)
                    put(packing_ == kBmpRle8 ? value : nibble(value, i));
            } else if (value == 0) {
                x = 0;
                ++y;
            } else if (value == 1) {
                return;
            } else if (value == 2) {
                x += next();
                y += next();
            } else {
                const std::size_t begin = at;
                for (std::uint32_t i = 0, byte = 0; i < value; ++i) {
                    if (packing_ == kBmpRle8 || i % 2 == 0) byte = next();
                    put(packing_ == kBmpRle8 ? byte : nibble(byte, i));
                }
                at += (at - begin) % 2;
            }
        }
    }

    std::span<const std::uint8_t> bytes_;
    std::uint32_t bits_ = 0, packing_ = kBmpRgb;
    bool top_down_ = false;
    std::array<BmpMask, 4> masks_{};
    std::array<BmpTexel, 256> palette_{};
    std::uint64_t data_ = 0, stride_ = 0;
};

}  // namespace

std::unique_ptr<ImageDecoder> bmpDecoder(const std::string&, std::span<const std::uint8_t> bytes) {
    return std::make_unique<BmpDecoder>(bytes);
}

}  // namespace peeler
