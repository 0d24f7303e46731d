// SPDX-License-Identifier: Apache-2.0
// Rows of images in chunk order: layers and composites channel by channel, as flat scan lines, and
// fragment lists as deep scan lines. Carries over the last rows of a band that the next band's
// chunks need.
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

/// Finds the index of the k-th fragment of each pixel of a row starting at (x0, y), kNoFragment
/// where missing. Returns their number.
std::size_t findExrFragments(const LayeredImage& image, std::uint32_t k, int x0, int y,
                             std::span<std::uint32_t> row);

/// Writes the channels of the fragments in `row`, as found by findExrFragments(), unconverted; a
/// pixel without a fragment is 0 in each channel but Z, which is +inf. Returns the end of the
/// output.
std::byte* gatherExrLayer(const LayeredImage& image, std::span<const ExrChannel> channels,
                          std::span<const std::uint32_t> row, std::byte* out);

/// Writes `count` pixels of a composite in the same way, from the pixel `first` on.
std::byte* gatherExrComposite(const CompositeImage& image, std::span<const ExrChannel> channels,
                              std::size_t first, std::size_t count, std::byte* out);

/// Returns the channels of a fragment array: `source` is ExrChannel::kColor or an index into
/// LayeredImage::extra.
std::vector<ExrChannel> deepChannels(const FragmentArray& array, int source);

/// Packs row y of an image: the pixels of `window`, which lies in the image, with these channels,
/// sorted by name, of each fragment.
void packDeepRow(const LayeredImage& image, std::span<const ExrChannel> channels,
                 const Window& window, int y, ExrChunkPacker& packer, ExrDeepChunk& chunk);

/// Returns an image without rows, with the width and arrays of `like`; its next row is `y`.
LayeredImage emptyImage(const LayeredImage& like, int y);

/// Returns the rows from `y` on of two images of the same width and arrays, the second below the
/// first.
LayeredImage rowsFrom(int y, const LayeredImage& upper, const LayeredImage& lower);

}  // namespace peeler
