// SPDX-License-Identifier: Apache-2.0
// How far away what a picture is about is.
#pragma once

#include <optional>

#include "core/image/layered_image.h"
#include "core/scene/view.h"

namespace peeler {

/// The median Z of the first fragments in the middle ninth of the picture, or of all if there is
/// none; nothing where there is not a single fragment. Scene units.
std::optional<double> medianDepth(const LayeredImage& image, const View& view);

}  // namespace peeler
