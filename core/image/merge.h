// SPDX-License-Identifier: Apache-2.0
// What is merged: the tiles of one picture, its elements, and samples of a deep image.
#pragma once

#include <optional>
#include <span>
#include <string>

#include <peeler/deep_merge.h>
#include <peeler/layered_image.h>
#include <peeler/window.h>

namespace peeler {

// tiles.cpp.

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

/// The fragments of all elements, whatever windows they have, sorted by Z in every pixel of
/// `window`; those at the very same Z in the order of the elements. Each element is sorted already.
/// The arrays are those of `like`, and of every element that has fragments. `out` is overwritten;
/// its storage is reused. Throws Error (kMemory) for over 2^32 fragments.
void mergeByDepth(std::span<const LayeredImage> elements, const Window& window,
                  const LayeredImage& like, LayeredImage& out);

// deep_merge.cpp: fewer samples with the same composite.

/// In words, such as "by-z z 0.1"; "" if samples are not merged.
std::string deepMergeText(const DeepMergeSettings& settings);

/// The rows [y0, y1) of `image` with every run of successive samples that belong together replaced
/// by one. Its colour is the run composited front to back in 32-bit float, rounded once to the type
/// of the colours: "over" is associative (Porter & Duff 1984), so the pixel's composite stays what
/// it was within that rounding. Its Z and its other channels are those of the run's nearest sample.
/// Runs of one are copied bit for bit. `out` is overwritten. Throws Error (kUsage) if ids are
/// needed and `image` has no channels id.object and id.material.
void mergeDeepSamples(const LayeredImage& image, int y0, int y1, const DeepMergeSettings& settings,
                      LayeredImage& out);

}  // namespace peeler
