// SPDX-License-Identifier: Apache-2.0
// The triangles of a list, strip or fan (glTF 2.0 §3.7.2.1). Independent of the implementation in
// core, which is under test.
#pragma once

#include <cstddef>

#include <peeler/scene.h>

namespace peeler::test {

/// Calls visit(a, b, c) with the corner indices of each triangle. Does nothing for points and
/// lines.
template <class Visit>
void forEachTriangle(Topology topology, std::size_t count, Visit&& visit) {
    if (topology == Topology::kTriangles)
        for (std::size_t i = 0; i + 2 < count; i += 3)
            visit(i, i + 1, i + 2);
    if (topology == Topology::kTriangleStrip)
        for (std::size_t i = 0; i + 2 < count; ++i)
            visit(i, i + 1 + i % 2, i + 2 - i % 2);
    if (topology == Topology::kTriangleFan)
        for (std::size_t i = 1; i + 1 < count; ++i)
            visit(0, i, i + 1);
}

}  // namespace peeler::test
