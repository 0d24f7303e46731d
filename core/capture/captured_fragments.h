// SPDX-License-Identifier: Apache-2.0
// From captured fragments in any order to depth-sorted lists with channels and exact depths: what
// follows from Z, from the primitive, and from what a shader said.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <peeler/channels.h>
#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include <peeler/view.h>
#include "core/scene/posed_scene.h"

namespace peeler {

// depth_sort.cpp.

/// A band as it comes out of the capture: pixel p owns the fragments [first[p], first[p + 1]), each
/// of `stride` words: buffer depth, primitive (or what orders the pixel's fragments alike,
/// LayerArea::keys), and a colour (shaders/stored_fragments.glsl).
struct CapturedFragments {
    std::span<const std::uint32_t> first;  ///< pixels + 1 entries
    const std::uint32_t* words = nullptr;
    std::size_t stride = 2;

    std::uint32_t primitive(std::size_t fragment) const { return words[fragment * stride + 1]; }
};

/// The nearest opaque fragments of a band, four words a pixel: depth (0 = there is none), key, and
/// a colour of halfs, which `colors`, if given, have as floats instead. They come behind a pixel's
/// list.
struct OpaqueFragments {
    const std::uint32_t* fragments = nullptr;  ///< of the top row; those below it come before it
    const std::uint32_t* colors = nullptr;     ///< likewise, four words a pixel

    static constexpr std::size_t kWords = 4;
};

/// Sorts every pixel's list by (depth, primitive), keeps the nearest `max_layers` (0 = all), turns
/// buffer depth into camera Z and writes the result to `out`, whose window, colour channels and
/// type are set and whose storage is reused; extra arrays are left alone. `sources`, if given,
/// becomes the index that each fragment of `out` has in the captured arrays. Rows are done in
/// parallel; the result does not depend on how.
void depthSort(const CapturedFragments& captured, const Projection& projection,
               std::uint32_t max_layers, LayeredImage& out,
               std::vector<std::uint32_t>* sources = nullptr);

/// What compositeNearest() makes of the lists that depthSort() would give with colours like
/// `color`, which is empty, bit for bit, without storing them. `behind`, if given, is behind the
/// lists. `out`, whose window is set, is overwritten.
void depthSortComposite(const CapturedFragments& captured, const Projection& projection,
                        std::uint32_t layers, Tail tail, const FragmentArray& color,
                        CompositeImage& out, const OpaqueFragments* behind = nullptr);

// surface_channels.cpp.

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
