// SPDX-License-Identifier: Apache-2.0
// Depth sorting of captured fragments, into lists or straight into a composite.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <peeler/composite.h>
#include <peeler/layered_image.h>
#include <peeler/view.h>

namespace peeler {

/// A captured band: pixel p owns the fragments [first[p], first[p + 1]), each of `stride` words:
/// buffer depth, primitive (or another value that orders the pixel's fragments the same way,
/// LayerArea::keys), and a colour (shaders/stored_fragments.glsl).
struct CapturedFragments {
    std::span<const std::uint32_t> first;  ///< pixels + 1 entries
    const std::uint32_t* words = nullptr;
    std::size_t stride = 2;

    std::uint32_t primitive(std::size_t fragment) const { return words[fragment * stride + 1]; }
};

/// The nearest opaque fragments of a band, four words per pixel: depth (0 = none), key, and a
/// half-float colour. If `colors` is given, its 32-bit floats replace that colour. Each fragment
/// lies behind its pixel's list.
struct OpaqueFragments {
    const std::uint32_t* fragments = nullptr;  ///< of the top row; lower rows precede it in memory
    const std::uint32_t* colors = nullptr;     ///< same layout, four words per pixel

    static constexpr std::size_t kWords = 4;
};

/// Sorts every pixel's list by (depth, primitive), keeps the nearest `max_layers` (0 = all),
/// converts buffer depth to camera Z and writes the result to `out`. The window, colour channels
/// and type of `out` must be set; its storage is reused; its extra arrays are not changed.
/// `sources`, if given, receives the index of each fragment of `out` in the captured arrays. Rows
/// are processed in parallel; the result does not depend on the order.
void depthSort(const CapturedFragments& captured, const Projection& projection,
               std::uint32_t max_layers, LayeredImage& out,
               std::vector<std::uint32_t>* sources = nullptr);

/// Composites the lists that depthSort() would write, bit-identical to compositeNearest(), without
/// storing them. `color`, an empty array, gives the channels and type of the colours. `behind`, if
/// given, is composited behind the lists. Overwrites `out`, whose window must be set.
void depthSortComposite(const CapturedFragments& captured, const Projection& projection,
                        std::uint32_t layers, Tail tail, const FragmentArray& color,
                        CompositeImage& out, const OpaqueFragments* behind = nullptr);

}  // namespace peeler
