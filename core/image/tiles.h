// SPDX-License-Identifier: Apache-2.0
// Tiles of one picture, and the picture put together from them.
#pragma once

#include <optional>
#include <span>

#include "core/base/window.h"
#include "core/image/layered_image.h"

namespace peeler {

/// A rectangle of `whole` that no tile covers, the topmost; none if they cover all of it.
std::optional<Window> findGap(std::span<const Window> tiles, const Window& whole);

/// Whether two of them share a pixel.
bool overlap(std::span<const Window> tiles);

/// The pixels of `window` from tiles that lie inside it; a pixel without a tile is empty. The
/// arrays are those of `like`, and of every tile that has fragments. Where tiles overlap their
/// fragments must be the same, bit for bit: else the first pixel that differs is returned, and
/// `out` is of no use. `out` is overwritten; its storage is reused.
std::optional<Window> joinTiles(std::span<const LayeredImage> tiles, const Window& window,
                                const LayeredImage& like, LayeredImage& out);

}  // namespace peeler
