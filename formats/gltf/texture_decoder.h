// SPDX-License-Identifier: Apache-2.0
// Decodes the PNG, JPEG or WebP bytes of a texture.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/scene/scene.h"

namespace peeler {

struct TextureLimits {
    int max_dimension = 16384;                         ///< width and height, pixels
    std::uint64_t max_bytes = std::uint64_t{1} << 30;  ///< decoded, 4 bytes a pixel
};

/// The picture as 8-bit RGBA with straight alpha, numbers as stored (no colour conversion, no
/// orientation). Grey becomes R = G = B, no alpha becomes 255, 16 bits are rounded to 8. The format
/// is told by the first bytes; nothing but PNG, JPEG and WebP is handed to a decoder.
/// Throws Error(kInput) with an empty `where`. May be called from several threads.
Image decodeTexture(std::span<const std::uint8_t> bytes, const std::string& name,
                    const TextureLimits& limits = {});

}  // namespace peeler
