// SPDX-License-Identifier: Apache-2.0
// Decoder of the largest level of KTX 2.0 files: unpacks it with libzstd or libdeflate, or reads
// BasisLZ.
//
// Smaller levels must exist but are not decoded, since the renderer builds its own mipmaps.
#include <libdeflate.h>
#include <zstd.h>

#include <algorithm>
#include <memory>
#include <new>

#include "formats/file/byte_buffer.h"
#include "formats/image/image_codecs.h"
#include "formats/image/ktx2.h"

namespace peeler {
namespace {

/// Checks that a level consists of frames of RFC 8878. libzstd would also read the formats of its
/// versions before 1.
void checkFrames(const Ktx2Level& level) {
    constexpr std::uint8_t kMagic[] = {0x28, 0xB5, 0x2F, 0xFD};
    auto rest = level.bytes;
    while (!rest.empty()) {
        const std::uint64_t at = level.offset + (level.bytes.size() - rest.size());
        if (rest.size() < std::size(kMagic) ||
            !std::equal(std::begin(kMagic), std::end(kMagic), rest.begin()))
            failKtx2("no Zstandard frame begins here", at);
        const std::size_t size = ZSTD_findFrameCompressedSize(rest.data(), rest.size());
        if (ZSTD_isError(size)) failKtx2(std::string("Zstandard: ") + ZSTD_getErrorName(size), at);
        rest = rest.subspan(size);
    }
}

/// Unpacks a level. Throws unless it fills `out` exactly.
void unpackLevel(Ktx2Packing packing, const Ktx2Level& level, ByteBuffer& out) {
    out.resize(level.unpacked_bytes);
    if (packing == Ktx2Packing::kZstandard) {
        checkFrames(level);
        const std::size_t size =
            ZSTD_decompress(out.data(), out.size(), level.bytes.data(), level.bytes.size());
        if (ZSTD_isError(size))
            failKtx2(std::string("Zstandard: ") + ZSTD_getErrorName(size), level.offset);
        if (size != out.size())
            failKtx2("Zstandard unpacks to " + std::to_string(size) + " bytes, not to " +
                         std::to_string(out.size()),
                     level.offset);
        return;
    }
    const std::unique_ptr<libdeflate_decompressor, void (*)(libdeflate_decompressor*)> inflater(
        libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
    if (!inflater) throw std::bad_alloc();
    if (libdeflate_zlib_decompress(inflater.get(), level.bytes.data(), level.bytes.size(),
                                   out.data(), out.size(), nullptr) != LIBDEFLATE_SUCCESS)
        failKtx2("ZLIB does not unpack to " + std::to_string(out.size()) + " bytes", level.offset);
}

void expandPlainTexels(std::span<const std::uint8_t> texels, std::size_t channels,
                       std::uint8_t* rgba) {
    for (std::size_t i = 0; i + channels <= texels.size(); i += channels, rgba += 4) {
        rgba[3] = 255;
        std::copy_n(texels.data() + i, channels, rgba);
    }
}

void swizzleTexels(const std::array<char, 4>& swizzle, std::uint8_t* rgba, std::size_t pixels) {
    constexpr std::string_view kComponents = "rgba01";
    if (std::string_view(swizzle.data(), 4) == kComponents.substr(0, 4)) return;
    std::array<std::size_t, 4> from{};
    for (std::size_t c = 0; c < 4; ++c)
        from[c] = kComponents.find(swizzle[c]);
    for (; pixels > 0; --pixels, rgba += 4) {
        const std::uint8_t texel[] = {rgba[0], rgba[1], rgba[2], rgba[3], 0, 255};
        for (std::size_t c = 0; c < 4; ++c)
            rgba[c] = texel[from[c]];
    }
}

class Ktx2Decoder final : public RgbaDecoder {
  public:
    explicit Ktx2Decoder(std::span<const std::uint8_t> bytes) : file_(readKtx2(bytes)) {
        setSize(file_.levels[0].width, file_.levels[0].height);
        image_.codec = file_.codec;
        image_.srgb = file_.srgb;
        image_.notes = file_.notes;
    }

  private:
    void decode(std::uint8_t* rgba) const override {
        const Ktx2Level& level = file_.levels[0];
        if (file_.texels == Ktx2Texels::kEtc1s) {
            decodeEtc1s(file_, rgba);
        } else {
            ByteBuffer unpacked;
            std::span<const std::uint8_t> texels = level.bytes;
            if (file_.packing != Ktx2Packing::kNone) {
                unpackLevel(file_.packing, level, unpacked);
                texels = {reinterpret_cast<const std::uint8_t*>(unpacked.data()), unpacked.size()};
            }
            if (file_.texels == Ktx2Texels::kUastc)
                decodeUastc(texels, level.width, level.height, file_.srgb.value_or(false), rgba);
            else
                expandPlainTexels(texels, file_.texels == Ktx2Texels::kRgb8 ? 3 : 4, rgba);
        }
        swizzleTexels(file_.swizzle, rgba, pixels());
    }

    Ktx2Container file_;
};

}  // namespace

std::unique_ptr<ImageDecoder> ktx2Decoder(const std::string&, std::span<const std::uint8_t> bytes) {
    return std::make_unique<Ktx2Decoder>(bytes);
}

}  // namespace peeler
