// SPDX-License-Identifier: Apache-2.0
// What becomes of the hits of traced bundles: arrays, points, deep images, maps, voxels. A new kind
// of output is one new file.
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

/// Statistics of a channel of the map of a bundle, in the units of the map.
struct RayMapStatistics {
    std::string name;                           ///< of the channel
    std::optional<double> least{}, greatest{};  ///< of the finite values, if there are any
    double sum = 0;                             ///< of the finite values
    std::optional<double> volume{};  ///< of lengths along parallel rays, scene units cubed
};
/// The maps of a bundle: its name, the file that they are in, and their channels.
struct RayMapResult {
    std::string bundle, path;
    std::vector<RayMapStatistics> channels;
};
struct VoxelResult {
    std::string path;
    glm::ivec3 cells{0};
    double spacing = 0;          ///< side of a cell, scene units
    std::uint64_t occupied = 0;  ///< cells inside
    std::uint64_t disputed = 0;  ///< cells of which the rays disagree
    double volume = 0;           ///< of the cells inside, scene units cubed
};
/// How many hits were found next to points, over all directions.
struct NextHitsResult {
    std::uint64_t points = 0, before = 0, after = 0;
    std::uint64_t beside_bundles = 0;  ///< points that no ray of a bundle passes
};

/// What an output knows when it is finished; which of these depends on its kind.
struct RayResults {
    std::vector<RayMapResult> maps;
    std::optional<VoxelResult> voxels;
    std::optional<NextHitsResult> next_hits;
};

/// How many rays the bundles have together.
std::uint64_t raysOf(std::span<const Bundle> bundles);

/// Takes bundle after bundle, each band by band, top to bottom. An output that is destroyed before
/// finish() leaves no file behind.
class RayOutput {
  public:
    virtual ~RayOutput() = default;
    /// The channels that it needs of every hit besides t and key, in the order of the table.
    virtual std::vector<Channel> channels() const { return {}; }
    /// Whether begin() has to be told how many hits there are, which takes a count pass more.
    virtual bool needsHits() const { return false; }
    /// How large all of its files will be together; of the same arguments as begin(), which it goes
    /// before. 0 of an output without a file. Throws like begin() for what can be known already.
    virtual SizeForecast forecast(std::span<const Bundle>, std::span<const std::uint64_t>) const {
        return {};
    }
    /// `hits[i]` is the number of hits of bundle i; empty unless needsHits(). Throws Error
    /// (kOutput) if the file cannot be created.
    virtual void begin(std::span<const Bundle> bundles, std::span<const std::uint64_t> hits) = 0;
    /// Takes the hits of some rows of bundle i: z is camera Z (Bundle::tScale makes it t), extra[0]
    /// the keys (kKeyChannel), then channels(), perhaps among others.
    virtual void take(std::size_t bundle, const LayeredImage& band) = 0;
    virtual void finish() = 0;
    virtual RayResults results() const { return {}; }
    /// What it holds while it takes that bundle, as Sink::memory() says it; before begin(), too.
    virtual SinkMemory memory(const Bundle&) const { return {}; }
};

struct HitOptions {
    PosedScene posed;
    Provenance provenance;          ///< of an image's headers; of arrays the output hash
    std::string comment{};          ///< of a point cloud: one line
    bool double_positions = false;  ///< of a point cloud: 64 bits, not 32
    /// Names of hitColumns() (hit_columns.h); none = all. Of arrays and point clouds.
    std::vector<std::string> columns{};
    /// Of arrays: planes, not lists.
    std::optional<DenseSettings> dense{};
};

/// An output of every hit of every ray, by the extension:
/// - .npz, .safetensors: ray_splits, the columns of hitColumns() (hit_columns.h) and the bundles;
///   formats/README.md says more. Of planes (DensePlanes, of as many layers as the settings say)
///   the columns are (h, w, layers, …), of several bundles (b, h, w, layers, …), and in place of
///   ray_splits there is `count` ((b,) h, w; uint32). No hits need be counted first. begin() and
///   forecast() throw Error (kUsage) if bundles have different sizes.
/// - .ply: a binary point cloud, a point a hit: x y z, the columns, and the number of its bundle.
/// - .exr: a deep part a bundle, of views withCommonDisplay().
/// Throws Error (kUsage) for any other extension.
std::unique_ptr<RayOutput> makeHitOutput(const std::string& path, const HitOptions& options);
/// Throws Error (kUsage) unless makeHitOutput() knows the extension of the path.
void checkHitFormat(const std::string& path);

/// An output of the hits next to points, before and after them: arrays of d parallel bundles and n
/// points, with `t_before`, `t_after` (d, n; float, scene units, inf = no hit),
/// `geometry_ids_before`, `geometry_ids_after`, `primitive_ids_before`, `primitive_ids_after` (d,
/// n; uint32, 0xFFFFFFFF = no hit, Open3D's INVALID_ID), `points` (n, 3; world space) and
/// `directions` (d, 3; unit vectors), double. Bundle after bundle is written; what is found takes
/// 32 bytes a point, however many bundles there are.
std::unique_ptr<RayOutput> makeNextHitOutput(std::string path, const PosedScene& posed,
                                             std::vector<glm::dvec3> points);

struct RayMapOptions {
    RayMapSettings settings;
    std::optional<std::pair<double, double>> range;  ///< pictures: black and the brightest colour
    Provenance provenance;
    bool legend = false;  ///< pictures: below the map, what its colours are
};

/// An output of maps, which are numbers for every ray. EXR: a part a bundle, with its name; a
/// channel a map, or, of path-length, a material. .npz, .safetensors: the same as arrays (h, w;
/// float, of count uint32), "MAP.I" of bundle I, and bundleArrays(). PNG, JPEG, TIFF: one map, a
/// file a bundle: of several bundles the path has a place for the number ("####"). Without a range
/// the colours of a picture go from 0 (of first and last: the least value) to the greatest value of
/// its bundle, and all its values are kept until then, 4 bytes a ray; those of transmission go from
/// 0 to 1, and it is shown like a film: what lets all through is black, what lets nothing through
/// white. Where there is no hit, first and last are transparent. If there is attenuation, path
/// lengths come with the transmission; a picture then shows the transmission.
///
/// `solids` may be null if no map needs them (needsSolids()). Everything referred to must outlive
/// the output. Pictures of bundles that are done stand under their names before finish(). Throws
/// Error (kUsage) for maps that do not fit the format or lack what they need.
std::unique_ptr<RayOutput> makeRayMapOutput(const std::string& path, const PosedScene& posed,
                                            const Solids* solids, RayMapOptions options);

/// Whether one of the maps needs to know what is inside of what.
bool needsSolids(std::span<const RayMap> maps);

/// An output that takes the three bundles of `lattice` and writes which cells' centres are inside
/// of some solid, by the majority of the three axes.
///
/// .npz, .safetensors: `occupancy` (uint8, 0 or 1; shape (nx, ny, nz), so that occupancy[x, y, z]
/// is the cell at corner + (x, y, z) · spacing), `votes` (uint8, likewise: how many axes found it
/// inside), `corner` (double, 3: least corner of the first cell, world space), `spacing` (double,
/// scene units). .vdb: see formats/arrays/vdb_writer.h; `creator` stands in it.
///
/// Three bits a cell are kept, and for .vdb what OpenVDB takes. `solids` must outlive the output.
/// Throws Error (kUsage) unless the path ends in one of these, and (kMemory) if there is no room
/// for the cells.
std::unique_ptr<RayOutput> makeVoxelOutput(std::string path, const Solids& solids,
                                           AxisBundles lattice, std::string creator);

}  // namespace peeler
