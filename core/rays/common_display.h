// SPDX-License-Identifier: Apache-2.0
// Bundles of different sizes as parts of one file.
#pragma once

#include <span>
#include <vector>

#include "core/rays/bundle.h"

namespace peeler {

/// The views of the bundles with the same rays, but with display windows that are all of one size,
/// as OpenEXR wants it of the parts of a file: the crop of a smaller one lies in the middle. Half a
/// pixel that is left over moves the camera of a parallel bundle. Throws Error (kUsage) for pinhole
/// bundles that would need that.
std::vector<View> withCommonDisplay(std::span<const Bundle> bundles);

}  // namespace peeler
