// SPDX-License-Identifier: Apache-2.0
#include "core/scene/primitive_corners.h"

namespace peeler {
namespace {

/// Vertices in the sequence that is drawn.
std::size_t sequenceOf(const Primitive& primitive) {
    return primitive.indices.empty() ? primitive.positions.size() : primitive.indices.size();
}

/// Places in the sequence of vertices that is drawn, which has `size`.
Corners placesOf(Topology topology, std::size_t e, std::size_t size) {
    switch (topology) {
        case Topology::kPoints:
            return {1, {e}};
        case Topology::kLines:
            return {2, {2 * e, 2 * e + 1}};
        case Topology::kLineLoop:
            return {2, {e, (e + 1) % size}};
        case Topology::kLineStrip:
            return {2, {e, e + 1}};
        case Topology::kTriangles:
            return {3, {3 * e, 3 * e + 1, 3 * e + 2}};
        case Topology::kTriangleStrip:
            return {3, {e + e % 2, e + 1 - e % 2, e + 2}};
        case Topology::kTriangleFan:
            return {3, {0, e + 1, e + 2}};
    }
    return {};
}

}  // namespace

std::uint64_t elementsOf(const Primitive& primitive) {
    const std::uint64_t n = sequenceOf(primitive);
    switch (primitive.topology) {
        case Topology::kPoints:
            return n;
        case Topology::kLines:
            return n / 2;
        case Topology::kLineLoop:
            return n < 2 ? 0 : n;
        case Topology::kLineStrip:
            return n < 2 ? 0 : n - 1;
        case Topology::kTriangles:
            return n / 3;
        case Topology::kTriangleStrip:
        case Topology::kTriangleFan:
            return n < 3 ? 0 : n - 2;
    }
    return 0;
}

Corners cornersOf(const Primitive& primitive, std::uint32_t element) {
    Corners corners = placesOf(primitive.topology, element, sequenceOf(primitive));
    if (primitive.indices.empty()) return corners;
    for (std::size_t& vertex : corners.vertex)
        vertex = primitive.indices[vertex];
    return corners;
}

}  // namespace peeler
