// SPDX-License-Identifier: Apache-2.0
// One number a ray, or a few, from all its hits.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/layered_image.h>
#include "core/base/parallel.h"
#include "core/rays/solids.h"

namespace peeler {

/// What a map says of each ray; the table has a sentence on every one.
enum class RayMap : std::uint8_t {
    kFirst,
    kLast,
    kCount,
    kThickness,
    kPathLength,
    kTransmission,
    kParity,
    kOverlap
};

/// A ray with all that the maps ask for (ray_maps.cpp).
struct MappedRay;

/// A row of the table of maps.
struct RayMapInfo {
    RayMap map;
    std::string_view name;  ///< on the command line; of the channel, but for kPathLength
    std::string_view summary;
    PixelType type;  ///< kFloat or kUint
    /// Writes the map's number of a ray; kPathLength a number a material.
    void (*evaluate)(const MappedRay& ray, float* out);
    bool solids = false;  ///< it needs to know what is inside of what
    bool length = false;  ///< a length inside of something: its sum over parallel rays is a volume
};

/// In the order of the enumeration. A ray without hits has 0, but for kFirst and kLast, which are
/// +inf, and kTransmission, which is 1.
std::span<const RayMapInfo> rayMapTable();

inline const RayMapInfo& infoOf(RayMap map) {
    return rayMapTable()[static_cast<std::size_t>(map)];
}

struct RayMapSettings {
    std::vector<RayMap> maps;  ///< one that is there twice counts once
    /// Of each of Scene::materials, a unit of length; may be shorter, what is missing is 0.
    std::vector<double> attenuation{};
    /// kOverlap: of each of Scene::nodes whether it belongs to the part.
    std::array<std::vector<char>, 2> parts{};
};

struct RayMapChannel {
    RayMap map = RayMap::kFirst;
    std::string name;  ///< of the EXR channel: "thickness", "path.steel"
};

/// What evaluating a ray needs room for: one for each thread.
struct RayMapScratch {
    SolidSpans spans;
    std::vector<float> t;
    std::vector<RayInterval> inside, other;
    std::vector<SolidSpan> open;
    std::vector<double> paths;   ///< by path channel
    std::vector<float> values;   ///< of the ray
    std::vector<float> nothing;  ///< values of a ray without hits
};

/// Evaluates maps of a scene. Lengths are in scene units, along the ray.
///
/// At every point inside of solids the material is that of the innermost one: of those that the ray
/// is inside of, the one that it entered last, as the triangle says through which it came in. Path
/// lengths therefore add up to the thickness. Transmission is exp(−Σ μ·L) over the path lengths L
/// (Bouguer, Lambert, Beer).
class RayMaps {
  public:
    /// `solids` may be null if no map needs them, and must outlive this.
    RayMaps(const PosedScene& posed, const Solids* solids, RayMapSettings settings);

    /// In the order of the settings; kPathLength has one for each material that a solid of the
    /// scene has. Names are unique.
    const std::vector<RayMapChannel>& channels() const { return channels_; }

    /// `out` takes a number a channel. `t` and `keys` as SolidSpans takes them.
    void evaluate(std::span<const float> t, std::span<const std::uint32_t> keys,
                  RayMapScratch& scratch, std::span<float> out) const;

    /// The rays of rows [y0, y1) of a band: `planes` is overwritten with a plane of numbers a
    /// channel, one after the other.
    void evaluateRows(const Bundle& bundle, const LayeredImage& band, int y0, int y1,
                      std::vector<float>& planes) const;

  private:
    void findPaths(RayMapScratch& scratch) const;

    const Solids* solids_;
    RayMapSettings settings_;
    std::vector<RayMapChannel> channels_;
    std::vector<std::size_t> path_materials_;  ///< of each path channel
    std::vector<std::size_t> path_of_;         ///< the inverse
    bool needs_spans_ = false, needs_paths_ = false;
    mutable ObjectPool<RayMapScratch> scratch_;
};

}  // namespace peeler
