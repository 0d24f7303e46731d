// SPDX-License-Identifier: Apache-2.0
// KTX 2.0 files (Khronos, "KTX File Format Specification", version 2.0): what one says of its
// picture, checked against the bytes that are there, and how its texels are decoded (Khronos Data
// Format Specification 1.3).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace peeler {

/// How texels are stored, once they are unpacked.
enum class Ktx2Texels : std::uint8_t { kEtc1s, kUastc, kRgb8, kRgba8 };

/// How levels are packed: the numbers of supercompressionScheme.
enum class Ktx2Packing : std::uint8_t { kNone, kBasisLz, kZstandard, kZlib };

struct Ktx2Level {
    std::span<const std::uint8_t> bytes;  ///< packed
    std::uint64_t offset = 0;             ///< of those in the file
    int width = 0, height = 0;            ///< pixels
    std::uint64_t unpacked_bytes = 0;     ///< 8 bytes a block of ETC1S, though BasisLZ makes none
};

/// A 2D texture. Its spans lie in the bytes that it was read from.
struct Ktx2Container {
    Ktx2Texels texels = Ktx2Texels::kRgba8;
    Ktx2Packing packing = Ktx2Packing::kNone;
    std::vector<Ktx2Level> levels;  ///< the largest one, which has the size of the picture, first
    std::span<const std::uint8_t> global_data;  ///< of BasisLZ
    std::uint64_t global_offset = 0;            ///< of that in the file
    bool second_plane = false;                  ///< a level of ETC1S has two slices, not one
    /// What R, G, B and A of the picture are: one of the decoded r, g, b, a, or 0, or 1. The second
    /// plane of ETC1S is decoded to a.
    std::array<char, 4> swizzle = {'r', 'g', 'b', 'a'};
    std::optional<bool> srgb;        ///< false: linear; none: neither, or the file does not say
    std::string codec;               ///< "KTX2, UASTC, Zstandard"
    std::vector<std::string> notes;  ///< what KHR_texture_basisu forbids, and is read all the same
};

// ktx2_container.cpp.

/// Throws std::runtime_error, as do all that read KTX2: what is wrong, and at which byte of the
/// file.
[[noreturn]] void failKtx2(const std::string& what, std::uint64_t at);

/// Reads all but the levels. Throws for whatever is no 2D texture of these texels, and for alpha
/// that is premultiplied. No level is packed by more than its packing can do, so memory for
/// unpacked_bytes may be allocated; it is BasisLZ alone that tells of any number of blocks in a
/// few bytes.
Ktx2Container readKtx2(std::span<const std::uint8_t> file);

// basis_etc1s.cpp: ETC1S, the texels of BasisLZ, blocks of 4 × 4 of which each has four colours.

/// Decodes the largest level: R, G, B of its first slice, and A, 255 unless there is a second one,
/// whose G it is (all three channels of that are the same). `rgba` has room for 4 bytes a pixel.
/// Throws (failKtx2()) where blocks refer to what is not there, and where slices are cut short.
void decodeEtc1s(const Ktx2Container& file, std::uint8_t* rgba);

// uastc_block.cpp: UASTC, texels of 8 bits in blocks of 4 × 4 ("Universal ASTC Compressed Texture
// Images").

inline constexpr std::size_t kUastcBytes = 16;  // of a block

/// The 16 texels of a block as RGBA, row by row. Where `srgb`, colours between endpoints are
/// rounded as the specification has it for textures that are sRGB; the numbers stay as they are
/// stored. A block that is none has the colour for that, (255, 0, 255, 255).
std::array<std::uint8_t, 64> uastcTexels(std::span<const std::uint8_t, kUastcBytes> block,
                                         bool srgb);

/// Decodes all blocks of a picture, which are as many as it needs. `rgba` has room for 4 bytes a
/// pixel.
void decodeUastc(std::span<const std::uint8_t> blocks, int width, int height, bool srgb,
                 std::uint8_t* rgba);

}  // namespace peeler
