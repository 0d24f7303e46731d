// SPDX-License-Identifier: Apache-2.0
// The integer grid of cells to which the vertices of a scene and the origins of rays are rounded.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include <peeler/scene.h>

namespace peeler {

/// A point or a vector, in cells.
using Cells = std::array<std::int64_t, 3>;

inline Cells operator-(const Cells& a, const Cells& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

/// A grid of cubic cells, whose size is a power of two. The origin of the grid is near the centre
/// of the scene. Vertices have coordinates of at most 2^kVertexBits cells. A cell is at most
/// 2^(1 − kVertexBits) of the scene's largest extent (README.md).
class CellGrid {
  public:
    static constexpr int kVertexBits = 50;
    static constexpr int kOriginBits = 60;     ///< of the origins of rays
    static constexpr int kDirectionBits = 52;  ///< of the directions of rays

    CellGrid() = default;
    explicit CellGrid(const Bounds& scene);

    /// Returns the size of a cell in scene units.
    double cell() const { return cell_; }
    int exponent() const { return exponent_; }  ///< log2(cell())

    /// Returns the position of a point in cells, not yet rounded.
    glm::dvec3 position(const glm::dvec3& point) const { return (point - centre_) * inverse_; }

  private:
    glm::dvec3 centre_{0};
    int exponent_ = 0;
    double cell_ = 1, inverse_ = 1;
};

/// Rounds a number below 2^62 (ties away from 0).
inline std::int64_t rounded(double value) {
    const auto whole = static_cast<std::int64_t>(value);
    const double rest = value - static_cast<double>(whole);
    return whole + (rest >= 0.5 ? 1 : 0) - (rest <= -0.5 ? 1 : 0);
}
inline Cells rounded(const glm::dvec3& position) {
    return {rounded(position.x), rounded(position.y), rounded(position.z)};
}

}  // namespace peeler
