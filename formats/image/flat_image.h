// SPDX-License-Identifier: Apache-2.0
// Reader of flat pictures as linear values: PNG, JPEG, TIFF, Radiance, and OpenEXR without layers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <peeler/composite.h>

namespace peeler {

struct FlatImageLimits {
    int max_side = 65536;                              ///< pixels
    std::uint64_t max_bytes = std::uint64_t{4} << 30;  ///< decoded, 16 bytes per pixel
};

struct FlatImage {
    CompositeImage image;  ///< linear Rec. 709, premultiplied; z is +inf
    /// Size of the display window in pixels, and whether the file places the image in it (EXR). If
    /// not, the image's window starts at (0, 0) and has the same size.
    int width = 0, height = 0;
    bool placed = false;
    /// Features of the file that are not shown, a clause each: "it is animated; …".
    std::vector<std::string> notes{};
};

/// Reads a picture. Integer samples of PNG, JPEG and TIFF are read as sRGB, floating-point ones as
/// linear; profiles are not used. Grey becomes R = G = B, missing alpha becomes 1. Rows run from
/// the top and pixels from the left, after applying the orientation of Exif, TIFF and Radiance. Of
/// an OpenEXR file the first part is read, its channels R, G, B, A (or Y). Throws Error (kInput) if
/// the file is not such a picture, is deep, is damaged or exceeds the limits, and Error (kMemory)
/// if memory runs out.
FlatImage readFlatImage(const std::string& path, const FlatImageLimits& limits = {});

/// Returns the file's description (PNG's Description, Exif's ImageDescription); "" if there is
/// none. Throws like readFlatImage().
std::string imageDescription(const std::string& path);

}  // namespace peeler
