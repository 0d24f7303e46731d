// SPDX-License-Identifier: Apache-2.0
// Rays that are close to each other, tested together.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/trace/exact_ray.h"
#include "core/trace/triangle_block.h"

namespace peeler {

/// A cone that contains rays, as a frustum around an axis.
struct RayCone {
    Cells origin{};
    double spread = 0;  ///< largest distance of a ray's origin from `origin`, along an axis
    std::array<std::uint8_t, 3> axis{};  ///< the last is the axis of the frustum
    bool backwards = false;              ///< whether the rays go towards lower coordinates there
    /// Least and largest component along the first two axes, per unit of distance along the last.
    std::array<double, 2> low{}, high{};
};

/// A triangle that rays of a packet may hit.
struct PacketCandidate {
    std::uint32_t triangle = 0;
    std::uint64_t may = 0;     ///< bits of the rays whose lines may pass inside the triangle
    std::uint64_t inside = 0;  ///< bits of those whose lines do, for certain
};

/// Up to kMost rays, from one point or from points close to each other, and their hits. Finds the
/// same hits as exactHit().
class RayPacket {
  public:
    static constexpr std::size_t kMost = 64;

    /// A hit of one of the rays.
    struct Hit {
        std::uint32_t ray = 0;
        float t = 0;
        bool back = false;
    };

    /// Takes rays from the beginning of a list that are close to each other, but no more than
    /// kMost. Returns their number. The list must outlive the packet.
    std::size_t take(std::span<const std::optional<ExactRay>> rays);

    const RayCone& cone() const { return cone_; }

    /// Writes those of the triangles that rays may hit to `found`. Overwrites `found`.
    void candidates(std::span<const BlockPart> blocks, std::vector<PacketCandidate>& found) const;

    /// Writes the hits of a candidate, which is not flat, to `hits`, in the order of rays.
    /// Overwrites `hits`.
    void findHits(const CellCorners& corners, PacketCandidate candidate,
                  std::vector<Hit>& hits) const;

  private:
    friend struct PacketTests;
    template <class Number>
    using Lanes = std::array<std::array<Number, kMost>, 3>;

    bool isClose(std::size_t count);

    std::span<const std::optional<ExactRay>> rays_;
    std::size_t count_ = 0;
    RayCone cone_;
    double largest_moment_ = 0;  ///< largest component of a ray's moment, in units
    /// Directions, and origins less cone_.origin, by axis.
    alignas(32) Lanes<double> along_{}, offset_{};
    alignas(32) std::array<double, kMost> scale_{};  ///< t = τ · scale; NaN if t has a start
    /// Directions of at most 1, and moments: direction × offset in units, by axis.
    alignas(32) Lanes<float> direction_{}, moment_{};
};

}  // namespace peeler
