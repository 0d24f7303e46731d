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

/// The same scene and its view at the next frame: the reference for motion.
struct NextFrame {
    PosedScene posed;
    View view;
};

/// The sources of a band's fragments.
struct FragmentSources {
    const PosedScene& posed;
    const View& view;
    const NextFrame* next = nullptr;        ///< null: nothing moves
    std::span<const std::uint32_t> keys;    ///< of each fragment: its draw-order key
    std::span<const std::uint32_t> shaded;  ///< of each fragment: its record in `values`
    /// Records of channels.frag, shadedComponents() floats each; null without shaded channels.
    const float* values = nullptr;
};

/// Fills the arrays of `channels` (in the order of the table) for the fragments of `image`;
/// overwrites them.
///
/// Position and distance are computed from Z and the centre of the pixel (or its `View::sample`);
/// all others that no shader outputs are computed from the primitive, in double precision:
/// - Barycentric weights are those of the second and third corner, in the order in which GL draws
///   the primitive (only the second of a line, none of a point), where the pixel's ray meets it.
///   The rasteriser snaps corners, so a ray can miss by a fraction of a pixel; then it is roughly
///   the nearest point of an edge: weights are clamped to the primitive.
/// - Motion is the pixel displacement of that point until the next frame, 0 if it is behind the
///   camera.
/// - Triangles in id.primitive are numbered across all primitives of the mesh.
/// - Lines and points face the camera: their geometric normal points against the ray.
///
/// Rows are processed in parallel; the result does not depend on the order.
void fillChannels(const FragmentSources& sources, std::span<const Channel> channels,
                  const LayeredImage& image, std::span<FragmentArray> arrays);

/// Recomputes the Z of every fragment in double precision from its primitive and the pixel's ray,
/// rounds it to the 32 bits of the image, and sorts each pixel by the value before rounding, then
/// by key: fragments with equal depths come in their true order. A ray that misses its primitive
/// (WorldElement::weightsAt) gets the Z of the nearest point of it. `keys` and `shaded` are those
/// of `sources`, for every fragment, and are sorted along; the image has no colours. Then fills the
/// arrays of `channels` like fillChannels(). Returns the largest change of Z, in scene units. Rows
/// are processed in parallel; the result does not depend on the order.
double refineHits(const FragmentSources& sources, std::span<const Channel> channels,
                  LayeredImage& image, std::span<std::uint32_t> keys,
                  std::span<std::uint32_t> shaded, std::span<FragmentArray> arrays);

}  // namespace peeler
