// SPDX-License-Identifier: Apache-2.0
#include "core/raster/surface_points.h"

#include <cmath>

namespace peeler {
namespace {

/// Returns the change of the barycentric weights from a pixel to the next: of the point where the
/// ray meets the triangle's plane (Igehy 1999, §3.1.1).
std::array<double, 3> weightChange(const WorldElement& element, const glm::dvec3& normal,
                                   const Ray& ray, double t, const Ray& change) {
    const glm::dvec3 moved = change.origin + t * change.direction;
    const glm::dvec3 along =
        moved - ray.direction * (glm::dot(moved, normal) / glm::dot(ray.direction, normal));
    const double square = glm::dot(normal, normal);
    const glm::dvec3 a = element.corner[1] - element.corner[0];
    const glm::dvec3 b = element.corner[2] - element.corner[0];
    const double second = glm::dot(glm::cross(along, b), normal) / square;
    const double third = glm::dot(glm::cross(a, along), normal) / square;
    if (!std::isfinite(second) || !std::isfinite(third)) return {};
    return {-second - third, second, third};
}

}  // namespace

glm::dvec4 SurfacePoint::textured(const TextureRef& texture, bool srgb) const {
    if (!texture) return glm::dvec4(1);
    const glm::dvec2 uv = texcoord(texture.texcoord);
    if (levels) return levels->sample(texture, uv, footprint(texture.texcoord), srgb);
    return texelAt(posed.scene().images[static_cast<std::size_t>(texture.image)], texture, uv,
                   srgb);
}

SurfacePoint surfacePoint(const PosedScene& posed, const WorldElement& element, const Ray& ray,
                          const RayDifferentials* change, const TextureLevels* levels) {
    const glm::dvec3 normal = element.normal();
    const bool back = glm::dot(normal, ray.direction) > 0;
    SurfacePoint point{
        posed,
        element,
        posed.scene().materials[static_cast<std::size_t>(element.primitive->material)],
        element.weightsAt(ray.origin, ray.direction),
        ray.direction,
        back ? -normal : normal,
        back ? -1.0 : 1.0,
        levels};
    if (change) {
        const double t = glm::dot(element.weighted(point.weight) - ray.origin, ray.direction) /
                         glm::dot(ray.direction, ray.direction);
        point.weight_per = {weightChange(element, normal, ray, t, change->per_x),
                            weightChange(element, normal, ray, t, change->per_y)};
    }
    return point;
}

}  // namespace peeler
