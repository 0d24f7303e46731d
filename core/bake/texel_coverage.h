// SPDX-License-Identifier: Apache-2.0
// Which texels triangles cover in UV space.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace peeler {

/// The corners of a triangle in UV space, in texels.
using UvTriangle = std::array<glm::dvec2, 3>;

/// A triangle at a texel.
struct TexelSample {
    std::uint32_t triangle = 0;
    glm::vec2 barycentric{0};  ///< weights of the second and third corner
};

/// The texels of one row of a square texture.
struct TexelRow {
    std::vector<std::uint32_t> first;  ///< of texel x: samples first[x] … first[x + 1] − 1
    std::vector<TexelSample> samples;
    std::uint64_t covered = 0;  ///< texels whose centre is in a triangle
    std::uint64_t shared = 0;   ///< of those, in several
};

/// Rasterises triangles in a plane that repeats the texture.
class TexelCoverage {
  public:
    /// A texel has at most so many samples, of the first triangles.
    static constexpr std::uint32_t kMostSamples = 8;

    /// `size` texels a side. The triangles must outlive it. Throws Error (kInput) if more than 2^29
    /// texels lie in the boxes around all of them.
    TexelCoverage(std::span<const UvTriangle> triangles, int size);

    /// The triangles that a texel's centre lies in; of two with a common edge one has a centre on
    /// it. If there is none, the nearest point of the nearest one that touches the circle around
    /// the texel. May be called from several threads.
    TexelRow row(int y) const;

  private:
    /// A row of the plane that a triangle is on.
    struct Crossing {
        std::uint32_t triangle = 0;
        std::int32_t y = 0;
    };
    /// Calls body(triangle, first row, last row) for each.
    template <class Body>
    void forEachReach(const Body& body) const;

    std::span<const UvTriangle> triangles_;
    int size_;
    std::vector<std::size_t> first_crossing_;  ///< of each row of the texture, and one more
    std::vector<Crossing> crossings_;
};

}  // namespace peeler
