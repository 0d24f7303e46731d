// SPDX-License-Identifier: Apache-2.0
// Textures of numbers, not of colours: PNG and OpenEXR.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// A square of numbers, rows top to bottom (v = 0 first).
struct ValueTexture {
    std::string name;
    int size = 0;                ///< texels a side
    std::size_t components = 1;  ///< 1 or 3
    std::vector<float> values;
};

/// A grey or RGB PNG of 8 or 16 bits; 0 to 1 is the whole range, linearly, no transfer function.
/// What is outside is clipped, NaN becomes 0. Throws Error (kOutput).
std::vector<std::uint8_t> encodePng(const ValueTexture& texture, int bits);

/// Writes one, with 16 bits, whole or not at all. Throws Error (kOutput).
void writePngTexture(const std::string& path, const ValueTexture& texture,
                     const std::string& software);

/// Writes a part of 32-bit floats for each, in order, with channels Y or R, G, B. The names have to
/// differ. Whole or not at all. Throws Error (kOutput).
void writeExrTextures(const std::string& path, std::span<const ValueTexture> textures,
                      const std::string& software);

}  // namespace peeler
