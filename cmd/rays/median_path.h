// SPDX-License-Identifier: Apache-2.0
// The median path of rays through solids, for a start value of the attenuation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/rays/ray_maps.h"
#include "formats/rays/ray_output.h"

namespace peeler::cmd {

/// A collector of the lengths of rays inside solids. Keeps at most kMostPaths rays, evenly chosen.
/// Writes no file. The arguments must outlive this object.
class MedianPath : public RayOutput {
  public:
    MedianPath(const PosedScene& posed, const Solids& solids, Overlap overlap)
        : maps_(posed, &solids, {.maps = {RayMap::kThickness}, .overlap = overlap}) {}

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override;
    void take(std::size_t bundle, const LayeredImage& band) override;
    void finish() override {}
    SinkMemory memory(const Bundle&) const override {
        return {.bytes = kMostPaths * sizeof(float), .pixel_bytes = sizeof(float)};
    }
    /// Returns the median length of the rays inside solids; none if no ray passes through a solid.
    std::optional<double> median();

  private:
    static constexpr std::uint64_t kMostPaths = 1 << 20;

    RayMaps maps_;
    std::vector<Bundle> bundles_;
    std::vector<std::uint64_t> first_;  ///< number of rays before each bundle
    std::uint64_t step_ = 1;            ///< every step-th ray is kept
    std::vector<float> lengths_, values_;
};

}  // namespace peeler::cmd
