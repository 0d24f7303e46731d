// SPDX-License-Identifier: Apache-2.0
// Fragment channels and exact depths, computed from Z, the primitive and shader output.
#pragma once

#include <cstdint>
#include <span>

#include <peeler/channels.h>
#include <peeler/layered_image.h>
#include <peeler/view.h>
#include "core/scene/posed_scene.h"

namespace peeler {

/// The scene and the view at the next frame, which motion is measured against.
struct NextFrame {
    PosedScene posed;
    View view;
};

/// The inputs for a band's fragments.
struct FragmentSources {
    const PosedScene& posed;
    const View& view;
    const NextFrame* next = nullptr;        ///< null if nothing moves
    std::span<const std::uint32_t> keys;    ///< the draw-order key of each fragment
    std::span<const std::uint32_t> shaded;  ///< the index of each fragment's record in `values`
    /// Records of channels.frag, shadedComponents() floats each; null if no channels are shaded.
    const float* values = nullptr;
};

/// Fills the arrays of `channels` (in the order of the channel table) for the fragments of `image`.
/// Overwrites the arrays.
///
/// Position and distance are computed from Z and the pixel's sample position (`View::sample`, by
/// default the centre). Channels that a shader outputs are copied. All others are computed from the
/// primitive, in double precision:
/// - Barycentric weights are the weights of the second and third corner at the point where the
///   pixel's ray meets the primitive; lines have only the second, points neither. Corners are in
///   the order in which GL draws the primitive. The rasteriser snaps corners, so a ray can miss the
///   primitive by a fraction of a pixel. Then the weights are clamped, which gives approximately
///   the nearest point of an edge.
/// - Motion is the displacement of this point until the next frame, in pixels; 0 if the point is
///   behind the camera in either frame.
/// - id.primitive numbers triangles across all primitives of the mesh.
/// - Lines and points face the camera: their geometric normal points against the ray. That of
///   Gaussian splats is 0.
///
/// Rows are processed in parallel; the result does not depend on their order.
void fillChannels(const FragmentSources& sources, std::span<const Channel> channels,
                  const LayeredImage& image, std::span<FragmentArray> arrays);

/// Recomputes the Z of every fragment in double precision from its primitive and the pixel's ray,
/// and rounds it to 32 bits. Sorts each pixel's fragments by unrounded Z, then by key, so that
/// fragments with equal rounded depths are in their true order. A ray that misses its primitive
/// (WorldElement::weightsAt) gets the Z of the primitive's nearest point. `keys` and `shaded` are
/// the arrays of `sources`, and are reordered with the fragments. The image must have no colours.
/// Then fills the arrays of `channels` like fillChannels(). Returns the largest change of Z, in
/// scene units. Rows are processed in parallel; the result does not depend on their order.
double refineHits(const FragmentSources& sources, std::span<const Channel> channels,
                  LayeredImage& image, std::span<std::uint32_t> keys,
                  std::span<std::uint32_t> shaded, std::span<FragmentArray> arrays);

}  // namespace peeler
