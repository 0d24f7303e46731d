// SPDX-License-Identifier: Apache-2.0
// Where rays hit exactly: not as the rasteriser's grid and a float depth have it.
#pragma once

#include <cstdint>
#include <span>

#include "core/capture/surface_channels.h"
#include "core/image/layered_image.h"

namespace peeler {

/// Finds the Z of every fragment anew, in double precision from its primitive and the pixel's ray,
/// rounds it to the 32 bits of the image, and sorts each pixel by what it was before rounding, then
/// by key: the fragments that depth could not tell apart come in their true order. A ray that
/// misses its primitive (PlacedElement::weightsAt) gets the Z of the nearest point of it. `keys`
/// and `shaded` are those of `sources`, of every fragment, and are sorted along; the image has
/// neither colours nor extra arrays yet. Returns the largest change of Z, scene units. Rows are
/// done in parallel; the result does not depend on how.
double refineHits(const FragmentSources& sources, LayeredImage& image,
                  std::span<std::uint32_t> keys, std::span<std::uint32_t> shaded);

}  // namespace peeler
