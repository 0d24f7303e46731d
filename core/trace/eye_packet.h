// SPDX-License-Identifier: Apache-2.0
// Rays from one point that are close to each other, tested together.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/trace/exact_ray.h"

namespace peeler {

/// A cone that contains rays from one point, as a frustum around an axis.
struct RayCone {
    Cells origin{};
    std::array<std::uint8_t, 3> axis{};  ///< the last is the axis of the frustum
    bool backwards = false;              ///< whether the rays go towards lower coordinates there
    /// Least and largest component along the first two axes, per unit of distance along the last.
    std::array<double, 2> low{}, high{};
};

/// Up to kMost rays with the same origin, and their hits. Finds the same hits as exactHit().
class EyePacket {
  public:
    static constexpr std::size_t kMost = 64;

    /// A hit of one of the rays.
    struct Hit {
        std::uint32_t ray = 0, triangle = 0;
        float t = 0;
        bool back = false;
    };

    /// Takes rays. Returns false if they do not begin at one point, or are not close to each other;
    /// they must then be traced one by one.
    bool take(std::span<const std::optional<ExactRay>> rays);

    const RayCone& cone() const { return cone_; }

    /// Appends the hits of a triangle, which is not flat.
    void addHits(const CellCorners& corners, std::uint32_t triangle, std::vector<Hit>& hits) const;

  private:
    std::array<ExactRay, kMost> rays_;
    std::size_t count_ = 0;
    RayCone cone_;
    alignas(32) std::array<std::array<float, kMost>, 3> along_{};  ///< directions, by axis
};

}  // namespace peeler
