// SPDX-License-Identifier: Apache-2.0
// Reduces PNG, JPEG and WebP files to what decoding their pixels needs.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// What decoding the pixels of a file needs, and what the rest says of them.
struct ReducedImage {
    std::vector<std::uint8_t> bytes;
    int orientation = 1;               ///< Exif's (TIFF 6.0, "Orientation"); 1 = as stored
    std::vector<std::string> notes{};  ///< what of the picture is not shown, as StoredImage::notes
};

/// The PNG (ISO/IEC 15948) with its critical chunks and tRNS only. A texture's colour profile,
/// gamma and texts are not used (glTF 2.0 §3.8.3), parsing them is where decoders have their
/// vulnerabilities, and libpng writes complaints about them to stderr. Throws Error (kInput) with
/// an empty `where` if chunks are truncated or their checksums are wrong.
ReducedImage withoutPngMetadata(std::span<const std::uint8_t> bytes);

/// The JPEG (ITU-T T.81) without Exif, IPTC, profiles and comments, for the same reasons; Adobe's
/// APP14 stays, since it says how the colours are stored. A file that ends in the middle of its
/// pixels gets a note, since libjpeg fills the missing ones with grey. Throws Error (kInput),
/// likewise, for a file that ends before the pixels or has damaged markers.
ReducedImage withoutJpegMetadata(std::span<const std::uint8_t> bytes);

/// The WebP (RFC 9649) without Exif, XMP, profiles and chunks that nobody knows, for the same
/// reasons: OpenImageIO before 3.1.14 reads Exif of less than six bytes beyond its end. Throws
/// Error (kInput) likewise if a chunk is truncated.
ReducedImage withoutWebpMetadata(std::span<const std::uint8_t> bytes);

}  // namespace peeler
