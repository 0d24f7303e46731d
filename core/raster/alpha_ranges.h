// SPDX-License-Identifier: Apache-2.0
// The ranges of alpha in parts of an image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <peeler/scene.h>
#include <peeler/view.h>

namespace peeler {

/// The least and the greatest alpha in windows of an image. Divides the image into tiles, whose
/// ranges are found on first use. Thread-safe.
class AlphaRanges {
  public:
    struct Range {
        std::uint8_t least = 0, greatest = 255;
    };

    /// `image` must outlive this object.
    explicit AlphaRanges(const Image& image);

    /// Returns a range that includes every alpha in a window of texels: the range of all tiles that
    /// the window touches, or 0 to 255 if these are many.
    Range of(const Window& texels) const;

  private:
    static constexpr int kTile = 16;

    std::uint16_t find(int tile_x, int tile_y) const;

    const Image& image_;
    int across_, down_;                         // number of tiles
    mutable std::vector<std::uint16_t> tiles_;  // 256 · greatest + least; kUnknown if not found yet
};

}  // namespace peeler
