// SPDX-License-Identifier: Apache-2.0
// Arrays that describe bundles of rays. The rays through a picture's pixels are one such bundle.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <peeler/bundle.h>
#include "formats/arrays/table_writers.h"

namespace peeler {

/// Returns the arrays of b bundles: bundle_origin, bundle_direction, bundle_right, bundle_up (b,
/// 3), bundle_size (b, 2), double; bundle_resolution (b, 2) and bundle_window (b, 4: x, y, width,
/// height), int64; bundle_perspective (b, uint8). With (w, h) = bundle_resolution, pixel (i, j) has
/// the point p = origin + ((i + ½) / w − ½) · size[0] · right − ((j + ½) / h − ½) · size[1] · up.
/// Without perspective, the pixel's ray starts at p and has the direction `direction`; with
/// perspective, the ray starts at `origin` and passes through p + direction.
std::vector<NamedArray> bundleArrays(std::size_t bundles);

/// Writes bundles to the arrays of bundleArrays(); `first` is the index of the first of these
/// arrays. Unless `camera_known`, origin, direction, right, up and size are NaN.
void writeBundles(ArrayWriter& writer, std::size_t first, std::span<const Bundle> bundles,
                  bool camera_known = true);

}  // namespace peeler
