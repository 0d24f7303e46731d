// SPDX-License-Identifier: Apache-2.0
#include "core/scene/placed_element.h"

#include <algorithm>

namespace peeler {
namespace {

double clamped(double weight) {
    return weight > 0 ? std::min(weight, 1.0) : 0;  // NaN (seen edge-on) becomes 0
}

/// Möller & Trumbore 1997.
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

glm::dvec3 PlacedElement::normal() const {
    if (corners.count < 3) return glm::dvec3(0);
    const glm::dvec3 normal = glm::cross(corner[1] - corner[0], corner[2] - corner[0]);
    return instance->mirrored ? -normal : normal;
}

std::array<double, 3> PlacedElement::weightsAt(const glm::dvec3& ray_origin,
                                               const glm::dvec3& direction) const {
    if (corners.count == 3) return triangleWeights(corner, ray_origin, direction);
    if (corners.count == 2) return lineWeights(corner, ray_origin, direction);
    return {1, 0, 0};
}

PlacedElement elementOf(const PosedScene& posed, std::uint32_t key) {
    PlacedElement element;
    element.origin = posed.drawList().originOf(key);
    element.instance = &posed.meshes()[element.origin.instance];
    element.primitive = &posed.primitive(element.origin);
    return element;
}

void placeCorners(const PosedScene& posed, PlacedElement& element) {
    const MeshInstance& instance = posed.meshes()[element.origin.instance];
    const auto& positions = posed.positions(instance, element.origin.primitive);
    element.corners = cornersOf(*element.primitive, element.origin.element);
    for (std::size_t i = 0; i < static_cast<std::size_t>(element.corners.count); ++i) {
        const glm::dvec3 local(positions[element.corners.vertex[i]]);
        element.corner[i] = glm::dvec3(instance.world * glm::dvec4(local, 1));
    }
}

}  // namespace peeler
