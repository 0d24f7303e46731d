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

#include "core/image/composite.h"
#include "core/image/layered_image.h"
#include "core/scene/scene.h"

namespace peeler {

/// MurmurHash3_32 (seed 0) of a name's bytes, so that its bits are those of a normal float: where
/// the exponent is all zeros or ones its lowest bit is turned (uint32_to_float32).
std::uint32_t cryptomatteHash(const std::string& name);

/// Eight digits, as manifests have it.
std::string cryptomatteHex(std::uint32_t hash);

/// Which names' ids are matted: a row of each file's metadata.
struct CryptomatteLayer {
    std::string name;                ///< "CryptoObject"
    std::string id_channel;          ///< "id.object"
    std::vector<std::string> names;  ///< by id − 1
};
std::vector<CryptomatteLayer> cryptomatteLayers(const IdNames& names);

/// The metadata of a layer, attribute by attribute.
std::vector<std::pair<std::string, std::string>> cryptomatteAttributes(
    const CryptomatteLayer& layer);

inline constexpr std::size_t kCryptomatteRanks = 6;  ///< names a pixel can show, most first

/// kCryptomatteRanks pairs (hash as float, coverage), "CryptoObject00.R" and so on, still without
/// pixels.
FragmentArray cryptomatteArray(const CryptomatteLayer& layer);

/// Appends that array to the extra ones of `composite`. A name covers a pixel by what its fragments
/// add to the composite's alpha: Σ a·Π(1 − a of those in front). Names of one hash count as one.
/// Throws Error (kInternal) without the channel.
void appendCryptomatte(const LayeredImage& image, const CryptomatteLayer& layer,
                       CompositeImage& composite);

}  // namespace peeler
