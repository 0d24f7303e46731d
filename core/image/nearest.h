// SPDX-License-Identifier: Apache-2.0
// The nearest layers of a picture that has more.
#pragma once

#include <cstdint>

#include "core/image/layered_image.h"

namespace peeler {

/// Keeps the first `limit` fragments of every pixel and forgets the rest, in place. Every array of
/// `image` follows.
void keepNearest(LayeredImage& image, std::uint32_t limit);

}  // namespace peeler
