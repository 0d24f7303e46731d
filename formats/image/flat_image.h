// SPDX-License-Identifier: Apache-2.0
// Reads flat pictures as numbers to calculate with: PNG, JPEG, TIFF, Radiance, and OpenEXR without
// layers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <peeler/composite.h>

namespace peeler {

struct FlatImageLimits {
    int max_side = 65536;                              ///< pixels
    std::uint64_t max_bytes = std::uint64_t{4} << 30;  ///< decoded, 16 bytes a pixel
};

struct FlatImage {
    CompositeImage image;  ///< linear Rec. 709, premultiplied; z is +inf
    /// Size of the display window in pixels, and whether the file tells where in it the image lies
    /// (EXR). If not, the window of the image begins at (0, 0) and is as large.
    int width = 0, height = 0;
    bool placed = false;
    /// What the file says and is not shown, each a clause: "it is animated; …".
    std::vector<std::string> notes{};
};

/// Reads a picture. Integer samples of PNG, JPEG and TIFF are taken for sRGB, floating-point ones
/// for linear; profiles are not used. Grey becomes R = G = B, no alpha becomes 1. Rows come from
/// the top, pixels from the left, as Exif, TIFF and Radiance say that the picture is seen. Of an
/// OpenEXR file the first part is read, its channels R, G, B, A (or Y). Throws Error (kInput) for
/// what is no such picture, deep, damaged or larger than the limits; (kMemory).
FlatImage readFlatImage(const std::string& path, const FlatImageLimits& limits = {});

/// What such a file says of itself (PNG's Description, Exif's ImageDescription); "" if nothing.
/// Throws likewise.
std::string imageDescription(const std::string& path);

}  // namespace peeler
