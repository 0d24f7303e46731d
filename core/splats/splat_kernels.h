// SPDX-License-Identifier: Apache-2.0
// The fragments of splats in a tile of pixels, in variants for several processors. All variants
// have the same results, bit for bit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <peeler/window.h>
#include "core/splats/projected_splats.h"

namespace peeler {

/// The width and height of a tile. Tiles begin at multiples of it.
inline constexpr int kTile = 16;
inline constexpr std::size_t kTilePixels = std::size_t{kTile} * kTile;

/// A tile, and some of its splats, in order. Arrays of pixels have the tile's rows of kTile pixels
/// each, whether all are in the window or not.
struct SplatTile {
    const SplatPicture& picture;
    std::span<const std::uint32_t> splats;  ///< indices into SplatPicture::splats
    int x0 = 0, y0 = 0;                     ///< of the tile
    Window window;                          ///< the pixels to find
    float sample_x = 0, sample_y = 0;       ///< sample position in a pixel
    bool perspective = true;
    float ray_x[kTile]{}, ray_y[kTile]{};  ///< slopes of columns' and rows' rays, y down
    /// The lengths of (ray_x, ray_y, 1); only if splats are sorted by distance.
    float lengths[kTilePixels]{};
    /// Whether fragments are hidden that do not lie in front of these Z.
    bool hides = false;
    float hidden_from[kTilePixels]{};
};

/// Where to store the fragments of a tile.
struct SplatStore {
    std::uint32_t next[kTilePixels]{};  ///< index of each pixel's next fragment
    float* z = nullptr;
    std::uint32_t* keys = nullptr;
    std::byte* colors = nullptr;
    bool half = true;
    std::size_t components = 0;
};

/// The composite of a tile's pixels so far.
struct SplatBlend {
    float color[4][kTilePixels]{};     ///< red, green, blue, alpha
    float z[kTilePixels]{};            ///< of the nearest fragment; infinite = none
    std::int32_t left[kTilePixels]{};  ///< number of fragments that may still be blended
    bool half = true;                  ///< whether fragments are rounded to half floats
};

struct SplatKernels {
    /// Writes to `found` the indices, from `from` on, of splats whose boxes touch a window (x0, y0,
    /// x1, y1), at most `room`. Returns the index to continue from.
    std::size_t (*find)(const SplatBoxes& boxes, std::size_t from, const float (&window)[4],
                        std::uint32_t* found, std::size_t room, std::size_t& count);
    /// Adds the number of fragments to every pixel's count.
    void (*count)(const SplatTile& tile, std::uint32_t* counts);
    void (*capture)(const SplatTile& tile, SplatStore& store);
    /// Blends fragments behind the composite (over() of peeler/composite.h). Returns whether the
    /// composite is final: whether every pixel's alpha is 1, or its number of fragments reached.
    /// Where alpha is 1, every farther colour is multiplied by 1 − alpha = 0, so no bit of the sum
    /// can change.
    bool (*blend)(const SplatTile& tile, SplatBlend& blend);
};

/// Returns the fastest variant for this processor or, if `every_processor`, the portable one.
const SplatKernels& splatKernelsFor(bool every_processor = false);

}  // namespace peeler
