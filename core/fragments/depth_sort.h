// SPDX-License-Identifier: Apache-2.0
// Captured fragments in any order, sorted by depth into lists, or composited in that order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include <peeler/view.h>

namespace peeler {

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

}  // namespace peeler
