// SPDX-License-Identifier: Apache-2.0
// Merging of deep samples.
#pragma once

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// The criterion for merging neighbouring samples of a pixel.
enum class DeepMerge {
    kOff,
    kExact,  ///< equal Z
    kById,   ///< same object and material, near in Z, similar alpha
    kByZ     ///< near in Z
};

/// The merge mode and its tolerances: Z in scene units, alpha in 0–1. Both are measured from a
/// group's nearest sample, so a group is never deeper than `z_tolerance`.
struct DeepMergeSettings {
    DeepMerge mode = DeepMerge::kOff;
    float z_tolerance = 0;      ///< by-id, by-z
    float alpha_tolerance = 1;  ///< by-id
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
