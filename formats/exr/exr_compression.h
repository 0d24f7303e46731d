// SPDX-License-Identifier: Apache-2.0
// The lossless ways to compress OpenEXR files that peeler writes.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace peeler {

struct ExrCompression {
    std::string_view name;  ///< for --compression; ExrInputPart::compression
    std::string_view summary;
    int rows = 1;      ///< that are compressed together
    bool deep = true;  ///< deep images may have it
    int value = 0;     ///< Imf::Compression
};

/// What zlib cannot beat (1032:1) with some room.
inline constexpr std::uint64_t kMostZlibRatio = 1100;

/// All of them; the first is the default of layered files, the second that of deep ones.
std::span<const ExrCompression> exrCompressions();

/// The one with this name; "" is the default of flat or deep images. Throws Error (kUsage) that
/// lists the choices if there is none for such images.
const ExrCompression& findExrCompression(std::string_view name, bool deep);

}  // namespace peeler
