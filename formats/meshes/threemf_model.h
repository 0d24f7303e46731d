// SPDX-License-Identifier: Apache-2.0
// The content of a 3MF package as peeler_3mf (formats/modules/threemf_reader.cpp) hands it over:
// the records of the result, in order.
//
//   unit (uint32, as lib3mf numbers them), warnings (texts)
//   materials: names (texts), colours (ThreeMfColor)
//   number of objects (uint32), then per object: ThreeMfObject, name (text), vertices, triangles,
//     properties (one per triangle), colours (three per triangle, or none), components
//     (ThreeMfPlacement, of objects with smaller indices)
//   number of build items (uint32), build items (ThreeMfPlacement)
//
// A text is an array of char; texts are their number (uint32), then each.
#pragma once

#include <array>
#include <cstdint>

namespace peeler {

/// The request: these limits, then the bytes of the package.
struct ThreeMfLimits {
    std::uint64_t needed = 0;  ///< memory that an intact package takes at most, in bytes
    std::uint64_t bytes = 0;   ///< memory that the process may take, in bytes
};

using ThreeMfVertex = std::array<float, 3>;
using ThreeMfTriangle = std::array<std::uint32_t, 3>;
using ThreeMfColor = std::array<std::uint8_t, 4>;  ///< sRGB, straight alpha

/// The property of a triangle: an index into the materials, or one of these.
inline constexpr std::uint32_t kThreeMfNothing = 0xFFFFFFFF, kThreeMfCornerColors = 0xFFFFFFFE;

/// The content of an object that peeler does not show.
enum ThreeMfLost : std::uint32_t {
    kThreeMfTextures = 1,
    kThreeMfBeams = 2,
    kThreeMfSlices = 4,
    kThreeMfUnknownProperties = 8,  ///< properties that the file does not define
    kThreeMfSupport = 16,           ///< the object is a support
    kThreeMfOther = 32,             ///< the object is of type "other"
};

struct ThreeMfObject {
    std::uint32_t id = 0, lost = 0;
    std::uint32_t vertices = 0, triangles = 0, components = 0, has_colors = 0;
};

/// An object's place: the rows of the matrix that maps its points to its parent's.
struct ThreeMfPlacement {
    std::uint32_t object = 0;  ///< index of the object
    std::array<std::array<float, 4>, 3> rows{};
};

}  // namespace peeler
