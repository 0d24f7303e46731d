// SPDX-License-Identifier: Apache-2.0
// Removal of metadata chunk by chunk, or segment by segment.
#include "formats/image/image_metadata.h"

#include <libdeflate.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>

#include <peeler/error.h>

namespace peeler {
namespace {

[[noreturn]] void failToDecode(const std::string& what) {
    throw Error(ErrorKind::kInput, "the image cannot be decoded: " + what, "",
                "save it again as PNG or JPEG");
}

std::uint32_t bigEndian(std::span<const std::uint8_t> bytes, std::size_t offset, std::size_t size) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
        value = value << 8U | bytes[offset + i];
    return value;
}

/// Whether the scans of a JPEG end with an EOI marker. Inside a scan, 0xFF begins a marker unless a
/// zero follows. Rejects JPEGs with too many scans, because even a scan of a few bytes takes a pass
/// over all blocks; encoders write ten scans.
bool scansEnd(std::span<const std::uint8_t> scans) {
    constexpr int kMostScans = 100;
    constexpr std::uint8_t kStartOfScan = 0xDA, kEndOfImage = 0xD9;
    int count = 0;
    bool end = false;
    for (std::size_t i = 0; i + 1 < scans.size(); ++i) {
        if (scans[i] != 0xFF) continue;
        end = end || scans[i + 1] == kEndOfImage;
        if (scans[i + 1] == kStartOfScan && ++count > kMostScans)
            failToDecode("the JPEG has more than " + std::to_string(kMostScans) + " scans");
    }
    return end;
}

std::uint32_t littleEndian(std::span<const std::uint8_t> bytes, std::size_t offset) {
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;)
        value = value << 8U | bytes[offset + i];
    return value;
}

std::string_view textOf(std::span<const std::uint8_t> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Returns the orientation in Exif data, which is a TIFF (CIPA DC-008, 4.6), or 1 if the
/// orientation is missing.
int exifOrientation(std::span<const std::uint8_t> exif) {
    constexpr std::string_view kPrefix("Exif\0\0", 6);
    constexpr std::size_t kHeader = 8, kEntry = 12;
    constexpr std::uint32_t kOrientation = 0x0112, kMost = 8;
    if (textOf(exif).starts_with(kPrefix)) exif = exif.subspan(kPrefix.size());
    if (exif.size() < kHeader) return 1;
    const bool little = exif[0] == 'I';
    const auto number = [&](std::size_t at, std::size_t size) {
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < size; ++i)
            value = value << 8U | exif[at + (little ? size - 1 - i : i)];
        return value;
    };
    const std::size_t directory = number(4, 4);
    if (directory > exif.size() || exif.size() - directory < 2) return 1;
    const std::size_t entries =
        std::min<std::size_t>(number(directory, 2), (exif.size() - directory - 2) / kEntry);
    for (std::size_t i = 0; i < entries; ++i) {
        const std::size_t at = directory + 2 + i * kEntry;
        if (number(at, 2) != kOrientation) continue;
        const std::uint32_t value = number(at + 8, 2);
        return value >= 1 && value <= kMost ? static_cast<int>(value) : 1;
    }
    return 1;
}

}  // namespace

ReducedImage withoutPngMetadata(std::span<const std::uint8_t> bytes) {
    // Sizes in bytes. The frame of a chunk consists of length, type and checksum.
    constexpr std::size_t kSignature = 8, kFrame = 12;
    if (bytes.size() < kSignature) failToDecode("the PNG is truncated");
    ReducedImage result{{bytes.begin(), bytes.begin() + kSignature}};
    result.bytes.reserve(bytes.size());
    bool has_pixels = false;
    for (std::size_t offset = kSignature;;) {
        if (bytes.size() - offset < kFrame) failToDecode("the PNG is truncated");
        const std::size_t length = bigEndian(bytes, offset, 4);
        if (length > bytes.size() - offset - kFrame) failToDecode("the PNG is truncated");
        const std::span<const std::uint8_t> chunk = bytes.subspan(offset, length + kFrame);
        const std::string_view type = textOf(chunk).substr(4, 4);
        if (offset == kSignature && type != "IHDR")
            failToDecode("the PNG does not begin with IHDR");
        if (type == "IHDR" || type == "PLTE" || type == "tRNS" || type == "IDAT" ||
            type == "IEND") {
            if (libdeflate_crc32(0, chunk.data() + 4, length + 4) !=
                bigEndian(chunk, length + 8, 4))
                failToDecode("a checksum of the PNG is wrong");
            result.bytes.insert(result.bytes.end(), chunk.begin(), chunk.end());
        } else if (type == "eXIf") {
            result.orientation = exifOrientation(chunk.subspan(8, length));
        } else if (type == "acTL") {
            result.notes.emplace_back("it is animated; its first picture is shown");
        } else if ((chunk[4] & 0x20U) == 0) {  // §5.4: critical chunks begin with a capital letter
            failToDecode("the PNG has chunks of an unknown kind");
        }
        has_pixels = has_pixels || type == "IDAT";
        if (type == "IEND" && !has_pixels) failToDecode("the PNG has no pixels");
        if (type == "IEND") return result;
        offset += chunk.size();
    }
}

ReducedImage withoutJpegMetadata(std::span<const std::uint8_t> bytes) {
    constexpr std::uint8_t kStartOfScan = 0xDA, kComment = 0xFE, kApp1 = 0xE1, kApp14 = 0xEE,
                           kApp15 = 0xEF;
    if (bytes.size() < 4) failToDecode("the JPEG is truncated");
    ReducedImage result{{bytes.begin(), bytes.begin() + 2}};
    result.bytes.reserve(bytes.size());
    for (std::size_t offset = 2;;) {
        // §B.1.1.2: any number of fill bytes may precede a marker.
        while (offset + 1 < bytes.size() && bytes[offset] == 0xFF && bytes[offset + 1] == 0xFF)
            ++offset;
        if (bytes.size() - offset < 4) failToDecode("the JPEG is truncated");
        if (bytes[offset] != 0xFF) failToDecode("the JPEG's markers are damaged");
        const std::uint8_t marker = bytes[offset + 1];
        const std::size_t length = bigEndian(bytes, offset + 2, 2) + 2;
        if (length > bytes.size() - offset) failToDecode("the JPEG is truncated");
        if (marker == kStartOfScan) {
            if (!scansEnd(bytes.subspan(offset)))
                result.notes.emplace_back(
                    "the JPEG is cut off (there is no EOI marker); missing pixels are grey");
            result.bytes.insert(result.bytes.end(),
                                bytes.begin() + static_cast<std::ptrdiff_t>(offset), bytes.end());
            return result;
        }
        const bool metadata =
            marker == kComment || (marker >= kApp1 && marker <= kApp15 && marker != kApp14);
        const std::span<const std::uint8_t> segment = bytes.subspan(offset, length);
        if (!metadata)
            result.bytes.insert(result.bytes.end(), segment.begin(), segment.end());
        else if (marker == kApp1 && length > 8 && textOf(segment).substr(4, 4) == "Exif" &&
                 result.orientation == 1)
            result.orientation = exifOrientation(segment.subspan(4));
        offset += length;
    }
}

ReducedImage withoutWebpMetadata(std::span<const std::uint8_t> bytes) {
    // Sizes in bytes: of RIFF, file size and WEBP; of a chunk's name and size.
    constexpr std::size_t kHeader = 12, kFrame = 8;
    constexpr std::string_view kKept[] = {"VP8 ", "VP8L", "VP8X", "ALPH", "ANIM", "ANMF"};
    constexpr std::uint8_t kMetadataFlags = 0x2C;  // section 2.7.1: flags for profile, Exif and XMP
    if (bytes.size() < kHeader) failToDecode("the WebP is truncated");
    ReducedImage reduced{{bytes.begin(), bytes.begin() + kHeader}};
    std::vector<std::uint8_t>& result = reduced.bytes;
    result.reserve(bytes.size());
    // Bytes beyond the end of the RIFF do not belong to the picture.
    bytes = bytes.first(std::min(bytes.size(), kFrame + std::size_t{littleEndian(bytes, 4)}));
    for (std::size_t offset = kHeader; offset < bytes.size();) {
        if (bytes.size() - offset < kFrame) failToDecode("the WebP is truncated");
        const std::size_t length = littleEndian(bytes, offset + 4);
        if (length > bytes.size() - offset - kFrame) failToDecode("the WebP is truncated");
        const std::span<const std::uint8_t> chunk = bytes.subspan(offset, kFrame + length);
        const std::string_view name = textOf(chunk).substr(0, 4);
        if (name == "EXIF") reduced.orientation = exifOrientation(chunk.subspan(kFrame));
        if (name == "ANIM")
            reduced.notes.emplace_back("it is animated; its first picture is shown");
        if (std::ranges::find(kKept, name) != std::end(kKept)) {
            result.insert(result.end(), chunk.begin(), chunk.end());
            if (name == "VP8X" && length > 0)
                result[result.size() - length] &= static_cast<std::uint8_t>(~kMetadataFlags);
            if (length % 2 != 0) result.push_back(0);
        }
        offset += chunk.size() + length % 2;
    }
    for (std::size_t i = 0; i < 4; ++i)
        result[4 + i] = static_cast<std::uint8_t>((result.size() - kFrame) >> (8 * i));
    return reduced;
}

}  // namespace peeler
