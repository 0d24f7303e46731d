// SPDX-License-Identifier: Apache-2.0
// The depth halfway between the two nearest surfaces.
#pragma once

#include <span>

#include "core/image/layered_image.h"
#include "core/scene/view.h"

namespace peeler {

/// Per pixel the mean of the two smallest distinct Z (Woo, "The Shadow Depth Map Revisited",
/// Graphics Gems III, 1992), in scene units; +inf where there is no second one. Two depths are
/// distinct if they differ by more than the rounding of rasterised depths (2^-18 of Z, or of the
/// depth range of an orthographic view): surfaces that coincide but are triangulated differently
/// must not get the midpoint between them, which would lie on both.
/// `out` has a value for each pixel of the window.
void midpoints(const LayeredImage& image, const Projection& projection, std::span<float> out);

}  // namespace peeler
