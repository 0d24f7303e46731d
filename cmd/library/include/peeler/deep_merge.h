// SPDX-License-Identifier: Apache-2.0
// Merging of deep samples.
#pragma once

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// The criterion by which neighbouring samples of a pixel are merged.
enum class DeepMerge {
    kOff,
    kExact,  ///< merges samples with equal Z
    kById,   ///< merges samples of one object and material that are near in Z and similar in alpha
    kByZ     ///< merges samples that are near in Z
};

/// The merge mode and its tolerances: Z in scene units, alpha in 0–1. The tolerances are measured
/// from the nearest sample of a merged group, so the depth range of a group is at most
/// `z_tolerance`.
struct DeepMergeSettings {
    DeepMerge mode = DeepMerge::kOff;
    float z_tolerance = 0;      ///< used by kById and kByZ
    float alpha_tolerance = 1;  ///< used by kById
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
