// SPDX-License-Identifier: Apache-2.0
// Depth sorting of captured fragments into lists, or directly into a composite.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include <peeler/view.h>

namespace peeler {

/// A captured band. Pixel p has the fragments [first[p], first[p + 1]). A fragment has `stride`
/// words: buffer depth, primitive and colour (shaders/stored_fragments.glsl). Instead of the
/// primitive, a fragment may have another key (StoredKeys).
struct CapturedFragments {
    std::span<const std::uint32_t> first;  ///< index of each pixel's first fragment, then the end
    const std::uint32_t* words = nullptr;
    std::size_t stride = 2;

    std::uint32_t key(std::size_t fragment) const { return words[fragment * stride + 1]; }
};

/// The nearest opaque fragments of a band, four words per pixel: depth (0 = no fragment), key, and
/// a half-float colour. If `colors` is given, its 32-bit floats replace the half-float colour. The
/// opaque fragment of a pixel lies behind all fragments in the pixel's list.
struct OpaqueFragments {
    /// First pixel of the top row. Lower rows are stored before it.
    const std::uint32_t* fragments = nullptr;
    /// Colours, four words per pixel, in the row order of `fragments`.
    const std::uint32_t* colors = nullptr;

    static constexpr std::size_t kWords = 4;
};

/// Sorts every pixel's list by (depth, key, place in the list), keeps the nearest `max_layers` (0 =
/// all), converts buffer depth to camera Z and writes the result to `out`. The window, colour
/// channels and type of `out` must be set. Reuses the storage of `out` and leaves its extra arrays
/// unchanged. `sources`, if given, receives one index for each fragment of `out`: the fragment's
/// index in the captured arrays. Rows are processed in parallel; the result does not depend on
/// their order.
void depthSort(const CapturedFragments& captured, const Projection& projection,
               std::uint32_t max_layers, LayeredImage& out,
               std::vector<std::uint32_t>* sources = nullptr);

/// Composites the lists that depthSort() would write, without storing the lists. Bit-identical to
/// compositeNearest(). `color`, an empty array, gives the channels and type of the colours.
/// `behind`, if given, is composited behind the lists. Overwrites `out`, whose window must be set.
void depthSortComposite(const CapturedFragments& captured, const Projection& projection,
                        std::uint32_t layers, Tail tail, const FragmentArray& color,
                        CompositeImage& out, const OpaqueFragments* behind = nullptr);

}  // namespace peeler
