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

/// Returns the MurmurHash3_32 (seed 0) of a name's bytes, adjusted to the bits of a normal float:
/// if the exponent is all zeros or all ones, flips the exponent's lowest bit (uint32_to_float32 in
/// the specification).
std::uint32_t cryptomatteHash(const std::string& name);

/// Returns a hash as eight hexadecimal digits, as in manifests.
std::string cryptomatteHex(std::uint32_t hash);

/// A Cryptomatte layer: the channel of its ids, and their names.
struct CryptomatteLayer {
    std::string name;                     ///< such as "CryptoObject"
    std::string id_channel;               ///< such as "id.object"
    std::vector<std::string> names;       ///< name of each id, at index id − 1
    std::vector<std::uint32_t> hashes{};  ///< cryptomatteHash() of each name
};
/// Returns the Cryptomatte layers of a file: objects and materials.
std::vector<CryptomatteLayer> cryptomatteLayers(const IdNames& names);

/// Returns a layer's metadata: names and values of attributes.
std::vector<std::pair<std::string, std::string>> cryptomatteAttributes(
    const CryptomatteLayer& layer);

/// The maximum number of names stored per pixel, in order of falling coverage.
inline constexpr std::size_t kCryptomatteRanks = 6;

/// Returns an array, without pixels, of kCryptomatteRanks pairs (hash as float, coverage) per
/// pixel, with channels "CryptoObject00.R" and so on.
FragmentArray cryptomatteArray(const CryptomatteLayer& layer);

/// Appends cryptomatteArray(), with its pixels, to the extra arrays of `composite`, which has all
/// or some rows of the image. The coverage of a name is the contribution of its fragments to the
/// composite's alpha: Σ a·Π(1 − a of the fragments in front). Coverages of names with the same hash
/// are added. Throws Error (kInternal) if the image lacks the layer's channel of ids.
void appendCryptomatte(const LayeredImage& image, const CryptomatteLayer& layer,
                       CompositeImage& composite);

}  // namespace peeler
