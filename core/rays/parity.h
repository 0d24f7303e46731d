// SPDX-License-Identifier: Apache-2.0
// Whether rays leave what they enter.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "core/image/layered_image.h"
#include "core/rays/solids.h"

namespace peeler {

/// A ray that hits a solid an odd number of times.
struct OddRay {
    std::size_t bundle = 0;
    int x = 0, y = 0;  ///< pixel of the bundle's picture
    bool operator==(const OddRay&) const = default;
};

struct SolidParity {
    std::uint64_t rays = 0;     ///< that hit it
    std::uint64_t odd = 0;      ///< of those
    std::vector<OddRay> first;  ///< the first Parity::kKept of the odd ones
};

/// Counts, over bundles, the rays that hit each solid, and those that hit it an odd number of
/// times: through a closed surface there are none.
class Parity {
  public:
    static constexpr std::size_t kKept = 8;

    explicit Parity(const Solids& solids) : solids_(solids) {}

    /// Bands of bundles in order. extra[0] are the keys.
    void add(std::size_t bundle, const LayeredImage& band);

    /// By index of the solid; those that no ray has hit are missing.
    const std::map<std::uint32_t, SolidParity>& solids() const { return found_; }
    std::uint64_t oddRays() const { return odd_rays_; }  ///< odd with any solid
    bool holds() const { return odd_rays_ == 0; }

  private:
    const Solids& solids_;
    std::map<std::uint32_t, SolidParity> found_;
    std::uint64_t odd_rays_ = 0;
};

}  // namespace peeler
