// SPDX-License-Identifier: Apache-2.0
#include "core/raster/alpha_ranges.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>

namespace peeler {
namespace {

constexpr std::uint16_t kUnknown = 0x00FF;  // an empty range: least 255, greatest 0
constexpr int kMostTiles = 64;

}  // namespace

AlphaRanges::AlphaRanges(const Image& image)
    : image_(image),
      across_((image.width + kTile - 1) / kTile),
      down_((image.height + kTile - 1) / kTile),
      tiles_(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_), kUnknown) {}

std::uint16_t AlphaRanges::find(int tile_x, int tile_y) const {
    // The extremes of each byte of the tile's rows. The inner loop has a fixed length, so that
    // compilers vectorise it.
    using Bytes = std::array<std::uint8_t, std::size_t{4} * kTile>;
    Bytes texels{}, least, greatest{};
    least.fill(255);
    const int x0 = tile_x * kTile, y0 = tile_y * kTile;
    const auto bytes = static_cast<std::size_t>(4 * std::min(kTile, image_.width - x0));
    const auto stride = std::size_t{4} * static_cast<std::size_t>(image_.width);
    const std::uint8_t* row =
        &image_.rgba[static_cast<std::size_t>(y0) * stride + static_cast<std::size_t>(4 * x0)];
    for (int y = y0; y < std::min(y0 + kTile, image_.height); ++y, row += stride) {
        std::memcpy(texels.data(), row, bytes);
        for (std::size_t i = 0; i < texels.size(); ++i) {
            least[i] = std::min(least[i], texels[i]);
            greatest[i] = std::max(greatest[i], texels[i]);
        }
    }
    unsigned low = 255, high = 0;
    for (std::size_t i = 3; i < bytes; i += 4) {
        low = std::min<unsigned>(low, least[i]);
        high = std::max<unsigned>(high, greatest[i]);
    }
    return static_cast<std::uint16_t>(high << 8 | low);
}

AlphaRanges::Range AlphaRanges::of(const Window& texels) const {
    const int x0 = texels.x0 / kTile, x1 = (texels.x1 - 1) / kTile + 1;
    const int y0 = texels.y0 / kTile, y1 = (texels.y1 - 1) / kTile + 1;
    if ((x1 - x0) * (y1 - y0) > kMostTiles) return {};
    Range range{255, 0};
    for (int y = y0; y < y1; ++y) {
        for (int x = x0; x < x1; ++x) {
            const std::atomic_ref tile(
                tiles_[static_cast<std::size_t>(y) * static_cast<std::size_t>(across_) +
                       static_cast<std::size_t>(x)]);
            std::uint16_t known = tile.load(std::memory_order_relaxed);
            if (known == kUnknown) tile.store(known = find(x, y), std::memory_order_relaxed);
            range.least = std::min(range.least, static_cast<std::uint8_t>(known));
            range.greatest = std::max(range.greatest, static_cast<std::uint8_t>(known >> 8));
        }
    }
    return range;
}

}  // namespace peeler
