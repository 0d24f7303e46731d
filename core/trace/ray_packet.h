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

/// Up to kMost rays, from one point or from points close to each other, and their hits. Finds the
/// same hits as exactHit().
class RayPacket {
  public:
    static constexpr std::size_t kMost = 64;

    /// A hit of one of the rays.
    struct Hit {
        std::uint32_t ray = 0, triangle = 0;
        float t = 0;
        bool back = false;
    };

    /// Takes rays from the beginning of a list as long as they are close to each other, but no more
    /// than kMost. Returns their number.
    std::size_t take(std::span<const std::optional<ExactRay>> rays);

    const RayCone& cone() const { return cone_; }

    /// Appends the hits of a triangle, which is not flat.
    void addHits(const CellCorners& corners, std::uint32_t triangle, std::vector<Hit>& hits) const;

  private:
    bool add(const std::optional<ExactRay>& ray, RayCone& cone);
    void addHitsOfEye(const CellCorners& corners, std::uint32_t triangle,
                      std::vector<Hit>& hits) const;

    std::array<ExactRay, kMost> rays_;
    std::size_t count_ = 0;
    RayCone cone_;
    double largest_moment_ = 0;  ///< largest component of a ray's moment
    /// Directions, and moments: direction × (origin − cone_.origin), by axis.
    alignas(32) std::array<std::array<float, kMost>, 3> along_{}, moment_{};
};

}  // namespace peeler
