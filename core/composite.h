// SPDX-License-Identifier: Apache-2.0
// Compositing of captured fragments on the CPU: the reference for every method.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/layered_image.h"

namespace peeler {

/// A flattened band: premultiplied linear RGBA in 32-bit float, and the camera Z of each pixel's
/// first fragment (+inf where there is none). Row-major inside `window`.
struct CompositeImage {
    Window window;
    std::vector<std::array<float, 4>> rgba;
    std::vector<float> z;
};

/// Front to back "over" of premultiplied colours (Porter & Duff 1984): C += (1 − A)·c, A += (1 −
/// A)·a, in 32-bit float, in list order. `background` (premultiplied) goes last; all zero adds
/// nothing. Only the first `limit` fragments of a list count. `out` is overwritten; its storage is
/// reused.
void compositeOver(const LayeredImage& image, const std::array<float, 4>& background,
                   CompositeImage& out,
                   std::uint32_t limit = std::numeric_limits<std::uint32_t>::max());

/// The colour of one fragment.
std::array<float, 4> colorOf(const LayeredImage& image, std::size_t fragment);

}  // namespace peeler
