// SPDX-License-Identifier: Apache-2.0
// From captured fragments in any order to depth-sorted lists.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/layered_image.h"
#include "core/view.h"

namespace peeler {

/// A band as it comes out of the capture: pixel p owns the fragments [first[p], first[p + 1]) of
/// the arrays.
struct CapturedFragments {
    std::span<const std::uint32_t> first;  ///< pixels + 1 entries
    const float* depth;                    ///< reversed Z: larger is nearer
    const std::uint32_t* primitive;        ///< draw order
    const void* color;                     ///< 8 or 16 bytes a fragment; null = none
};

/// Sorts every pixel's list by (depth, primitive), keeps the nearest `max_layers` (0 = all), turns
/// buffer depth into camera Z and writes the result to `out`, whose window and colour type are set
/// and whose storage is reused; extra arrays are left alone. `sources`, if given, becomes the index
/// that each fragment of `out` has in the captured arrays. Rows are done in parallel; the result
/// does not depend on how.
void gather(const CapturedFragments& captured, const Projection& projection,
            std::uint32_t max_layers, LayeredImage& out,
            std::vector<std::uint32_t>* sources = nullptr);

}  // namespace peeler
