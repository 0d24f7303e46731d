// SPDX-License-Identifier: Apache-2.0
// Rows of images in chunk order: layers and composites channel by channel as flat scan lines, and
// fragment lists as deep scan lines. Also the rows of a band that the next band's chunks need.
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

/// Finds, for each pixel of a row that starts at (x0, y), the index of its k-th fragment, or
/// kNoFragment. Returns the number of fragments found.
std::size_t findExrFragments(const LayeredImage& image, std::uint32_t k, int x0, int y,
                             std::span<std::uint32_t> row);

/// Writes channels of the fragments in `row`, as found by findExrFragments(), without converting
/// them. For a pixel without a fragment, Z is +inf and every other channel is 0. Returns the end of
/// the output.
std::byte* gatherExrLayer(const LayeredImage& image, std::span<const ExrChannel> channels,
                          std::span<const std::uint32_t> row, std::byte* out);

/// Writes channels like gatherExrLayer(), but for `count` pixels of a composite, from pixel `first`
/// on.
std::byte* gatherExrComposite(const CompositeImage& image, std::span<const ExrChannel> channels,
                              std::size_t first, std::size_t count, std::byte* out);

/// Returns the channels of a fragment array. `source` is ExrChannel::kColor or an index into
/// LayeredImage::extra.
std::vector<ExrChannel> deepChannels(const FragmentArray& array, int source);

/// Packs row y of `window`, which lies inside the image: for each fragment, the values of
/// `channels`, which must be sorted by name.
void packDeepRow(const LayeredImage& image, std::span<const ExrChannel> channels,
                 const Window& window, int y, ExrChunkPacker& packer, ExrDeepChunk& chunk);

/// Returns an image without rows, with the width and arrays of `like`. The first row to be appended
/// is `y`.
LayeredImage emptyImage(const LayeredImage& like, int y);

/// Appends the rows [y0, y1) of `from` below those of `to`, which has the same width and
/// arrays.
void appendRows(const LayeredImage& from, int y0, int y1, LayeredImage& to);

/// Returns row `y` and all rows below it as one image. The rows are those of `upper`, then those of
/// `lower`, which begins directly below the last row of `upper`. Both images have the same width
/// and arrays.
LayeredImage rowsFrom(int y, const LayeredImage& upper, const LayeredImage& lower);

}  // namespace peeler
