// SPDX-License-Identifier: Apache-2.0
// Channels and exact depths of fragments: what follows from Z, the primitive, and what shaders
// said.
#pragma once

#include <cstdint>
#include <span>

#include <peeler/channels.h>
#include <peeler/layered_image.h>
#include <peeler/view.h>
#include "core/scene/posed_scene.h"

namespace peeler {

/// The same scene at the next frame, and how it is seen then: what motion is measured against.
struct NextFrame {
    PosedScene posed;
    View view;
};

/// What the fragments of a band were made of.
struct FragmentSources {
    const PosedScene& posed;
    const View& view;
    const NextFrame* next = nullptr;        ///< none: nothing moves
    std::span<const std::uint32_t> keys;    ///< of each fragment
    std::span<const std::uint32_t> shaded;  ///< of each fragment: which record of `values`
    /// Records of channels.frag, shadedComponents() floats each; none without shaded channels.
    const float* values = nullptr;
};

/// Fills in the arrays of `channels` (in the order of the table), which are overwritten, for the
/// fragments of `image`.
///
/// Position and distance follow from Z and the centre of the pixel (or its `View::sample`), all
/// others that no shader yields from the primitive, in double precision:
/// - Barycentric weights are those of the second and third corner in the order in which GL draws
///   the primitive (of a line the second alone, of a point none), where the pixel's ray meets it.
///   The rasteriser snaps corners, so a ray can miss by a fraction of a pixel; then it is the
///   nearest point of an edge or so: weights are clamped to the primitive.
/// - Motion is how far that point's picture moves to the next frame, 0 if it is behind the camera.
/// - Triangles in id.primitive are counted through all primitives of the mesh.
/// - Lines and points face the camera: their geometric normal is against the ray.
///
/// Rows are done in parallel; the result does not depend on how.
void fillChannels(const FragmentSources& sources, std::span<const Channel> channels,
                  const LayeredImage& image, std::span<FragmentArray> arrays);

/// Finds the Z of every fragment anew, in double precision from its primitive and the pixel's ray,
/// rounds it to the 32 bits of the image, and sorts each pixel by what it was before rounding, then
/// by key: the fragments that depth could not tell apart come in their true order. A ray that
/// misses its primitive (WorldElement::weightsAt) gets the Z of the nearest point of it. `keys` and
/// `shaded` are those of `sources`, of every fragment, and are sorted along; the image has no
/// colours. Then the arrays of `channels` are filled in as by fillChannels(). Returns the largest
/// change of Z, scene units. Rows are done in parallel; the result does not depend on how.
double refineHits(const FragmentSources& sources, std::span<const Channel> channels,
                  LayeredImage& image, std::span<std::uint32_t> keys,
                  std::span<std::uint32_t> shaded, std::span<FragmentArray> arrays);

}  // namespace peeler
