// SPDX-License-Identifier: Apache-2.0
// KTX 2.0 files (Khronos, "KTX File Format Specification", version 2.0): a reader of the header and
// levels that checks them against the file size, and decoders of texels (Khronos Data Format
// Specification 1.3).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// The format of texels after unpacking.
enum class Ktx2Texels : std::uint8_t { kEtc1s, kUastc, kRgb8, kRgba8 };

/// The packing of levels. The values are those of supercompressionScheme.
enum class Ktx2Packing : std::uint8_t { kNone, kBasisLz, kZstandard, kZlib };

struct Ktx2Level {
    std::span<const std::uint8_t> bytes;  ///< packed bytes of the level
    std::uint64_t offset = 0;             ///< position of `bytes` in the file
    int width = 0, height = 0;            ///< size in pixels
    /// For BasisLZ, 8 bytes per block, although BasisLZ levels are not unpacked as a whole.
    std::uint64_t unpacked_bytes = 0;
};

/// A 2D texture. Its spans are views of the file's bytes.
struct Ktx2Container {
    Ktx2Texels texels = Ktx2Texels::kRgba8;
    Ktx2Packing packing = Ktx2Packing::kNone;
    /// From the largest level, which has the size of the picture, to the smallest.
    std::vector<Ktx2Level> levels;
    std::span<const std::uint8_t> global_data;  ///< used by BasisLZ only
    std::uint64_t global_offset = 0;            ///< position of global_data in the file
    /// Whether ETC1S levels have two slices instead of one.
    bool second_plane = false;
    /// The sources of the picture's R, G, B and A: a decoded channel r, g, b or a, or the constant
    /// 0 or 1. The second plane of ETC1S is decoded to a.
    std::array<char, 4> swizzle = {'r', 'g', 'b', 'a'};
    /// sRGB (true) or linear (false); no value if the file declares another transfer function or
    /// none.
    std::optional<bool> srgb;
    std::string codec;               ///< such as "KTX2, UASTC, Zstandard"
    std::vector<std::string> notes;  ///< accepted violations of KHR_texture_basisu, as clauses
};

// Defined in ktx2_container.cpp.

/// Throws std::runtime_error with the problem and its byte position in the file. All functions
/// below report errors in this way.
[[noreturn]] void failKtx2(const std::string& what, std::uint64_t at);

/// Reads everything except the data of the levels. Checks that no level unpacks to more than its
/// packing's maximum ratio allows, so that memory for unpacked_bytes may be allocated. BasisLZ has
/// no maximum ratio: a few bytes can declare any number of blocks. Throws std::runtime_error if the
/// file is not a 2D texture in one of these texel formats, or if its alpha is premultiplied.
Ktx2Container readKtx2(std::span<const std::uint8_t> file);

// Defined in basis_etc1s.cpp: ETC1S, the texels of BasisLZ, in blocks of 4 × 4 with four colours
// each.

/// Decodes the largest level. R, G, B come from the first slice. A is 255 or, with a second slice,
/// the slice's G (its three channels are equal). `rgba` must have room for 4 bytes per pixel.
/// Throws std::runtime_error (failKtx2()) if blocks have invalid references or slices are
/// truncated.
void decodeEtc1s(const Ktx2Container& file, std::uint8_t* rgba);

// Defined in uastc_block.cpp: UASTC, 8-bit texels in blocks of 4 × 4 ("Universal ASTC Compressed
// Texture Images").

inline constexpr std::size_t kUastcBytes = 16;  // bytes per block

/// Returns the 16 texels of a block as RGBA, row-major. If `srgb` is true, rounds colours between
/// endpoints as specified for sRGB textures; the values stay encoded. If the block is invalid, all
/// texels have the error colour (255, 0, 255, 255).
std::array<std::uint8_t, 64> uastcTexels(std::span<const std::uint8_t, kUastcBytes> block,
                                         bool srgb);

/// Decodes all blocks of a picture. The number of blocks must match the picture's size. `rgba` must
/// have room for 4 bytes per pixel.
void decodeUastc(std::span<const std::uint8_t> blocks, int width, int height, bool srgb,
                 std::uint8_t* rgba);

}  // namespace peeler
