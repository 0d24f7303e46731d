// SPDX-License-Identifier: Apache-2.0
// KTX 2.0 files (Khronos, "KTX File Format Specification", version 2.0): header and levels checked
// against the file size, and texel decoding (Khronos Data Format Specification 1.3).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// Texel formats after unpacking.
enum class Ktx2Texels : std::uint8_t { kEtc1s, kUastc, kRgb8, kRgba8 };

/// Level packing, numbered as in supercompressionScheme.
enum class Ktx2Packing : std::uint8_t { kNone, kBasisLz, kZstandard, kZlib };

struct Ktx2Level {
    std::span<const std::uint8_t> bytes;  ///< packed
    std::uint64_t offset = 0;             ///< in the file
    int width = 0, height = 0;            ///< pixels
    std::uint64_t unpacked_bytes = 0;     ///< BasisLZ: 8 per block, though it is never unpacked
};

/// A 2D texture. Its spans refer to the source bytes.
struct Ktx2Container {
    Ktx2Texels texels = Ktx2Texels::kRgba8;
    Ktx2Packing packing = Ktx2Packing::kNone;
    std::vector<Ktx2Level> levels;              ///< largest first, which has the picture's size
    std::span<const std::uint8_t> global_data;  ///< of BasisLZ
    std::uint64_t global_offset = 0;            ///< its position in the file
    bool second_plane = false;                  ///< an ETC1S level has two slices instead of one
    /// Sources of the picture's R, G, B and A: a decoded r, g, b, a, or 0, or 1. The second plane
    /// of ETC1S is decoded to a.
    std::array<char, 4> swizzle = {'r', 'g', 'b', 'a'};
    std::optional<bool> srgb;        ///< false: linear; none: another or not declared
    std::string codec;               ///< "KTX2, UASTC, Zstandard"
    std::vector<std::string> notes;  ///< violations of KHR_texture_basisu that are accepted
};

// ktx2_container.cpp.

/// Throws std::runtime_error with the problem and its byte position in the file, as all KTX2
/// functions do.
[[noreturn]] void failKtx2(const std::string& what, std::uint64_t at);

/// Reads everything but level data. Throws std::runtime_error if the file is not a 2D texture of
/// these texel formats or its alpha is premultiplied. Levels do not exceed the maximum ratio of
/// their packing, so memory for unpacked_bytes may be allocated; only BasisLZ can declare any
/// number of blocks in a few bytes.
Ktx2Container readKtx2(std::span<const std::uint8_t> file);

// basis_etc1s.cpp: ETC1S, the texels of BasisLZ, blocks of 4 × 4 with four colours each.

/// Decodes the largest level: R, G, B from its first slice; A is 255, or the G of a second slice
/// (whose three channels are the same). `rgba` has room for 4 bytes per pixel. Throws
/// std::runtime_error (failKtx2()) if blocks have invalid references or slices are truncated.
void decodeEtc1s(const Ktx2Container& file, std::uint8_t* rgba);

// uastc_block.cpp: UASTC, 8-bit texels in blocks of 4 × 4 ("Universal ASTC Compressed Texture
// Images").

inline constexpr std::size_t kUastcBytes = 16;  // per block

/// Returns the 16 texels of a block as RGBA, row-major. With `srgb`, colours between endpoints are
/// rounded as specified for sRGB textures; values stay encoded. An invalid block becomes the error
/// colour, (255, 0, 255, 255).
std::array<std::uint8_t, 64> uastcTexels(std::span<const std::uint8_t, kUastcBytes> block,
                                         bool srgb);

/// Decodes all blocks of a picture; their number must match its size. `rgba` has room for 4 bytes
/// per pixel.
void decodeUastc(std::span<const std::uint8_t> blocks, int width, int height, bool srgb,
                 std::uint8_t* rgba);

}  // namespace peeler
