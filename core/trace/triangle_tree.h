// SPDX-License-Identifier: Apache-2.0
// A bounding volume hierarchy of triangles, which finds the triangles that a ray may hit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/trace/exact_ray.h"
#include "core/trace/ray_packet.h"
#include "core/trace/triangle_block.h"

namespace peeler {

/// A triangle that a ray may hit.
struct Candidate {
    std::uint32_t triangle = 0;
    bool inside = false;  ///< whether the ray's line passes inside the triangle for certain
};

/// A hierarchy of boxes with eight children per node, in single precision. All roundings are
/// outwards or bounded, so it misses no triangle (README.md).
class TriangleTree {
  public:
    static constexpr std::size_t kWidth = TriangleBlock::kWidth;

    TriangleTree() = default;
    /// Builds the hierarchy by a binned surface area heuristic (Wald 2007, "On fast Construction of
    /// SAH-based Bounding Volume Hierarchies"), in parallel. The tree does not depend on the number
    /// of threads. `corners` returns the corners of a triangle; it is called by several threads.
    TriangleTree(std::size_t triangles, const std::function<CellCorners(std::uint32_t)>& corners);

    /// Writes all triangles that the ray may hit to `found`, in any order. Overwrites `found`.
    void candidates(const ExactRay& ray, std::vector<Candidate>& found) const;

    /// Writes all triangles that rays in a cone may hit to `found`, in any order, or returns false
    /// if they are in more than `most` blocks. Overwrites `found`.
    bool candidates(const RayCone& cone, std::size_t most, std::vector<BlockPart>& found) const;

  private:
    friend class TreeBuilder;
    friend struct TreeWalk;

    using Lanes = std::array<float, kWidth>;
    /// A reference to a child: a node, or a block and its number of triangles less one.
    using Child = std::uint32_t;
    static constexpr Child kBlock = 0x80000000U, kNone = 0xFFFFFFFFU;
    /// The boxes of a node's children. The box of a missing child is never hit.
    struct alignas(32) Node {
        std::array<std::array<Lanes, 3>, 2> plane;  ///< low and high, by axis
        std::array<Child, kWidth> child;
    };
    std::vector<Node> nodes_;
    std::vector<TriangleBlock> blocks_;
    Child root_ = kNone;
};

}  // namespace peeler
