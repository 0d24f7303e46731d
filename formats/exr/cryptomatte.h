// SPDX-License-Identifier: Apache-2.0
// Cryptomatte: the objects and materials in each pixel of the composite, with their coverage.
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

/// Returns the MurmurHash3_32 (seed 0) of a name's bytes, changed so that its bits are those of a
/// normal float: if the exponent is all zeros or all ones, its lowest bit is flipped (the
/// specification's uint32_to_float32).
std::uint32_t cryptomatteHash(const std::string& name);

/// Returns a hash as eight hexadecimal digits, as in manifests.
std::string cryptomatteHex(std::uint32_t hash);

/// A Cryptomatte layer: a channel of ids, and their names.
struct CryptomatteLayer {
    std::string name;                ///< "CryptoObject"
    std::string id_channel;          ///< "id.object"
    std::vector<std::string> names;  ///< by id − 1
};
/// Returns the layers of a file: objects and materials.
std::vector<CryptomatteLayer> cryptomatteLayers(const IdNames& names);

/// Returns a layer's metadata as names and texts of attributes.
std::vector<std::pair<std::string, std::string>> cryptomatteAttributes(
    const CryptomatteLayer& layer);

inline constexpr std::size_t kCryptomatteRanks = 6;  ///< names per pixel, by falling coverage

/// Returns an array of kCryptomatteRanks pairs (hash as float, coverage), named "CryptoObject00.R"
/// and so on, without pixels.
FragmentArray cryptomatteArray(const CryptomatteLayer& layer);

/// Appends cryptomatteArray() with its pixels to the extra arrays of `composite`. A name's coverage
/// is its fragments' contribution to the composite's alpha: Σ a·Π(1 − a of the fragments in front).
/// Names with the same hash count as one. Throws Error (kInternal) if the image lacks the channel
/// of ids.
void appendCryptomatte(const LayeredImage& image, const CryptomatteLayer& layer,
                       CompositeImage& composite);

}  // namespace peeler
