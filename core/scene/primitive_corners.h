// SPDX-License-Identifier: Apache-2.0
// Which points, lines or triangles GL makes of a primitive, and which vertices they have.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/scene/scene.h"

namespace peeler {

/// How many elements GL makes of a primitive; also what gl_PrimitiveID counts.
std::uint64_t elementsOf(const Primitive& primitive);

struct Corners {
    int count = 0;  ///< 1 to 3
    std::array<std::size_t, 3> vertex{};
};

/// Of the element that GL makes as the `element`-th of a primitive, in the order in which GL draws
/// it: odd triangles of a strip are turned, so that all have one orientation (OpenGL 4.5 core,
/// §10.1).
Corners cornersOf(const Primitive& primitive, std::uint32_t element);

}  // namespace peeler
