// SPDX-License-Identifier: Apache-2.0
// Columns of hit arrays and hit point clouds, and the factories of the hit writers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <peeler/bundle.h>
#include <peeler/channels.h>
#include <peeler/layered_image.h>
#include "core/scene/posed_scene.h"
#include "formats/arrays/table_writers.h"
#include "formats/rays/ray_output.h"

namespace peeler {

/// The place of a hit in the scene.
struct HitPlace {
    std::uint32_t instance = 0;  ///< index into PosedScene::meshes()
    std::uint32_t in_mesh = 0;   ///< triangle index in the whole mesh
    std::uint32_t material = 0;  ///< index in the scene's file, 0xFFFFFFFF = none
};

/// Properties shared by all hits of an instance.
struct HitInstance {
    std::uint32_t node = 0, mesh = 0;
    std::uint32_t ordinal = 0;  ///< among the instances of its node
};

/// Consecutive hits of a bundle, as input to columns. Each array has one entry per hit, or is empty
/// if the band lacks the channel. Refers to the band.
struct HitBatch {
    std::size_t first = 0;  ///< among the hits of the band
    std::size_t size = 0;
    std::span<const float> t{};               ///< distance from the ray origin, scene units
    std::span<const glm::dvec3> positions{};  ///< world space; only if requested
    std::span<const HitPlace> places{};
    std::span<const HitInstance> instances{};  ///< by HitPlace::instance
    std::span<const float> facing{};           ///< 1 = the ray meets the front, −1 = the back
    std::span<const glm::vec2> barycentrics{};
    /// World space, oriented toward the ray origin.
    std::span<const glm::vec3> normals{}, geometric_normals{};
};

/// A column: one or several numbers per hit.
struct HitColumn {
    std::string_view name;  ///< of the array
    NumberType type;
    std::vector<std::string_view> properties;  ///< names in a point cloud, one per component
    std::vector<Channel> channels;             ///< required besides t and key
    /// Stores the numbers of consecutive hits, `stride` bytes apart.
    void (*put)(const HitBatch& hits, std::byte* out, std::size_t stride);

    std::size_t components() const { return properties.size(); }
    std::size_t bytes() const { return components() * infoOf(type).size; }
};
/// Returns the columns: t_hit, geometry_ids, primitive_ids and primitive_uvs as in Open3D's
/// RaycastingScene.list_intersections(), primitive_normals as in its cast_rays(), and our own.
/// Fragment columns with the same meaning have the same names and numbers
/// (formats/arrays/fragment_columns.h).
std::span<const HitColumn> hitColumns();

/// Returns the columns of these names, in table order; all columns if there are no names. Throws
/// Error (kInternal) if the table lacks a name.
std::vector<HitColumn> chosenHitColumns(std::span<const std::string> names);

/// Returns the channels required by columns, in the order of the channel table.
std::vector<Channel> channelsOf(std::span<const HitColumn> columns);

/// Reader that turns fragments into hits by resolving their keys.
class HitReader {
  public:
    /// `positions`: whether to compute HitBatch::positions.
    explicit HitReader(PosedScene posed, bool positions = false);

    /// Calls use(batch) for all hits of a band, several thousand at a time, in any order and on all
    /// threads. Throws Error (kInternal) if channels are not 32-bit.
    void read(const Bundle& bundle, const LayeredImage& band,
              const std::function<void(const HitBatch&)>& use) const;
    /// Calls use(batch) once for `size` hits of the band from `first` on, on this thread.
    void readSome(const Bundle& bundle, const LayeredImage& band, std::size_t first,
                  std::size_t size, const std::function<void(const HitBatch&)>& use) const;

  private:
    /// Storage of computed columns.
    struct Storage {
        std::vector<HitPlace> places;
        std::vector<float> t;
        std::vector<glm::dvec3> positions;
    };
    void place(std::span<const std::uint32_t> keys, Storage& storage, HitBatch& hits) const;
    void measure(const Bundle& bundle, const LayeredImage& band, Storage& storage,
                 HitBatch& hits) const;

    PosedScene posed_;
    bool positions_;
    std::vector<HitInstance> instances_;
    std::vector<std::uint32_t> materials_;  ///< by DrawList::surfaces(), as in HitPlace
};

/// Return the outputs of makeHitOutput() for arrays (lists and planes), .ply and .exr.
std::unique_ptr<RayOutput> makeHitArrays(const std::string& path, const HitOptions& options);
std::unique_ptr<RayOutput> makeHitPlanes(const std::string& path, const HitOptions& options);
std::unique_ptr<RayOutput> makeHitPoints(const std::string& path, const HitOptions& options);
std::unique_ptr<RayOutput> makeHitImage(const std::string& path, const HitOptions& options);

}  // namespace peeler
