// SPDX-License-Identifier: Apache-2.0
// Rasterisation of triangles in UV space.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace peeler {

/// The corners of a triangle in UV space, in texels.
using UvTriangle = std::array<glm::dvec2, 3>;

/// A point of a triangle that gives a texel a value.
struct TexelSample {
    std::uint32_t triangle = 0;
    glm::vec2 barycentric{0};  ///< weights of the second and third corner
};

/// The texels of one row of a square texture.
struct TexelRow {
    std::vector<std::uint32_t> first;  ///< texel x has samples first[x] … first[x + 1] − 1
    std::vector<TexelSample> samples;
    std::uint64_t covered = 0;  ///< number of texels whose centre is in a triangle
    std::uint64_t shared = 0;   ///< number of texels whose centre is in several triangles
};

/// The coverage of texels by triangles, in a plane that repeats the texture.
class TexelCoverage {
  public:
    /// The maximum number of samples per texel. Samples of later triangles are dropped.
    static constexpr std::uint32_t kMostSamples = 8;

    /// `size`: texels per side. The triangles must outlive this object. Throws Error (kInput) if
    /// the bounding boxes of all triangles together contain more than 2^29 texels.
    TexelCoverage(std::span<const UvTriangle> triangles, int size);

    /// Returns, for each texel of row `y`, a sample for every triangle that contains the texel's
    /// centre. A centre on a shared edge belongs to only one of the two triangles. If no triangle
    /// contains the centre, returns the nearest point of the nearest triangle that touches the
    /// texel's circumscribed circle. Thread-safe.
    TexelRow row(int y) const;

  private:
    /// A triangle, and one row of the unwrapped UV plane that the triangle reaches.
    struct Crossing {
        std::uint32_t triangle = 0;
        std::int32_t y = 0;
    };
    /// Calls body(triangle, first row, last row) for each triangle.
    template <class Body>
    void forEachReach(const Body& body) const;

    std::span<const UvTriangle> triangles_;
    int size_;
    std::vector<std::size_t> first_crossing_;  ///< index of each row's first crossing, then the end
    std::vector<Crossing> crossings_;
};

}  // namespace peeler
