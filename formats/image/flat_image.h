// SPDX-License-Identifier: Apache-2.0
// Reader of flat pictures as linear values: PNG, JPEG, TIFF, Radiance, and OpenEXR without layers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <peeler/composite.h>

namespace peeler {

struct FlatImageLimits {
    int max_side = 65536;  ///< maximum width and height, in pixels
    /// Maximum decoded size in bytes, at 16 bytes per pixel.
    std::uint64_t max_bytes = std::uint64_t{4} << 30;
};

struct FlatImage {
    CompositeImage image;  ///< linear Rec. 709, premultiplied; z is infinite
    /// The size of the display window in pixels, and whether the file positions the image in the
    /// display window (as EXR does). If not, the image's window has this size and starts at (0, 0).
    int width = 0, height = 0;
    bool placed = false;
    /// Features of the file that are not shown, as clauses like "it is animated; …".
    std::vector<std::string> notes{};
};

/// Reads a picture. Integer samples in PNG, JPEG and TIFF are read as sRGB, floating-point samples
/// as linear; profiles are ignored. Grey becomes R = G = B, missing alpha becomes 1. For OpenEXR
/// files, reads the channels R, G, B, A (or Y) of the first part. Applies the orientation in Exif,
/// TIFF or Radiance, so that rows run from top to bottom and pixels from left to right. Throws
/// Error (kInput) if the file is not such a picture, is deep, is damaged or exceeds the limits,
/// Error (kMemory) if memory runs out.
FlatImage readFlatImage(const std::string& path, const FlatImageLimits& limits = {});

/// Returns the description stored in the file (Description in PNG, ImageDescription in Exif), or ""
/// without a description. Throws the errors of readFlatImage().
std::string imageDescription(const std::string& path);

}  // namespace peeler
