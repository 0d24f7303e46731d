// SPDX-License-Identifier: Apache-2.0
// Ray maps: one or several values per ray, computed from all of its hits.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/layered_image.h>
#include "core/base/parallel.h"
#include "core/raster/surface_values.h"
#include "core/rays/solids.h"

namespace peeler {

/// A kind of value computed per ray; rayMapTable() describes each.
enum class RayMap : std::uint8_t {
    kFirst,
    kLast,
    kCount,
    kThickness,
    kPathLength,
    kTransmission,
    kParity,
    kOverlap,
    kBaseColor
};

/// A ray with all inputs of the maps. Defined in ray_maps.cpp.
struct MappedRay;

/// A row of the table of maps.
struct RayMapInfo {
    RayMap map;
    /// Name in options. Also the channel's name, except for kPathLength and kBaseColor.
    std::string_view name;
    std::string_view summary;
    PixelType type;  ///< kFloat or kUint
    /// Writes the map's value for a ray; for kPathLength, one value per material, for kBaseColor R,
    /// G, B and A.
    void (*evaluate)(const MappedRay& ray, float* out);
    bool solids = false;  ///< whether the map needs to know the inside of solids
    bool nested = false;  ///< whether the map needs to know how solids are nested
    /// Whether the value is a length. The sum of lengths over parallel rays gives a volume.
    bool length = false;
};

/// Returns the table, in the order of RayMap. A ray without hits gets 0, except for kFirst and
/// kLast (+inf) and kTransmission (1).
std::span<const RayMapInfo> rayMapTable();

inline const RayMapInfo& infoOf(RayMap map) {
    return rayMapTable()[static_cast<std::size_t>(map)];
}

struct RayMapSettings {
    std::vector<RayMap> maps;  ///< maps to compute; duplicates are ignored
    /// Attenuation coefficients of Scene::materials, per scene unit of length; 0 for materials
    /// beyond the end of the list.
    std::vector<double> attenuation{};
    /// The two parts that kOverlap compares. Each vector says for every element of Scene::nodes
    /// whether the node belongs to the part.
    std::array<std::vector<char>, 2> parts{};
    Overlap overlap = Overlap::kWinding;
};

struct RayMapChannel {
    RayMap map = RayMap::kFirst;
    std::string name;  ///< name of the EXR channel, such as "thickness" or "path.steel"
};

/// Scratch storage for the evaluation of rays. Each thread needs its own.
struct RayMapScratch {
    SolidSpans spans;
    std::vector<float> t;
    std::vector<RayInterval> inside, other;
    std::vector<SolidSpan> open;
    std::vector<double> paths;      ///< path length of each path channel
    std::vector<glm::vec4> colors;  ///< of the ray's hits, for kBaseColor (SurfaceColors)
    std::vector<float> values;
    std::vector<float> nothing;  ///< values of a ray without hits
};

/// An evaluator of a scene's maps. Lengths are in scene units, along the ray.
///
/// Inside solids, the material of a point is the material of the triangle at which the ray entered
/// the innermost solid. So path lengths add up to the thickness. Transmission is exp(−Σ μ·L) over
/// the path lengths L (Beer–Lambert law).
class RayMaps {
  public:
    /// `solids` must outlive this object. It may be null if no map needs solids.
    RayMaps(const PosedScene& posed, const Solids* solids, RayMapSettings settings);

    /// Returns the channels in the order of the settings. kPathLength has a channel for each
    /// material on a solid of the scene, kBaseColor has R, G, B and A. Names are unique.
    const std::vector<RayMapChannel>& channels() const { return channels_; }

    /// Begins a bundle, to which all rays belong until the next call. Before the first call, parity
    /// decides the inside of solids.
    void begin(const Bundle& bundle);
    /// Returns the bytes that begin() and textures take.
    std::uint64_t mostBytes() const {
        return (needs_solids_ ? solids_->sidesBytes(settings_.overlap) : 0) +
               (surface_colors_ ? surface_colors_->mostBytes() : 0);
    }

    /// Writes one value per channel to `out`. `t`, `keys` and `along` are as for
    /// SolidSpans::find(); kBaseColor uses scratch.colors.
    void evaluate(std::span<const float> t, std::span<const std::uint32_t> keys,
                  RayMapScratch& scratch, std::span<float> out, const Ray* along = nullptr) const;

    /// Evaluates the rays of rows [y0, y1) of a band. Overwrites `planes` with one plane of values
    /// per channel, one after the other.
    void evaluateRows(const Bundle& bundle, const LayeredImage& band, int y0, int y1,
                      std::vector<float>& planes) const;

  private:
    void prepare(std::span<const std::uint32_t> keys, RayMapScratch& scratch,
                 const Ray* along) const;
    /// Evaluates the ray with the hits from `first` on of those prepared.
    void evaluate(std::span<const float> t, std::span<const std::uint32_t> keys, std::size_t first,
                  RayMapScratch& scratch, std::span<float> out) const;
    void findPaths(RayMapScratch& scratch) const;

    const Solids* solids_;
    RayMapSettings settings_;
    std::vector<RayMapChannel> channels_;
    std::vector<std::size_t> path_materials_;      ///< index into Scene::materials, by path channel
    std::vector<std::size_t> path_of_;             ///< path channel, by index into Scene::materials
    std::optional<TriangleSides> sides_;           ///< of the current bundle
    std::optional<SurfaceColors> surface_colors_;  ///< for kBaseColor
    bool needs_solids_ = false, needs_spans_ = false, needs_paths_ = false;
    mutable ObjectPool<RayMapScratch> scratch_;
};

}  // namespace peeler
