// SPDX-License-Identifier: Apache-2.0
// Removal of metadata: reduces PNG, JPEG and WebP files to the data that their pixels need.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// A file without metadata, and the metadata that affects the display of the picture.
struct ReducedImage {
    std::vector<std::uint8_t> bytes;
    /// Orientation as in Exif (TIFF 6.0); 1 means that the picture is stored upright.
    int orientation = 1;
    std::vector<std::string> notes{};  ///< features that are not shown, as in StoredImage
};

/// Reduces a PNG (ISO/IEC 15948) to its critical chunks and tRNS. glTF does not use a texture's
/// colour profile, gamma and texts (glTF 2.0 §3.8.3). Most vulnerabilities of decoders are in the
/// parsers of such metadata, and libpng complains about metadata on stderr. Throws Error (kInput)
/// with an empty `where` if chunks are truncated or have wrong checksums.
ReducedImage withoutPngMetadata(std::span<const std::uint8_t> bytes);

/// Removes Exif, IPTC, profiles and comments from a JPEG (ITU-T T.81), for the reasons given at
/// withoutPngMetadata(). Adobe's APP14 stays, since it defines the colour encoding. If the pixel
/// data is truncated, adds a note to `notes`, since libjpeg fills the missing pixels with grey.
/// Throws Error (kInput) with an empty `where` if the file ends before the pixels or has damaged
/// markers.
ReducedImage withoutJpegMetadata(std::span<const std::uint8_t> bytes);

/// Removes Exif, XMP, profiles and unknown chunks from a WebP (RFC 9649), for the reasons given at
/// withoutPngMetadata(). For example, OpenImageIO before 3.1.14 reads beyond the end of Exif data
/// shorter than six bytes. Throws Error (kInput) with an empty `where` if a chunk is truncated.
ReducedImage withoutWebpMetadata(std::span<const std::uint8_t> bytes);

}  // namespace peeler
