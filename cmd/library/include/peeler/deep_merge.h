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
    /// If not 0, thins the samples instead of `mode`, which must be kOff: at every depth of every
    /// pixel, transmittance changes by at most `error` (0–1), and accumulated premultiplied colour
    /// by at most `error` times the pixel's largest accumulated colour, or times 1 if it is less.
    double error = 0;
    /// With `error`: whether a sample never mixes objects or materials (id.object, id.material).
    bool keep_ids = false;

    bool merges() const { return mode != DeepMerge::kOff || error > 0; }
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
