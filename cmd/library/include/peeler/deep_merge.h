// SPDX-License-Identifier: Apache-2.0
// Which samples of a deep image become one.
#pragma once

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

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

}  // namespace peeler::inline v0

#pragma GCC visibility pop
