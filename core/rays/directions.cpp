// SPDX-License-Identifier: Apache-2.0
#include "core/rays/directions.h"

#include <cmath>
#include <numbers>

namespace peeler {
namespace {

/// `count` directions of equal share between heights `top` and `bottom` (Y).
std::vector<glm::dvec3> lattice(int count, double top, double bottom) {
    constexpr double kGoldenAngle = std::numbers::pi * (3 - 2.2360679774997896964);  // 3 − √5
    std::vector<glm::dvec3> directions;
    directions.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        const double y = top + (bottom - top) * (i + 0.5) / count;
        const double across = std::sqrt(std::max(0.0, 1 - y * y)), angle = kGoldenAngle * i;
        directions.emplace_back(across * std::cos(angle), y, across * std::sin(angle));
    }
    return directions;
}

}  // namespace

std::vector<glm::dvec3> sphereDirections(int count) {
    return lattice(count, 1, -1);
}

std::vector<glm::dvec3> hemisphereDirections(int count) {
    return lattice(count, 1, 0);
}

}  // namespace peeler
