// SPDX-License-Identifier: Apache-2.0
// Look-at, and the rigid parts of node matrices.
#include "core/scene/placement.h"

#include <algorithm>
#include <cmath>

namespace peeler {
namespace {

/// Directions closer than this (sine of the angle) count as parallel.
constexpr double kParallel = 1e-7;

/// Unit length, or nothing. Divides by the largest component first: a tiny scene's matrix may hold
/// numbers whose squares vanish.
std::optional<glm::dvec3> normalized(const glm::dvec3& v) {
    const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    if (!(largest > 0) || !std::isfinite(largest)) return std::nullopt;
    return glm::normalize(v / largest);
}

}  // namespace

std::optional<glm::dmat4> lookAlong(const glm::dvec3& eye, const glm::dvec3& forward,
                                    const glm::dvec3& up) {
    const auto ahead = normalized(forward), upwards = normalized(up);
    if (!ahead || !upwards) return std::nullopt;
    const glm::dvec3 side = glm::cross(*ahead, *upwards);
    if (glm::length(side) < kParallel) return std::nullopt;
    const glm::dvec3 right = glm::normalize(side);
    const glm::dvec3 above = glm::normalize(glm::cross(right, *ahead));
    return glm::dmat4(glm::dvec4(right, 0), glm::dvec4(above, 0), glm::dvec4(-*ahead, 0),
                      glm::dvec4(eye, 1));
}

std::optional<glm::dmat4> rigid(const glm::dmat4& world) {
    return lookAlong(glm::dvec3(world[3]), -glm::dvec3(world[2]), glm::dvec3(world[1]));
}

}  // namespace peeler
