// SPDX-License-Identifier: Apache-2.0
// Thinning of deep images: few samples per pixel, with a bound on the error at every depth.
#pragma once

#include <cstdint>

#include <peeler/deep_merge.h>
#include <peeler/layered_image.h>

namespace peeler {

/// The memory that thinDeepSamples() needs per sample of the rows, in addition to `out`.
inline constexpr std::size_t kThinSampleBytes = 40;

/// The outcome of thinning.
struct DeepThinning {
    std::uint64_t before = 0, after = 0;  ///< samples
    double largest_error = 0;             ///< as measured from the stored values
};

/// Copies the rows [y0, y1) of `image` with fewer samples, so that largestDifference() from the
/// original is at most `settings.error` in every pixel, as measured from the rounded values. Adds
/// to `sum`. Overwrites `out`.
///
/// A pixel of point samples is a step function of depth with six components (DeepState). A run of
/// its states can be one state of the result if in every component their range is at most twice the
/// bound; the result then takes the middle. Runs found greedily from the front are the fewest: if a
/// run is feasible, each part of it is (for one component: Imai & Iri 1986; the argument holds for
/// any number). The first run begins at the state (0, 1), the last ends exactly opaque if the
/// original does. Any such sequence is a list of samples: αᵢ = 1 − Tᵢ / Tᵢ₋₁, cᵢ = (Cᵢ − Cᵢ₋₁) /
/// Tᵢ₋₁, where Cᵢ₋₁ and Tᵢ₋₁ are those of the samples as rounded. So the number of samples is the
/// least for point samples, except where rounding ends a run early.
///
/// With volumes, the walk from the front takes the point or the volume that reaches farthest. A
/// volume is fitted to all breakpoints in its range, then checked at every depth. The number of
/// samples is small, not the least.
///
/// With `keep_ids`, a sample composites consecutive samples of one object and material. Behind it
/// the state is the original's, except for rounding. Such samples are the fewest with exact states
/// between them. Pixels with volumes are not changed.
///
/// Z, ids and other channels are those of the original sample at which the new sample begins.
/// Pixels that would not become smaller are copied bit for bit, and so are those with values
/// without meaning (DeepCurve::read). To leave room for the rounding of readers that accumulate in
/// 32-bit float, the bound of a pixel with n samples is `settings.error` − 2n · 2⁻²⁴, but at least
/// half. Throws Error (kUsage) if ids are needed and the image has no channel id.object.
void thinDeepSamples(const LayeredImage& image, int y0, int y1, const DeepMergeSettings& settings,
                     LayeredImage& out, DeepThinning& sum);

}  // namespace peeler
