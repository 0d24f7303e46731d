// SPDX-License-Identifier: Apache-2.0
// The rows at the end of a band that chunks of the next one still need.
#pragma once

#include "core/image/layered_image.h"

namespace peeler {

/// No rows yet, the first to come being `y`; the arrays of `like`.
LayeredImage emptyImage(const LayeredImage& like, int y);

/// The rows from `y` on of two images of the same width and arrays, the second below the first.
LayeredImage rowsFrom(int y, const LayeredImage& upper, const LayeredImage& lower);

}  // namespace peeler
