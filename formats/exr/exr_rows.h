// SPDX-License-Identifier: Apache-2.0
// Rows of one layer, or of a composite, as flat scan lines hold them: channel after channel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/image/composite.h"
#include "core/image/layered_image.h"
#include "formats/exr/exr_band_writer.h"

namespace peeler {

/// The index of the k-th fragment of each pixel of a row from (x0, y) on, or a number that stands
/// for none. Returns how many there are.
std::size_t findExrFragments(const LayeredImage& image, std::uint32_t k, int x0, int y,
                             std::span<std::uint32_t> row);

/// Writes the channels of such a row, as they are; a pixel without the layer is 0 in each but Z,
/// which is +inf. Returns the end of what is written.
std::byte* gatherExrLayer(const LayeredImage& image, std::span<const ExrChannel> channels,
                          std::span<const std::uint32_t> row, std::byte* out);

/// The same of `count` pixels of a composite from the pixel `first` on.
std::byte* gatherExrComposite(const CompositeImage& image, std::span<const ExrChannel> channels,
                              std::size_t first, std::size_t count, std::byte* out);

}  // namespace peeler
