// SPDX-License-Identifier: Apache-2.0
// Writers of data textures (values, not colours) as PNG and OpenEXR.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// A square data texture. The rows are stored from top to bottom (v = 0 first).
struct ValueTexture {
    std::string name;
    int size = 0;                ///< texels per side
    std::size_t components = 1;  ///< 1 or 3
    std::vector<float> values;
};

/// Returns the texture as a grey or RGB PNG with 8 or 16 bits. Maps values from 0 to 1 linearly to
/// the full range, without a transfer function. Clips other values; NaN becomes 0. Throws Error
/// (kOutput).
std::vector<std::uint8_t> encodePng(const ValueTexture& texture, int bits);

/// Writes the texture as a 16-bit PNG, atomically. Throws Error (kOutput).
void writePngTexture(const std::string& path, const ValueTexture& texture,
                     const std::string& software);

/// Writes an OpenEXR file, atomically, with one part per texture, in order: 32-bit floats in
/// channels Y or R, G, B. Textures must have different names. Throws Error (kOutput).
void writeExrTextures(const std::string& path, std::span<const ValueTexture> textures,
                      const std::string& software);

}  // namespace peeler
