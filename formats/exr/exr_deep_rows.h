// SPDX-License-Identifier: Apache-2.0
// Rows of fragment lists as packed deep chunks: the lists already are what a deep scan line holds.
#pragma once

#include <span>
#include <vector>

#include "core/image/layered_image.h"
#include "formats/exr/exr_band_writer.h"
#include "formats/exr/exr_chunks.h"

namespace peeler {

/// The channels of an array of fragments: `source` is ExrChannel::kColor or an index into
/// LayeredImage::extra.
std::vector<ExrChannel> deepChannels(const FragmentArray& array, int source);

/// Packs row y of an image: the pixels of `window`, which the image has, and of each fragment these
/// channels, sorted by name.
void packDeepRow(const LayeredImage& image, std::span<const ExrChannel> channels,
                 const Window& window, int y, ExrChunkPacker& packer, ExrDeepChunk& chunk);

}  // namespace peeler
