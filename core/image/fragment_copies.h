// SPDX-License-Identifier: Apache-2.0
// Copies of fragments, with all their channels, from one image to another.
#pragma once

#include <cstddef>

#include <peeler/layered_image.h>

namespace peeler {

/// Gives `out` the channels of `like`, and room for that number of fragments. Keeps the window and
/// the offsets.
void resizeFragments(const LayeredImage& like, std::size_t fragments, LayeredImage& out);

/// Copies successive fragments. The images have the same channels.
void copyFragments(const LayeredImage& image, std::size_t source, LayeredImage& out,
                   std::size_t target, std::size_t count);

}  // namespace peeler
