// SPDX-License-Identifier: Apache-2.0
// Puts rows of images into the order of chunks: layers and composites channel after channel, as
// flat scan lines; fragment lists, which are what a deep scan line holds. Keeps the rows at the end
// of a band that chunks of the next one still need.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include "formats/exr/exr_band_writer.h"
#include "formats/exr/exr_chunks.h"

namespace peeler {

/// Finds the index of the k-th fragment of each pixel of a row from (x0, y) on, kNoFragment where
/// there is none. Returns how many there are.
std::size_t findExrFragments(const LayeredImage& image, std::uint32_t k, int x0, int y,
                             std::span<std::uint32_t> row);

/// Writes the channels of the fragments in `row`, which findExrFragments() has found, as they are;
/// a pixel without one is 0 in each channel but Z, which is +inf. Returns the end of what is
/// written.
std::byte* gatherExrLayer(const LayeredImage& image, std::span<const ExrChannel> channels,
                          std::span<const std::uint32_t> row, std::byte* out);

/// Likewise for `count` pixels of a composite from the pixel `first` on.
std::byte* gatherExrComposite(const CompositeImage& image, std::span<const ExrChannel> channels,
                              std::size_t first, std::size_t count, std::byte* out);

/// The channels of an array of fragments: `source` is ExrChannel::kColor or an index into
/// LayeredImage::extra.
std::vector<ExrChannel> deepChannels(const FragmentArray& array, int source);

/// Packs row y of an image: the pixels of `window`, which the image has, and of each fragment these
/// channels, sorted by name.
void packDeepRow(const LayeredImage& image, std::span<const ExrChannel> channels,
                 const Window& window, int y, ExrChunkPacker& packer, ExrDeepChunk& chunk);

/// An image without rows, as wide as `like` and with its arrays; the first row to come is `y`.
LayeredImage emptyImage(const LayeredImage& like, int y);

/// The rows from `y` on of two images of the same width and arrays, the second below the first.
LayeredImage rowsFrom(int y, const LayeredImage& upper, const LayeredImage& lower);

}  // namespace peeler
