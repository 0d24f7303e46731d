// SPDX-License-Identifier: Apache-2.0
// Cryptomatte: which objects and materials a pixel of the composite shows, and how much of each.
//
// Friedman & Jones, "Fully Automatic ID Mattes with Support for Motion Blur and Transparency",
// SIGGRAPH 2015 posters; Cryptomatte Specification 1.4 (github.com/Psyop/Cryptomatte).
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include <peeler/scene.h>

namespace peeler {

/// MurmurHash3_32 (seed 0) of a name's bytes, changed so that its bits are those of a normal float:
/// where the exponent is all zeros or all ones, its lowest bit is flipped (the specification's
/// uint32_to_float32).
std::uint32_t cryptomatteHash(const std::string& name);

/// A hash as eight hexadecimal digits, as manifests have it.
std::string cryptomatteHex(std::uint32_t hash);

/// What Cryptomatte calls a layer: a channel of ids, and the names that they stand for.
struct CryptomatteLayer {
    std::string name;                ///< "CryptoObject"
    std::string id_channel;          ///< "id.object"
    std::vector<std::string> names;  ///< by id − 1
};
/// The layers that a file has: objects and materials.
std::vector<CryptomatteLayer> cryptomatteLayers(const IdNames& names);

/// The metadata of a layer, as names and texts of attributes.
std::vector<std::pair<std::string, std::string>> cryptomatteAttributes(
    const CryptomatteLayer& layer);

inline constexpr std::size_t kCryptomatteRanks = 6;  ///< names a pixel can show, most first

/// An array of kCryptomatteRanks pairs (hash as float, coverage), named "CryptoObject00.R" and so
/// on, still without pixels.
FragmentArray cryptomatteArray(const CryptomatteLayer& layer);

/// Appends cryptomatteArray() with its pixels to the extra arrays of `composite`. A name covers a
/// pixel by what its fragments add to the composite's alpha: Σ a·Π(1 − a of the fragments in
/// front). Names of one hash count as one. Throws Error (kInternal) if the image lacks the channel
/// of ids.
void appendCryptomatte(const LayeredImage& image, const CryptomatteLayer& layer,
                       CompositeImage& composite);

}  // namespace peeler
