// SPDX-License-Identifier: Apache-2.0
// Base class of ray map writers, which evaluates maps and collects statistics.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/rays/ray_maps.h"
#include "formats/rays/ray_output.h"

namespace peeler {

/// A ray output that evaluates maps a few rows at a time. Derived classes write the values.
class RayMapOutput : public RayOutput {
  public:
    RayMapOutput(const PosedScene& posed, const Solids* solids, const RayMapSettings& settings)
        : maps_(posed, solids, settings) {}

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override;
    void take(std::size_t bundle, const LayeredImage& band) override;
    RayResults results() const override;
    SinkMemory memory(const Bundle& bundle) const override;

  protected:
    /// Called before the first call of writeRows() for a bundle.
    virtual void beginBundle(std::size_t bundle) = 0;
    /// Writes the values of some rows of the current bundle: one plane per channel, row-major.
    virtual void writeRows(const Window& rows, std::span<const float> planes) = 0;
    virtual void finishBundle() = 0;
    virtual std::string pathOf(std::size_t bundle) const = 0;

    const RayMaps& maps() const { return maps_; }
    const std::vector<Bundle>& bundles() const { return bundles_; }
    /// Returns the statistics of a bundle's values so far, in the order of channels.
    const std::vector<RayMapStatistics>& statistics(std::size_t bundle) const {
        return statistics_[bundle];
    }

  private:
    RayMaps maps_;
    std::vector<Bundle> bundles_;
    /// One entry per bundle and channel.
    std::vector<std::vector<RayMapStatistics>> statistics_;
    std::vector<float> planes_;
};

/// Returns makeRayMapOutput()'s output for PNG, JPEG and TIFF: one map, with one file per bundle.
std::unique_ptr<RayOutput> makeRayMapPictures(const std::string& path, const PosedScene& posed,
                                              const Solids* solids, const RayMapOptions& options);

}  // namespace peeler
