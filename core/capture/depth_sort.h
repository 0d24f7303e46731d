// SPDX-License-Identifier: Apache-2.0
// From captured fragments in any order to depth-sorted lists.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/image/composite.h"
#include "core/image/layered_image.h"
#include "core/scene/view.h"

namespace peeler {

/// A band as it comes out of the capture: pixel p owns the fragments [first[p], first[p + 1]), each
/// of `stride` words: buffer depth, primitive (or what orders the pixel's fragments alike,
/// LayerArea::keys), and a colour of 0, 2 or 4 words (shaders/stored_fragments.glsl).
struct CapturedFragments {
    std::span<const std::uint32_t> first;  ///< pixels + 1 entries
    const std::uint32_t* words = nullptr;
    std::size_t stride = 2;

    std::uint32_t primitive(std::size_t fragment) const { return words[fragment * stride + 1]; }
};

/// Sorts every pixel's list by (depth, primitive), keeps the nearest `max_layers` (0 = all), turns
/// buffer depth into camera Z and writes the result to `out`, whose window and colour type are set
/// and whose storage is reused; extra arrays are left alone. `sources`, if given, becomes the index
/// that each fragment of `out` has in the captured arrays. Rows are done in parallel; the result
/// does not depend on how.
void depthSort(const CapturedFragments& captured, const Projection& projection,
               std::uint32_t max_layers, LayeredImage& out,
               std::vector<std::uint32_t>* sources = nullptr);

/// What compositeNearest() makes of the lists that depthSort() would give with colours of this
/// type, bit for bit, without storing them. `out`, whose window is set, is overwritten.
void depthSortComposite(const CapturedFragments& captured, const Projection& projection,
                        std::uint32_t layers, Tail tail, PixelType color, CompositeImage& out);

}  // namespace peeler
