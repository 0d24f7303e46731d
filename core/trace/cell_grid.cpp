// SPDX-License-Identifier: Apache-2.0
#include "core/trace/cell_grid.h"

#include <algorithm>
#include <cmath>

namespace peeler {
namespace {

// Far from the largest and the smallest double, so that no step below overflows or underflows.
constexpr int kLeastCellExponent = -800, kMostCellExponent = 900;

}  // namespace

CellGrid::CellGrid(const Bounds& scene) {
    const auto exponent_of = [](const glm::dvec3& extent) {
        const double most = std::max({std::abs(extent.x), std::abs(extent.y), std::abs(extent.z)});
        int exponent = kLeastCellExponent;
        if (most > 0) std::frexp(most, &exponent);  // most <= 2^exponent
        return std::clamp(exponent, kLeastCellExponent, kMostCellExponent);
    };
    // Positions in coarse steps of half the extent: the centre is such a multiple, so that a
    // coordinate minus the centre is exact if the coordinate is a multiple of a cell.
    const glm::dvec3 half = 0.5 * scene.max - 0.5 * scene.min;
    const double step = std::ldexp(1.0, exponent_of(half) - 2);
    centre_ = glm::round((0.5 * scene.max + 0.5 * scene.min) / step) * step;
    exponent_ = exponent_of(glm::max(glm::abs(scene.max - centre_), glm::abs(scene.min - centre_)) *
                            (1 + 0x1p-50)) -
                kVertexBits;
    cell_ = std::ldexp(1.0, exponent_);
    inverse_ = std::ldexp(1.0, -exponent_);
}

}  // namespace peeler
