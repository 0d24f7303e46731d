// SPDX-License-Identifier: Apache-2.0
// What the two kinds of files of maps share: evaluating them and their statistics.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/rays/ray_maps.h"
#include "formats/rays/ray_output.h"

namespace peeler {

/// Evaluates the maps a few rows at a time; what becomes of them is up to those below.
class RayMapOutput : public RayOutput {
  public:
    RayMapOutput(const PosedScene& posed, const Solids* solids, const RayMapSettings& settings)
        : maps_(posed, solids, settings) {}

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override;
    void take(std::size_t bundle, const LayeredImage& band) override;
    RayResults results() const override;

  protected:
    /// Before the first rows of a bundle.
    virtual void beginBundle(std::size_t bundle) = 0;
    /// Rows of the bundle at hand, a plane of them a channel.
    virtual void writeRows(const Window& rows, std::span<const float> planes) = 0;
    virtual void finishBundle() = 0;
    virtual std::string pathOf(std::size_t bundle) const = 0;

    const RayMaps& maps() const { return maps_; }
    const std::vector<Bundle>& bundles() const { return bundles_; }
    /// Of the bundle, in the order of the channels.
    const std::vector<RayMapStatistics>& statistics(std::size_t bundle) const {
        return statistics_[bundle];
    }

  private:
    RayMaps maps_;
    std::vector<Bundle> bundles_;
    std::vector<std::vector<RayMapStatistics>> statistics_;  ///< by bundle
    std::vector<float> planes_;
};

/// One map, a file a bundle; of makeRayMapOutput().
std::unique_ptr<RayOutput> makeRayMapPictures(const std::string& path, const PosedScene& posed,
                                              const Solids* solids, const RayMapOptions& options);

}  // namespace peeler
