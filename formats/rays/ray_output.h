// SPDX-License-Identifier: Apache-2.0
// Outputs of traced bundles: arrays, points, deep images, maps, voxels. A new kind of output is one
// new file.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/channels.h>
#include <peeler/layered_image.h>
#include <peeler/output_options.h>
#include <peeler/sink.h>
#include "core/rays/ray_maps.h"
#include "core/rays/solids.h"
#include "core/scene/posed_scene.h"
#include "formats/file/size_forecast.h"

namespace peeler {

/// Statistics of one map channel of a bundle, in the units of the map.
struct RayMapStatistics {
    std::string name;                           ///< of the channel
    std::optional<double> least{}, greatest{};  ///< finite values only
    double sum = 0;                             ///< finite values only
    std::optional<double> volume{};  ///< of lengths along parallel rays, scene units cubed
};
/// The maps of a bundle: its name, their file, and their channels.
struct RayMapResult {
    std::string bundle, path;
    std::vector<RayMapStatistics> channels;
};
struct VoxelResult {
    std::string path;
    glm::ivec3 cells{0};
    double spacing = 0;          ///< cell size, scene units
    std::uint64_t occupied = 0;  ///< cells inside
    std::uint64_t disputed = 0;  ///< cells on which the rays disagree
    double volume = 0;           ///< of the cells inside, scene units cubed
};
/// Number of hits found next to points, over all directions.
struct NextHitsResult {
    std::uint64_t points = 0, before = 0, after = 0;
    std::uint64_t beside_bundles = 0;  ///< points that no ray of a bundle passes
};

/// Results of a finished output; the kind of output decides which exist.
struct RayResults {
    std::vector<RayMapResult> maps;
    std::optional<VoxelResult> voxels;
    std::optional<NextHitsResult> next_hits;
};

/// Returns the total number of rays in the bundles.
std::uint64_t raysOf(std::span<const Bundle> bundles);

/// Takes bundle after bundle, each band by band, top to bottom. An output destroyed before finish()
/// leaves no file.
class RayOutput {
  public:
    virtual ~RayOutput() = default;
    /// Returns the channels required for every hit besides t and key, in table order.
    virtual std::vector<Channel> channels() const { return {}; }
    /// Whether begin() requires the number of hits, which takes an additional count pass.
    virtual bool needsHits() const { return false; }
    /// Returns the total size of all files; call it before begin(), with the same arguments.
    /// Returns 0 for an output without a file. Throws like begin() as far as errors are known
    /// already.
    virtual SizeForecast forecast(std::span<const Bundle>, std::span<const std::uint64_t>) const {
        return {};
    }
    /// `hits[i]` is the number of hits of bundle i; empty unless needsHits(). Throws Error
    /// (kOutput) if the file cannot be created.
    virtual void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) = 0;
    /// Takes the hits of some rows of bundle i: z is camera Z (Bundle::tScale converts it to t),
    /// extra[0] has the keys (kKeyChannel), followed by channels(), possibly among others.
    virtual void take(std::size_t bundle, const LayeredImage& band) = 0;
    virtual void finish() = 0;
    virtual RayResults results() const { return {}; }
    /// Returns the memory while it takes that bundle, as in Sink::memory(); also valid before
    /// begin().
    virtual SinkMemory memory(const Bundle&) const { return {}; }
};

struct HitOptions {
    PosedScene posed;
    Provenance provenance;          ///< image headers; arrays: the output hash
    std::string comment{};          ///< point clouds: one line
    bool double_positions = false;  ///< point clouds: 64 bits instead of 32
    /// Arrays and point clouds: names of hitColumns() (hit_columns.h); none = all.
    std::vector<std::string> columns{};
    /// Arrays: planes instead of lists.
    std::optional<DenseSettings> dense{};
};

/// Returns an output of every hit of every ray, chosen by extension:
/// - .npz, .safetensors: ray_splits, the columns of hitColumns() (hit_columns.h) and the bundles;
///   see formats/README.md. With planes (DensePlanes, with the number of layers in the settings)
///   the columns are (h, w, layers, …), for several bundles (b, h, w, layers, …), and `count` ((b,)
///   h, w; uint32) replaces ray_splits. No count pass is needed. begin() and forecast() throw Error
///   (kUsage) if bundles have different sizes.
/// - .ply: a binary point cloud, one point per hit: x y z, the columns, and the bundle's number.
/// - .exr: one deep part per bundle, with views from withCommonDisplay().
/// Throws Error (kUsage) if the path has any other extension.
std::unique_ptr<RayOutput> makeHitOutput(const std::string& path, const HitOptions& options);
/// Throws Error (kUsage) unless makeHitOutput() knows the extension of the path.
void checkHitFormat(const std::string& path);

/// Returns an output of the hits before and after points: arrays for d parallel bundles and n
/// points, with `t_before`, `t_after` (d, n; float, scene units, inf = no hit),
/// `geometry_ids_before`, `geometry_ids_after`, `primitive_ids_before`, `primitive_ids_after` (d,
/// n; uint32, 0xFFFFFFFF = no hit, Open3D's INVALID_ID), `points` (n, 3; world space) and
/// `directions` (d, 3; unit vectors), double. Bundles are written one by one, so it takes 32 bytes
/// per point for any number of bundles.
std::unique_ptr<RayOutput> makeNextHitOutput(std::string path, const PosedScene& posed,
                                             std::vector<glm::dvec3> points);

struct RayMapOptions {
    RayMapSettings settings;
    std::optional<std::pair<double, double>> range;  ///< pictures: black and the brightest colour
    Provenance provenance;
    bool legend = false;  ///< pictures: a legend below the map
};

/// Returns an output of maps, which have one value per ray. EXR: one part per bundle, with its
/// name; one channel per map, or for path-length per material. .npz, .safetensors: the same as
/// arrays (h, w; float, count: uint32), "MAP.I" for bundle I, and bundleArrays(). PNG, JPEG, TIFF:
/// one map, one file per bundle; for several bundles the path has a placeholder for the number
/// ("####").
///
/// Without a range the colours of a picture go from 0 (first and last: from the least value) to the
/// greatest value of its bundle, whose values are kept until then, 4 bytes per ray. Transmission
/// goes from 0 to 1 and looks like an X-ray film: full transmission is black, none is white. Where
/// there is no hit, first and last are transparent. With attenuation, path lengths come with the
/// transmission, and a picture shows the transmission.
///
/// `solids` may be null if no map needs them (needsSolids()). All references must outlive the
/// output. Pictures of finished bundles have their final names before finish(). Throws Error
/// (kUsage) if maps do not fit the format or lack their inputs.
std::unique_ptr<RayOutput> makeRayMapOutput(const std::string& path, const PosedScene& posed,
                                            const Solids* solids, RayMapOptions options);

/// Whether one of the maps requires nested solids.
bool needsSolids(std::span<const RayMap> maps);

/// Returns an output that takes the three bundles of `lattice` and writes which cell centres lie
/// inside a solid, by the majority of the three axes.
///
/// .npz, .safetensors: `occupancy` (uint8, 0 or 1; shape (nx, ny, nz), so that occupancy[x, y, z]
/// is the cell at corner + (x, y, z) · spacing), `votes` (uint8, same shape: the number of axes
/// that found the cell inside), `corner` (double, 3: least corner of the first cell, world space),
/// `spacing` (double, scene units). .vdb: see formats/arrays/vdb_writer.h; `creator` is stored in
/// it.
///
/// Keeps three bits per cell, and for .vdb OpenVDB's memory. `solids` must outlive the output.
/// Throws Error (kUsage) unless the path has one of these extensions, and Error (kMemory) if the
/// cells do not fit in memory.
std::unique_ptr<RayOutput> makeVoxelOutput(std::string path, const Solids& solids,
                                           AxisBundles lattice, std::string creator);

}  // namespace peeler
