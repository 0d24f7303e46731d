// SPDX-License-Identifier: Apache-2.0
// TGA decoder: palettes, grey and colour of 15 to 32 bits, run lengths, rows and columns in either
// order.
#include <algorithm>
#include <array>
#include <stdexcept>

#include "formats/image/image_codecs.h"

namespace peeler {
namespace {

constexpr std::size_t kTgaHeader = 18;

/// The image types in the header. kTgaRuns is added if the pixels are run-length encoded.
enum TgaType : std::uint8_t { kTgaPalette = 1, kTgaColor = 2, kTgaGrey = 3, kTgaRuns = 8 };

struct TgaHeader {
    std::uint8_t type = 0;  ///< value of TgaType, without kTgaRuns
    bool has_runs = false, has_palette = false;
    std::uint32_t palette_first = 0, palette_count = 0, palette_bits = 0;
    std::uint32_t width = 0, height = 0, bits = 0;
    bool from_right = false, from_top = false;
    std::size_t palette_at = 0, data_at = 0;
};

constexpr bool isColorDepth(std::uint32_t bits) {
    return bits == 15 || bits == 16 || bits == 24 || bits == 32;
}

/// Reads the header. Returns false if any field has an illegal value.
bool readTgaHeader(std::span<const std::uint8_t> bytes, TgaHeader& header) {
    if (bytes.size() < kTgaHeader) return false;
    const auto number = [&](std::size_t at) -> std::uint32_t {
        return bytes[at] | std::uint32_t{bytes[at + 1]} << 8U;
    };
    header.has_palette = bytes[1] == 1;
    header.has_runs = (bytes[2] & kTgaRuns) != 0;
    header.type = bytes[2] & static_cast<std::uint8_t>(~kTgaRuns);
    header.palette_first = number(3);
    header.palette_count = number(5);
    header.palette_bits = bytes[7];
    header.width = number(12);
    header.height = number(14);
    header.bits = bytes[16];
    header.from_right = (bytes[17] & 0x10U) != 0;
    header.from_top = (bytes[17] & 0x20U) != 0;
    header.palette_at = kTgaHeader + bytes[0];
    header.data_at = header.palette_at;
    if (header.has_palette)
        header.data_at += std::size_t{header.palette_count} * ((header.palette_bits + 7) / 8);
    const bool right_depth = header.type == kTgaColor ? isColorDepth(header.bits)
                                                      : header.bits == 8 || header.bits == 16;
    const bool right_palette = header.has_palette
                                   ? isColorDepth(header.palette_bits) && header.palette_count > 0
                                   : header.type != kTgaPalette;
    return bytes[1] <= 1 && header.type >= kTgaPalette && header.type <= kTgaGrey &&
           (bytes[17] & 0xC0U) == 0 && header.width > 0 && header.height > 0 && right_depth &&
           right_palette && header.data_at < bytes.size();
}

class TgaDecoder final : public RgbaDecoder {
  public:
    explicit TgaDecoder(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
        if (!readTgaHeader(bytes, header_)) fail("the header is damaged");
        setSize(static_cast<int>(header_.width), static_cast<int>(header_.height));
        size_ = (header_.bits + 7) / 8;
        if (!header_.has_runs && pixels() * size_ > bytes_.size() - header_.data_at)
            fail("the file ends before its pixels do");
    }

  private:
    using Texel = std::array<std::uint8_t, 4>;

    [[noreturn]] static void fail(const std::string& what) {
        throw std::runtime_error("TGA: " + what);
    }

    void decode(std::uint8_t* rgba) const override {
        std::size_t at = header_.data_at, run = 0;
        bool repeats = false;
        Texel texel{};
        for (std::size_t i = 0; i < pixels(); ++i) {
            bool is_next = true;
            if (header_.has_runs) {
                const bool begins = run == 0;
                if (begins) {
                    check(at, 1);
                    repeats = (bytes_[at] & 0x80U) != 0;
                    run = (bytes_[at++] & 0x7FU) + 1U;
                }
                is_next = begins || !repeats;
                --run;
            }
            if (is_next) {
                check(at, size_);
                texel = texelAt(at);
                at += size_;
            }
            std::ranges::copy(texel, rgba + 4 * place(i));
        }
    }

    void check(std::size_t at, std::size_t size) const {
        if (size > bytes_.size() - std::min(at, bytes_.size()))
            fail("the file ends before its pixels do");
    }

    /// Returns the index in the picture of pixel `i` in the file.
    std::size_t place(std::size_t i) const {
        const std::size_t x = i % header_.width, y = i / header_.width;
        return (header_.from_top ? y : header_.height - 1 - y) * header_.width +
               (header_.from_right ? header_.width - 1 - x : x);
    }

    Texel texelAt(std::size_t at) const {
        const std::uint8_t* const from = bytes_.data() + at;
        if (header_.type == kTgaColor) return color(from, header_.bits);
        if (header_.type == kTgaGrey)
            return {from[0], from[0], from[0], size_ == 2 ? from[1] : std::uint8_t{255}};
        const std::uint32_t index = size_ == 2 ? from[0] | std::uint32_t{from[1]} << 8U : from[0];
        const std::uint32_t entry = index - header_.palette_first;
        if (entry >= header_.palette_count) fail("a pixel has no colour in the palette");
        const std::size_t place = entry * std::size_t{(header_.palette_bits + 7) / 8};
        return color(bytes_.data() + header_.palette_at + place, header_.palette_bits);
    }

    /// Returns the colour at `from`. Ignores the highest of 16 bits, because programs disagree on
    /// whether it stores alpha.
    static Texel color(const std::uint8_t* from, std::uint32_t bits) {
        if (bits >= 24)
            return {from[2], from[1], from[0], bits == 32 ? from[3] : std::uint8_t{255}};
        const std::uint32_t pixel = from[0] | std::uint32_t{from[1]} << 8U;
        const auto component = [&](unsigned shift) {
            return static_cast<std::uint8_t>(((pixel >> shift & 31U) * 255 + 15) / 31);
        };
        return {component(10), component(5), component(0), 255};
    }

    std::span<const std::uint8_t> bytes_;
    TgaHeader header_;
    std::size_t size_ = 0;  ///< bytes per pixel
};

}  // namespace

bool isTga(std::span<const std::uint8_t> bytes) {
    TgaHeader header;
    return readTgaHeader(bytes, header);
}

std::unique_ptr<ImageDecoder> tgaDecoder(const std::string&, std::span<const std::uint8_t> bytes) {
    return std::make_unique<TgaDecoder>(bytes);
}

}  // namespace peeler
