// SPDX-License-Identifier: Apache-2.0
// Texture decoder.
#include "formats/gltf/gltf_decoders.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include <peeler/error.h>
#include "formats/image/image_codecs.h"
#include "formats/image/image_metadata.h"

namespace peeler {
namespace {

using namespace std::literals;

[[noreturn]] void failTexture(const std::string& what,
                              const char* hint = "save it again as PNG or JPEG") {
    throw Error(ErrorKind::kInput, what, "", hint);
}

/// A texture format, recognised by its magic bytes. OpenImageIO would try all of its readers in
/// turn, and some of them are fragile.
struct TextureFormat {
    const char* name;   ///< name in OpenImageIO
    const char* codec;  ///< name in messages
    std::string_view begin, at_eight;
    /// Removes unneeded metadata, because most vulnerabilities of decoders are in their parsers of
    /// metadata. Null if nothing is removed.
    ReducedImage (*reduce)(std::span<const std::uint8_t>);
    bool in_gltf = true;  ///< whether the format is part of glTF 2.0 or an extension
    /// Recognises a format that has no signature.
    bool (*recognises)(std::span<const std::uint8_t>) = nullptr;
};
constexpr TextureFormat kTextureFormats[] = {
    {"png", "PNG", "\x89PNG\r\n\x1A\n", "", withoutPngMetadata},
    {"jpeg", "JPEG", "\xFF\xD8\xFF", "", withoutJpegMetadata},
    {"webp", "WebP", "RIFF", "WEBP", withoutWebpMetadata},
    {"ktx2", "KTX2", "\xABKTX 20\xBB", "\r\n\x1A\n", nullptr},
    {"bmp", "BMP", "BM", "", nullptr, false},
    {"tiff", "TIFF", "II*\0"sv, "", nullptr, false},
    {"tiff", "TIFF", "MM\0*"sv, "", nullptr, false},
    {"targa", "TGA", "", "", nullptr, false, isTga},
};

/// Returns the size that a WebP picture declares (RFC 9649, RFC 6386), or no value if the header is
/// damaged. The decoder itself reports the size only after it has allocated all memory.
std::optional<StoredImage> webpSize(std::span<const std::uint8_t> bytes) {
    constexpr std::size_t kHeader = 30;
    if (bytes.size() < kHeader) return std::nullopt;
    const auto number = [&](std::size_t at, std::size_t size) {
        std::uint32_t value = 0;
        for (std::size_t i = size; i-- > 0;)
            value = value << 8U | bytes[at + i];
        return value;
    };
    const std::string_view kind(reinterpret_cast<const char*>(bytes.data()) + 12, 4);
    StoredImage stored;
    stored.channels = {"R", "G", "B", "A"};
    const auto set = [&](std::uint32_t width, std::uint32_t height) {
        stored.width = static_cast<int>(width);
        stored.height = static_cast<int>(height);
        return stored;
    };
    constexpr std::uint32_t kFourteenBits = 0x3FFF;
    if (kind == "VP8X") return set(number(24, 3) + 1, number(27, 3) + 1);
    if (kind == "VP8L")
        return set((number(21, 4) & kFourteenBits) + 1, (number(21, 4) >> 14U & kFourteenBits) + 1);
    if (kind == "VP8 ") return set(number(26, 2) & kFourteenBits, number(28, 2) & kFourteenBits);
    return std::nullopt;
}

void checkTextureSize(const StoredImage& stored, const TextureLimits& limits) {
    if (stored.width < 1 || stored.height < 1 || stored.depth > 1 || stored.channels.empty())
        failTexture("the image has no pixels");
    const std::uint64_t bytes = std::uint64_t{4} * static_cast<std::uint64_t>(stored.width) *
                                static_cast<std::uint64_t>(stored.height);
    if (std::max(stored.width, stored.height) > limits.max_dimension || bytes > limits.max_bytes)
        failTexture("the image of " + std::to_string(stored.width) + " x " +
                        std::to_string(stored.height) + " pixels is larger than the limit of " +
                        std::to_string(limits.max_dimension) + " pixels per side and " +
                        std::to_string(limits.max_bytes) + " bytes",
                    "scale it down");
}

/// Expands pixels to RGBA in place. Goes from the last pixel to the first, since the stored pixels
/// are at the beginning of `rgba`.
void expandToRgba(std::vector<std::uint8_t>& rgba, std::size_t channels) {
    for (std::size_t pixel = rgba.size() / 4; pixel-- > 0;) {
        const std::uint8_t* from = rgba.data() + pixel * channels;
        const bool grey = channels < 3;
        const std::uint8_t r = from[0], g = grey ? r : from[1], b = grey ? r : from[2];
        const std::uint8_t a = channels == 2   ? from[1]
                               : channels == 4 ? from[3]
                                               : std::uint8_t{255};
        std::uint8_t* to = rgba.data() + pixel * 4;
        to[0] = r;
        to[1] = g;
        to[2] = b;
        to[3] = a;
    }
}

}  // namespace

DecodedTexture decodeTexture(std::span<const std::uint8_t> bytes, const std::string& name,
                             const TextureLimits& limits) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const auto* const format = std::ranges::find_if(kTextureFormats, [&](const TextureFormat& row) {
        if (row.recognises) return row.recognises(bytes);
        return text.starts_with(row.begin) &&
               text.substr(std::min<std::size_t>(8, text.size())).starts_with(row.at_eight);
    });
    if (format == std::end(kTextureFormats))
        failTexture("the image is neither PNG nor JPEG nor WebP, KTX2, BMP, TIFF or TGA");
    ReducedImage reduced;
    if (format->reduce) {
        reduced = format->reduce(bytes);
        bytes = reduced.bytes;
    }
    static std::once_flag limits_set;
    std::call_once(limits_set, [] { limitDecodedSize(4096); });
    const auto bytesFor =
        [](const StoredImage& stored) {  // the decoder may also hold the stored pixels
            return static_cast<std::uint64_t>(stored.width) *
                   static_cast<std::uint64_t>(stored.height) * (4 + stored.channels.size());
        };
    // The WebP decoder decodes all pixels when it opens the picture.
    const bool is_webp = format->name == std::string_view("webp");
    if (is_webp) {
        const auto stored = webpSize(bytes);
        if (!stored) failTexture("the WebP header is damaged");
        checkTextureSize(*stored, limits);
        if (limits.allow) limits.allow(bytesFor(*stored));
    }
    try {
        const auto decoder =
            imageDecoder(format->name, "texture." + std::string(format->name), bytes);
        const StoredImage& stored = decoder->image();
        checkTextureSize(stored, limits);
        if (limits.allow && !is_webp) limits.allow(bytesFor(stored));

        DecodedTexture out;
        Image& image = out.image;
        image.name = name;
        image.codec = stored.codec.empty() ? format->codec : stored.codec;
        out.in_gltf = format->in_gltf;
        out.srgb = stored.srgb;
        image.width = stored.width;
        image.height = stored.height;
        image.rgba.resize(std::size_t{4} * static_cast<std::size_t>(stored.width) *
                          static_cast<std::size_t>(stored.height));
        const std::size_t channels = std::min<std::size_t>(stored.channels.size(), 4);
        decoder->read(0, static_cast<int>(channels), image.rgba.data());
        expandToRgba(image.rgba, channels);
        out.notes = stored.notes;
        out.notes.insert(out.notes.end(), reduced.notes.begin(), reduced.notes.end());
        if (reduced.orientation != 1)
            out.notes.push_back("its Exif orientation " + std::to_string(reduced.orientation) +
                                " is ignored; textures are used as stored");
        return out;
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw Error(ErrorKind::kMemory, "not enough memory to decode the image \"" + name + "\"");
    } catch (const std::exception& problem) {
        failTexture("the image cannot be decoded: " + std::string(problem.what()));
    }
}

}  // namespace peeler
