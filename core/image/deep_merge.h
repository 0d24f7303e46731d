// SPDX-License-Identifier: Apache-2.0
// Fewer samples in a deep image, with the same composite.
#pragma once

#include "core/image/layered_image.h"

namespace peeler {

/// Which neighbours in a pixel's list become one sample.
enum class DeepMerge {
    kOff,
    kExact,  ///< those at the very same Z
    kById,   ///< those of one object and material, near in Z and alike in alpha
    kByZ     ///< those near in Z, whatever they are of
};

/// How much may differ from the nearest sample of a group: Z in scene units, alpha in 0–1. A group
/// is never deeper than `z_tolerance`: near is measured from its first sample, not from the last.
struct DeepMergeSettings {
    DeepMerge mode = DeepMerge::kOff;
    float z_tolerance = 0;      ///< by-id, by-z
    float alpha_tolerance = 1;  ///< by-id
};

/// The rows [y0, y1) of `image` with every run of successive samples that belong together replaced
/// by one. Its colour is the run composited front to back in 32-bit float, rounded once to the
/// type of the colours: "over" is associative (Porter & Duff 1984), so the pixel's composite stays
/// what it was within that rounding. Its Z and its other channels are those of the run's nearest
/// sample. Runs of one are copied bit for bit. `out` is overwritten. Throws Error (kUsage) if ids
/// are needed and `image` has no channels id.object and id.material.
void mergeDeepSamples(const LayeredImage& image, int y0, int y1, const DeepMergeSettings& settings,
                      LayeredImage& out);

}  // namespace peeler
