// SPDX-License-Identifier: Apache-2.0
#include "core/scene/elements.h"

#include <algorithm>

namespace peeler {
namespace {

/// Returns the length of the sequence of drawn vertices.
std::size_t sequenceOf(const Primitive& primitive) {
    return primitive.indices.empty() ? primitive.positions.size() : primitive.indices.size();
}

/// Returns the indices of the e-th element's vertices in a sequence of `size` drawn vertices.
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

Corners cornersOfAny(const Primitive& primitive, std::uint32_t element) {
    Corners corners = placesOf(primitive.topology, element, sequenceOf(primitive));
    if (primitive.indices.empty()) return corners;
    for (std::size_t& vertex : corners.vertex)
        vertex = primitive.indices[vertex];
    return corners;
}

namespace {

double clamped(double weight) {
    return weight > 0 ? std::min(weight, 1.0) : 0;  // NaN (edge-on) becomes 0
}

/// Returns barycentric weights (Möller & Trumbore, "Fast, Minimum Storage Ray/Triangle
/// Intersection", 1997).
std::array<double, 3> triangleWeights(const std::array<glm::dvec3, 3>& corner,
                                      const glm::dvec3& origin, const glm::dvec3& direction) {
    const glm::dvec3 e1 = corner[1] - corner[0], e2 = corner[2] - corner[0];
    const glm::dvec3 across = glm::cross(direction, e2), to = origin - corner[0];
    const double determinant = glm::dot(e1, across);
    double u = clamped(glm::dot(to, across) / determinant);
    double v = clamped(glm::dot(direction, glm::cross(to, e1)) / determinant);
    if (const double sum = u + v; sum > 1) {
        u /= sum;
        v /= sum;
    }
    return {1 - u - v, u, v};
}

std::array<double, 3> lineWeights(const std::array<glm::dvec3, 3>& corner, const glm::dvec3& origin,
                                  const glm::dvec3& direction) {
    const glm::dvec3 along = corner[1] - corner[0];
    const glm::dvec3 normal = glm::cross(direction, glm::cross(direction, along));
    const double u = clamped(glm::dot(origin - corner[0], normal) / glm::dot(along, normal));
    return {1 - u, u, 0};
}

}  // namespace

glm::dvec3 WorldElement::normal() const {
    if (corners.count < 3) return glm::dvec3(0);
    const glm::dvec3 normal = glm::cross(corner[1] - corner[0], corner[2] - corner[0]);
    return instance->mirrored ? -normal : normal;
}

std::array<double, 3> WorldElement::weightsAt(const glm::dvec3& ray_origin,
                                              const glm::dvec3& direction) const {
    if (corners.count == 3) return triangleWeights(corner, ray_origin, direction);
    if (corners.count == 2) return lineWeights(corner, ray_origin, direction);
    return {1, 0, 0};
}

WorldElement elementOf(const PosedScene& posed, std::uint32_t key) {
    WorldElement element;
    element.origin = posed.drawList().originOf(key);
    element.instance = &posed.meshes()[element.origin.instance];
    element.primitive = &posed.primitive(element.origin);
    return element;
}

void placeCorners(const PosedScene& posed, WorldElement& element) {
    const MeshInstance& instance = posed.meshes()[element.origin.instance];
    const auto& positions = posed.positions(instance, element.origin.primitive);
    element.corners = cornersOf(*element.primitive, element.origin.element);
    for (std::size_t i = 0; i < static_cast<std::size_t>(element.corners.count); ++i) {
        const glm::dvec3 local(positions[element.corners.vertex[i]]);
        element.corner[i] = glm::dvec3(instance.world * glm::dvec4(local, 1));
    }
}

void RecentElements::find(std::uint32_t key, Entry& entry) const {
    entry.key = key;
    entry.element = elementOf(posed_, key);
    if (!corners_) return;
    placeCorners(posed_, entry.element);
    entry.normal = entry.element.normal();
    entry.unit = unitOrZero(entry.normal);
}

}  // namespace peeler
