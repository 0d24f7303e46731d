// SPDX-License-Identifier: Apache-2.0
// Outputs of traced bundles: arrays, points, deep images, maps, voxels. Each kind of output has its
// own source file.
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

/// The statistics of a map channel over a bundle, in the map's units.
struct RayMapStatistics {
    std::string name;
    std::optional<double> least{}, greatest{};  ///< minimum and maximum of the finite values
    double sum = 0;                             ///< sum of the finite values
    /// Volume, in cubic scene units: the integral of lengths over parallel rays.
    std::optional<double> volume{};
};
/// The maps of a bundle. `bundle` is the bundle's name, `path` is the maps' file.
struct RayMapResult {
    std::string bundle, path;
    std::vector<RayMapStatistics> channels;
};
struct VoxelResult {
    std::string path;
    glm::ivec3 cells{0};
    double spacing = 0;          ///< side of a cell, in scene units
    std::uint64_t occupied = 0;  ///< number of cells inside solids
    std::uint64_t disputed = 0;  ///< number of cells on which the three axes disagree
    double volume = 0;           ///< volume of the occupied cells, in cubic scene units
};
/// Numbers of hits before and after points, summed over all directions.
struct NextHitsResult {
    std::uint64_t points = 0, before = 0, after = 0;
    std::uint64_t beside_bundles = 0;  ///< number of points without a ray, summed over the bundles
};

/// The results of a finished output. The kind of output decides which members have values.
struct RayResults {
    std::vector<RayMapResult> maps;
    std::optional<VoxelResult> voxels;
    std::optional<NextHitsResult> next_hits;
};

/// Returns the total number of rays in the bundles.
std::uint64_t raysOf(std::span<const Bundle> bundles);

/// An output that receives one bundle after another, each in bands from top to bottom. Leaves no
/// file if destroyed before finish().
class RayOutput {
  public:
    virtual ~RayOutput() = default;
    /// Returns the channels that every hit needs besides t and key, in the order of the channel
    /// table.
    virtual std::vector<Channel> channels() const { return {}; }
    /// Whether begin() needs the number of hits. Counting takes an additional pass.
    virtual bool needsHits() const { return false; }
    /// Forecasts the total size of all files; 0 for an output without a file. Takes the arguments
    /// of begin() and must be called before it. Throws the errors of begin() that are already
    /// known.
    virtual SizeForecast forecast(std::span<const Bundle>, std::span<const std::uint64_t>) const {
        return {};
    }
    /// `hits[i]` is the number of hits of bundle i; `hits` is empty unless needsHits(). Throws
    /// Error (kOutput) if the file cannot be created.
    virtual void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) = 0;
    /// Receives the hits of some rows of a bundle. `z` is camera Z (Bundle::tScale converts it to
    /// t), extra[0] has the keys (kKeyChannel), and the remaining arrays include channels().
    virtual void take(std::size_t bundle, const LayeredImage& band) = 0;
    virtual void finish() = 0;
    virtual RayResults results() const { return {}; }
    /// Returns the memory needed while the bundle is received, as in Sink::memory(). May be called
    /// before begin().
    virtual SinkMemory memory(const Bundle&) const { return {}; }
};

struct HitOptions {
    PosedScene posed;
    Provenance provenance;  ///< for image headers; arrays store only the output hash
    std::string comment{};  ///< for point clouds: one line
    /// Whether positions in point clouds have 64 bits instead of 32.
    bool double_positions = false;
    /// Arrays and point clouds: names of hitColumns() (hit_columns.h); if empty, those by default.
    std::vector<std::string> columns{};
    std::vector<Bundle> bundles{};  ///< those of begin()
    /// For arrays: if set, planes are written instead of lists.
    std::optional<DenseSettings> dense{};
};

/// Returns an output that stores every hit of every ray. The extension chooses the format:
/// - .npz, .safetensors: ray_splits, the columns of hitColumns() (hit_columns.h) and the bundles;
///   see formats/README.md. With planes (DensePlanes, with the number of layers in the settings)
///   the columns are (h, w, layers, …), or (b, h, w, layers, …) for several bundles, and `count`
///   ((b,) h, w; uint32) replaces ray_splits. Planes need no counting pass. begin() and
///   forecast() throw Error (kUsage) if bundles differ in size.
/// - .ply: a binary point cloud, one point per hit: x y z, the columns, and the bundle's number.
/// - .exr: a deep part for each bundle, with views from withCommonDisplay(). If a bundle has a
/// lens,
///   the channel cameraZ has camera Z, since Z is the distance.
/// Throws Error (kUsage) if the path has any other extension, or if a chosen column has no meaning
/// for a bundle.
std::unique_ptr<RayOutput> makeHitOutput(const std::string& path, const HitOptions& options);
/// Throws Error (kUsage) if makeHitOutput() would refuse the path's extension.
void checkHitFormat(const std::string& path);

/// Returns an output that stores the hits before and after each point, as arrays for d parallel
/// bundles and n points: `t_before`, `t_after` (d, n; float, scene units, inf if there is no hit),
/// `geometry_ids_before`, `geometry_ids_after`, `primitive_ids_before`, `primitive_ids_after` (d,
/// n; uint32, 0xFFFFFFFF if there is no hit, as Open3D's INVALID_ID), `points` (n, 3; double,
/// world space) and `directions` (d, 3; double, unit vectors). Bundles are written one by one, so
/// the output takes 32 bytes of memory per point for any number of bundles.
std::unique_ptr<RayOutput> makeNextHitOutput(std::string path, const PosedScene& posed,
                                             std::vector<glm::dvec3> points);

struct RayMapOptions {
    RayMapSettings settings;
    /// Pictures: the values with the first and the last colour of the map's ramp.
    std::optional<std::pair<double, double>> range;
    Provenance provenance;
    bool legend = false;  ///< pictures: whether to draw a legend below the map
    /// The name and the length, in metres, of the legend's unit of length. If empty, the unit is a
    /// millimetre for ranges below a metre, else a metre.
    std::optional<std::pair<std::string, double>> unit;
};

/// Returns an output that stores maps, which have one value per ray. EXR: a part for each bundle,
/// with the bundle's name, and in it a channel for each map, or, for path-length, for each
/// material. .npz, .safetensors: an array for each of these channels (h, w; float, but uint32 for
/// count), called "MAP.I" for bundle I, and bundleArrays(). PNG, JPEG, TIFF: one map, with one file
/// per bundle; if there are several bundles, the path must have a placeholder for the bundle's
/// number ("####").
///
/// Without `range`, the colours of a picture go from 0 (for first and last: from the minimum) to
/// the maximum in the bundle. Until this range is known, the bundle's values are kept, 4 bytes per
/// ray. Transmission goes from 0 to 1 and looks like an X-ray film: full transmission is black,
/// zero transmission is white. For first and last, rays without a hit are transparent. With
/// attenuation, path-length also gives the transmission, and a picture shows the transmission
/// instead of the lengths.
///
/// `solids` may be null if no map needs nested solids (needsSolids()). All references must outlive
/// the output. Pictures of finished bundles get their final names even before finish(). Throws
/// Error (kUsage) if maps do not fit the format or lack their inputs.
std::unique_ptr<RayOutput> makeRayMapOutput(const std::string& path, const PosedScene& posed,
                                            const Solids* solids, RayMapOptions options);

/// Whether any of the maps needs nested solids.
bool needsSolids(std::span<const RayMap> maps);

/// Returns an output that receives the three bundles of `lattice` and stores which cells have their
/// centre inside a solid, by the majority of the three axes.
///
/// .npz, .safetensors: `occupancy` (uint8, 0 or 1; shape (nx, ny, nz), so that occupancy[x, y, z]
/// is the cell at corner + (x, y, z) · spacing), `votes` (uint8, same shape: the number of axes
/// along which the cell is inside), `corner` (double, 3: the least corner of the first cell, in
/// world space) and `spacing` (double, scene units). .vdb: see formats/arrays/vdb_writer.h; the
/// file records `creator`.
///
/// `overlap` defines the inside of solids. Keeps three bits per cell and, for .vdb, OpenVDB's
/// memory. `solids` must outlive the output. Throws Error (kUsage) if the path has another
/// extension, and Error (kMemory) if the cells do not fit into memory.
std::unique_ptr<RayOutput> makeVoxelOutput(std::string path, const Solids& solids,
                                           AxisBundles lattice, std::string creator,
                                           Overlap overlap = Overlap::kWinding);

}  // namespace peeler
