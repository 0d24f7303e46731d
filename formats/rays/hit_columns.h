// SPDX-License-Identifier: Apache-2.0
// Columns of hit arrays and hit point clouds, and the makers of the hit writers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/channels.h>
#include <peeler/layered_image.h>
#include "core/raster/surface_values.h"
#include "core/scene/posed_scene.h"
#include "formats/arrays/table_writers.h"
#include "formats/rays/ray_output.h"

namespace peeler {

/// The location of a hit in the scene.
struct HitPlace {
    std::uint32_t instance = 0;  ///< index into PosedScene::meshes()
    std::uint32_t in_mesh = 0;   ///< index among the mesh's triangles, across primitives
    std::uint32_t material = 0;  ///< index in the scene's file; 0xFFFFFFFF for the default material
};

/// The numbers that all hits of an instance share.
struct HitInstance {
    std::uint32_t node = 0, mesh = 0;
    std::uint32_t ordinal = 0;  ///< index among the instances of its node
};

/// Consecutive hits of a bundle, from which columns are computed. Each array except `instances` has
/// one entry per hit, or is empty if the band lacks the array's channel. The arrays are views of
/// other memory, and valid only during the call.
struct HitBatch {
    std::size_t first = 0;  ///< index of the batch's first hit in the band
    std::size_t size = 0;
    std::span<const float> t{};  ///< distance of each hit from the ray's origin, in scene units
    std::span<const float> camera_z{};        ///< camera Z, if requested, in scene units
    std::span<const glm::dvec3> positions{};  ///< world-space positions, if requested
    std::span<const HitPlace> places{};
    std::span<const HitInstance> instances{};  ///< indexed by HitPlace::instance
    std::span<const float> facing{};           ///< 1 if the ray meets the front, −1 if the back
    std::span<const glm::vec2> barycentrics{};
    /// In world space, on the side of the surface that the ray comes from.
    std::span<const glm::vec3> normals{}, geometric_normals{};
    std::span<const glm::vec4> base_colors{};  ///< SurfaceColors, if requested
};

/// A column: one quantity (a number or a vector) of every hit.
struct HitColumn {
    std::string_view name;
    NumberType type;
    std::vector<std::string_view> properties;  ///< names of the components in a point cloud
    std::vector<Channel> channels;             ///< channels that the column needs besides t and key
    /// Stores the column's values for all hits of the batch, each `stride` bytes after the previous
    /// one.
    void (*put)(const HitBatch& hits, std::byte* out, std::size_t stride);
    bool by_default = true;  ///< whether to write the column if no columns are named

    std::size_t components() const { return properties.size(); }
    std::size_t bytes() const { return components() * infoOf(type).size; }
};
/// Returns all columns: t_hit, geometry_ids, primitive_ids and primitive_uvs as in Open3D's
/// RaycastingScene.list_intersections(), primitive_normals as in RaycastingScene.cast_rays(), and
/// peeler's own. Fragment columns with the same meaning have the same names and numbers
/// (formats/arrays/fragment_columns.h).
std::span<const HitColumn> hitColumns();

/// Returns the columns with these names, in the order of the table. If `names` is empty, returns
/// those by default, but kCameraZColumn only if a bundle has a lens. Throws Error (kInternal) if
/// the table lacks a name, and Error (kUsage) if kCameraZColumn is named but a bundle has no camera
/// Z.
std::vector<HitColumn> chosenHitColumns(std::span<const std::string> names,
                                        std::span<const Bundle> bundles);

inline constexpr std::string_view kCameraZColumn = "z_hit", kBaseColorColumn = "base_color";

/// Whether a bundle has a lens. Z is then the distance, and hits have camera Z besides it.
bool haveLens(std::span<const Bundle> bundles);

/// Returns camera Z / Z on the ray of a pixel; 1 for a view without a lens.
double cameraZScale(const View& view, int x, int y);

/// Returns the channels that columns need, in the order of the channel table.
std::vector<Channel> channelsOf(std::span<const HitColumn> columns);

/// A converter from fragments to hits. Finds the hits' triangles by the keys of the fragments.
class HitReader {
  public:
    /// `positions`: whether to compute HitBatch::positions. Computes HitBatch::camera_z and
    /// base_colors if the columns need them.
    HitReader(PosedScene posed, std::span<const HitColumn> columns, bool positions = false);

    /// Calls use(batch) for batches that together hold all hits of a band, in any order and on all
    /// threads. Throws Error (kInternal) if channels are not 32-bit.
    void read(const Bundle& bundle, const LayeredImage& band,
              const std::function<void(const HitBatch&)>& use) const;
    /// Calls use(batch) once, on this thread, for the hits [first, first + size) of the band.
    void readSome(const Bundle& bundle, const LayeredImage& band, std::size_t first,
                  std::size_t size, const std::function<void(const HitBatch&)>& use) const;

    /// Returns the bytes that textures take.
    std::uint64_t mostBytes() const { return colors_ ? colors_->mostBytes() : 0; }

  private:
    /// Storage for the computed values of HitBatch.
    struct Storage {
        std::vector<HitPlace> places;
        std::vector<float> t, camera_z;
        std::vector<glm::dvec3> positions;
        std::vector<glm::vec4> base_colors;
    };
    void place(std::span<const std::uint32_t> keys, Storage& storage, HitBatch& hits) const;
    void measure(const Bundle& bundle, const LayeredImage& band, Storage& storage,
                 HitBatch& hits) const;

    PosedScene posed_;
    bool positions_, camera_z_;
    std::optional<SurfaceColors> colors_;  ///< for kBaseColorColumn
    std::vector<HitInstance> instances_;
    /// Material of each surface in DrawList::surfaces(), in the form of HitPlace::material.
    std::vector<std::uint32_t> materials_;
};

/// The outputs among which makeHitOutput() chooses: arrays (lists or planes), .ply and .exr.
std::unique_ptr<RayOutput> makeHitArrays(const std::string& path, const HitOptions& options);
std::unique_ptr<RayOutput> makeHitPlanes(const std::string& path, const HitOptions& options);
std::unique_ptr<RayOutput> makeHitPoints(const std::string& path, const HitOptions& options);
std::unique_ptr<RayOutput> makeHitImage(const std::string& path, const HitOptions& options);

}  // namespace peeler
