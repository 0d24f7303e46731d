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

/// The scene and the view at the next frame: the reference for motion.
struct NextFrame {
    PosedScene posed;
    View view;
};

/// The sources of a band's fragments.
struct FragmentSources {
    const PosedScene& posed;
    const View& view;
    const NextFrame* next = nullptr;        ///< null: nothing moves
    std::span<const std::uint32_t> keys;    ///< the draw-order key of each fragment
    std::span<const std::uint32_t> shaded;  ///< the index of each fragment's record in `values`
    /// Records of channels.frag, shadedComponents() floats each; null without shaded channels.
    const float* values = nullptr;
};

/// Fills the arrays of `channels` (in the order of the table) for the fragments of `image`;
/// overwrites them.
///
/// Position and distance are computed from Z and the centre of the pixel (or its `View::sample`);
/// the other channels, unless a shader outputs them, are computed from the primitive, in double
/// precision:
/// - Barycentric weights are those of the second and third corner (lines have only the second,
///   points none), in the order in which GL draws the primitive, at the point where the pixel's ray
///   meets it. The rasteriser snaps corners, so a ray can miss the primitive by a fraction of a
///   pixel; then the weights are clamped, which gives roughly the nearest point of an edge.
/// - Motion is the displacement of that point until the next frame, in pixels; 0 if the point is
///   behind the camera in either frame.
/// - Triangles in id.primitive are numbered across all primitives of the mesh.
/// - Lines and points face the camera: their geometric normal points against the ray.
///
/// Rows are processed in parallel; the result does not depend on the order.
void fillChannels(const FragmentSources& sources, std::span<const Channel> channels,
                  const LayeredImage& image, std::span<FragmentArray> arrays);

/// Recomputes the Z of every fragment in double precision from its primitive and the pixel's ray,
/// rounds it to the 32 bits of the image, and sorts each pixel by the value before rounding, then
/// by key: fragments with equal depths come in their true order. A ray that misses its primitive
/// (WorldElement::weightsAt) gets the Z of the primitive's nearest point. `keys` and `shaded` are
/// the arrays of `sources`, and are reordered with the fragments. The image must have no colours.
/// Then fills the arrays of `channels` like fillChannels(). Returns the largest change of Z, in
/// scene units. Rows are processed in parallel; the result does not depend on the order.
double refineHits(const FragmentSources& sources, std::span<const Channel> channels,
                  LayeredImage& image, std::span<std::uint32_t> keys,
                  std::span<std::uint32_t> shaded, std::span<FragmentArray> arrays);

}  // namespace peeler
