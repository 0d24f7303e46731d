// SPDX-License-Identifier: Apache-2.0
// Metadata stripping: reduces PNG, JPEG and WebP files to the data their pixels need.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// A stripped file, with the metadata that affects how it is shown.
struct ReducedImage {
    std::vector<std::uint8_t> bytes;
    int orientation = 1;  ///< Exif orientation (TIFF 6.0, "Orientation"); 1 = as stored
    std::vector<std::string> notes{};  ///< features that are not shown, as in StoredImage
};

/// Strips a PNG (ISO/IEC 15948) to its critical chunks and tRNS. A texture's colour profile, gamma
/// and texts are not used (glTF 2.0 §3.8.3), their parsers are where decoders have vulnerabilities,
/// and libpng prints complaints about them to stderr. Throws Error (kInput) with an empty `where`
/// if chunks are truncated or their checksums are wrong.
ReducedImage withoutPngMetadata(std::span<const std::uint8_t> bytes);

/// Strips Exif, IPTC, profiles and comments from a JPEG (ITU-T T.81), for the same reasons. Adobe's
/// APP14 stays, since it defines the colour encoding. A file that ends within its pixels gets a
/// note, since libjpeg fills the missing ones with grey. Throws Error (kInput) with an empty
/// `where` if the file ends before the pixels or has damaged markers.
ReducedImage withoutJpegMetadata(std::span<const std::uint8_t> bytes);

/// Strips Exif, XMP, profiles and unknown chunks from a WebP (RFC 9649), for the same reasons:
/// OpenImageIO before 3.1.14 reads beyond the end of an Exif shorter than six bytes. Throws Error
/// (kInput) with an empty `where` if a chunk is truncated.
ReducedImage withoutWebpMetadata(std::span<const std::uint8_t> bytes);

}  // namespace peeler
