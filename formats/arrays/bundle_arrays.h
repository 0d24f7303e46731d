// SPDX-License-Identifier: Apache-2.0
// Arrays that describe bundles of rays. The rays through a picture's pixels are one such bundle.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <peeler/bundle.h>
#include "formats/arrays/table_writers.h"

namespace peeler {

/// Returns the arrays of b bundles: bundle_origin, bundle_direction, bundle_right, bundle_up (b,
/// 3), bundle_size (b, 2), double; bundle_resolution (b, 2) and bundle_window (b, 4: x, y, width,
/// height), int64; bundle_perspective (b, uint8): 0 parallel, 1 a pinhole, 2 a lens, whose
/// bundle_size is NaN, 3 a moving camera or a list of rays, for which all but the resolution and
/// the window is NaN. With (w, h) = bundle_resolution, pixel (i, j) has the point p = origin + ((i
/// + ½) / w − ½) · size[0] · right − ((j + ½) / h − ½) · size[1] · up. A parallel ray starts at p
/// and has the direction `direction`; a pinhole's ray starts at `origin` and passes through p +
/// direction.
std::vector<NamedArray> bundleArrays(std::size_t bundles);

/// Returns the texts of a file with these bundles: `output_hash` and, if a bundle has a lens,
/// `bundle_lens`: a JSON list with an entry per bundle, lensJson() or null.
ArrayTexts bundleTexts(std::span<const Bundle> bundles, const std::string& output_hash);

/// Writes bundles to the arrays of bundleArrays(); `first` is the index of the first of these
/// arrays. Unless `camera_known`, origin, direction, right, up and size are NaN.
void writeBundles(ArrayWriter& writer, std::size_t first, std::span<const Bundle> bundles,
                  bool camera_known = true);

}  // namespace peeler
