// SPDX-License-Identifier: Apache-2.0
// rays --map: numbers a ray, as EXR or as pictures.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cmd/rays/ray_output.h"
#include "core/image/sink.h"
#include "core/rays/ray_maps.h"

namespace peeler::cmd {

struct RayMapOptions {
    RayMapSettings settings;
    std::optional<std::pair<double, double>> range;  ///< pictures: black and the brightest colour
    Provenance provenance;
};

/// What is told of a channel of a bundle.
struct RayMapStatistics {
    double least = std::numeric_limits<double>::infinity();  ///< of the finite values
    double greatest = -std::numeric_limits<double>::infinity();
    double sum = 0;

    void add(std::span<const float> values);
    bool empty() const { return least > greatest; }
};

/// Evaluates the maps a few rows at a time; what becomes of them is up to those below.
class RayMapOutput : public RayOutput {
  public:
    RayMapOutput(const PosedScene& posed, const Solids* solids, const RayMapSettings& settings)
        : maps_(posed, solids, settings) {}

    void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) override;
    void take(std::size_t bundle, const LayeredImage& band) override;
    void tell(nlohmann::ordered_json& result) const override;

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

/// EXR: a part a bundle, with its name; a channel a map, or, of path-length, a material. PNG, JPEG,
/// TIFF: one map, a file a bundle: of several bundles the path has a place for the number ("####").
/// Without a range a picture goes from 0 (first, last: the least value) to the greatest value of
/// its bundle, and all its values are kept until then, 4 bytes a ray; transmission goes from 0 to 1
/// and is shown like a radiograph. Where there is no hit, first and last are transparent. Path
/// lengths come with the transmission if there is attenuation; a picture shows that.
///
/// `solids` may be null if no map needs them (needsSolids()). Everything referred to must outlive
/// the output. Pictures of bundles that are done stand under their names before finish(). Throws
/// Error (kUsage) for maps that do not fit the format or lack what they need.
std::unique_ptr<RayOutput> makeRayMapOutput(const std::string& path, const PosedScene& posed,
                                            const Solids* solids, RayMapOptions options);

/// Whether one of the maps needs to know what is inside of what.
bool needsSolids(std::span<const RayMap> maps);

/// One file each; for makeRayMapOutput().
std::unique_ptr<RayOutput> makeRayMapPictures(const std::string& path, const PosedScene& posed,
                                              const Solids* solids, const RayMapOptions& options);

}  // namespace peeler::cmd
