// SPDX-License-Identifier: Apache-2.0
// Merging: tiles of a picture, elements of a picture, and samples of a deep image.
#pragma once

#include <optional>
#include <span>
#include <string>

#include <peeler/deep_merge.h>
#include <peeler/layered_image.h>
#include <peeler/window.h>

namespace peeler {

// Defined in tiles.cpp.

/// Returns the topmost rectangle of `whole` that no tile covers; nullopt if the tiles cover
/// `whole`.
std::optional<Window> findGap(std::span<const Window> tiles, const Window& whole);

/// Whether any two tiles share a pixel.
bool overlap(std::span<const Window> tiles);

/// Joins the pixels of `window` from tiles inside it. A pixel without a tile is empty. The result
/// has the arrays of `like`; every tile with fragments must have the same arrays. If tiles overlap,
/// their fragments must be bit-identical. If they are not, returns the first pixel that differs,
/// and `out` is invalid. Overwrites `out` and reuses its storage.
std::optional<Window> joinTiles(std::span<const LayeredImage> tiles, const Window& window,
                                const LayeredImage& like, LayeredImage& out);

/// Merges the fragments of all elements, which may have any windows, by Z in every pixel of
/// `window`. Fragments with equal Z keep the order of the elements. Each element must already be
/// sorted. The result has the arrays of `like`; every element with fragments must have the same
/// arrays. Overwrites `out` and reuses its storage. Throws Error (kMemory) if there are more than
/// 2^32 fragments.
void mergeByDepth(std::span<const LayeredImage> elements, const Window& window,
                  const LayeredImage& like, LayeredImage& out);

// Defined in deep_merge.cpp: fewer samples with the same composite.

/// Returns the settings in words, such as "by-z z 0.1" or "error 0.001"; "" if samples are not
/// merged.
std::string deepMergeText(const DeepMergeSettings& settings);

/// Copies the rows [y0, y1) of `image`, merging each run of successive matching samples into one
/// sample. The colour of the merged sample is the composite of the run, front to back, in 32-bit
/// float, rounded once to the type of the colours. "Over" is associative (Porter & Duff 1984), so
/// the pixel's composite is unchanged except for rounding. Z and other channels are those of the
/// run's nearest sample. Single samples are copied bit for bit. Overwrites `out`. Throws Error
/// (kUsage) if ids are needed and `image` has no channels id.object and id.material.
void mergeDeepSamples(const LayeredImage& image, int y0, int y1, const DeepMergeSettings& settings,
                      LayeredImage& out);

}  // namespace peeler
