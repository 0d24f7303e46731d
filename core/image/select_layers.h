// SPDX-License-Identifier: Apache-2.0
// Some layers of a picture that has more.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/image/layered_image.h"

namespace peeler {

/// Which layers count: any of the nearest `nearest` ones (0 = all) that `listed` holds (empty =
/// all).
struct LayerSelection {
    std::uint32_t nearest = 0;
    std::vector<bool> listed{};  ///< by layer; those beyond its end are not in it

    bool all() const { return nearest == 0 && listed.empty(); }
    bool holds(std::size_t layer) const {
        return (nearest == 0 || layer < nearest) &&
               (listed.empty() || (layer < listed.size() && listed[layer]));
    }
};

/// Forgets the fragments of all other layers, in place; what is kept moves up in its pixel's list.
/// Every array of `image` follows.
void keepLayers(LayeredImage& image, const LayerSelection& selection);

/// One layer as an image of at most one fragment a pixel. `out` is overwritten; its storage is
/// reused.
void singleLayer(const LayeredImage& image, std::uint32_t layer, LayeredImage& out);

/// Appends an array "layer" (uint): the index of each fragment in its pixel's list.
void addLayerIndices(LayeredImage& image);

}  // namespace peeler
