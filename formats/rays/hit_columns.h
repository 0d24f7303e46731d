// SPDX-License-Identifier: Apache-2.0
// What the writers of hits share: the columns of arrays and point clouds, and the function that
// makes each writer.
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

/// Where a hit is in the scene.
struct HitPlace {
    std::uint32_t instance = 0;  ///< index into PosedScene::meshes()
    std::uint32_t in_mesh = 0;   ///< which triangle of the whole mesh
    std::uint32_t material = 0;  ///< index into those of the scene's file, 0xFFFFFFFF = none
};

/// What all hits of an instance share.
struct HitInstance {
    std::uint32_t node = 0, mesh = 0;
    std::uint32_t ordinal = 0;  ///< among the instances of its node
};

/// Hits of a bundle that follow one another, as columns take them: each array has one entry a hit,
/// or none at all if the band lacks the channel. Refers to the band.
struct HitBatch {
    std::size_t first = 0;  ///< among the hits of the band
    std::size_t size = 0;
    std::span<const float> t{};               ///< distance from where the ray starts, scene units
    std::span<const glm::dvec3> positions{};  ///< world space; if they are wanted
    std::span<const HitPlace> places{};
    std::span<const HitInstance> instances{};  ///< by HitPlace::instance
    std::span<const float> facing{};           ///< 1 = the ray meets the front, −1 = the back
    std::span<const glm::vec2> barycentrics{};
    /// World space, toward where the ray comes from.
    std::span<const glm::vec3> normals{}, geometric_normals{};
};

/// A column: one or several numbers of every hit.
struct HitColumn {
    std::string_view name;  ///< of the array
    NumberType type;
    std::vector<std::string_view> properties;  ///< names in a point cloud, one a component
    std::vector<Channel> channels;             ///< that it is made of, besides t and key
    /// Stores the numbers of hit after hit, `stride` bytes from one's to the next one's.
    void (*put)(const HitBatch& hits, std::byte* out, std::size_t stride);

    std::size_t components() const { return properties.size(); }
    std::size_t bytes() const { return components() * infoOf(type).size; }
};
/// The columns: t_hit, geometry_ids, primitive_ids and primitive_uvs as Open3D's
/// RaycastingScene.list_intersections() has them, primitive_normals as its cast_rays(), and our
/// own. Columns of fragments that mean the same have the same names and numbers
/// (formats/arrays/fragment_columns.h).
std::span<const HitColumn> hitColumns();

/// The columns of these names, in the order of the table; all of them if there is no name. Throws
/// Error (kInternal) for a name that the table lacks.
std::vector<HitColumn> chosenHitColumns(std::span<const std::string> names);

/// The channels that columns are made of, in the order of their table.
std::vector<Channel> channelsOf(std::span<const HitColumn> columns);

/// Makes hits of fragments, by looking up what their keys stand for.
class HitReader {
  public:
    /// `positions`: whether HitBatch::positions are wanted.
    explicit HitReader(PosedScene posed, bool positions = false);

    /// Calls use(batch) for all hits of a band, some thousands at once, in any order and on all
    /// threads. Throws Error (kInternal) if channels are not in 32 bits.
    void read(const Bundle& bundle, const LayeredImage& band,
              const std::function<void(const HitBatch&)>& use) const;
    /// Calls use(batch) for `size` hits of the band from `first` on, all at once, on this thread.
    void readSome(const Bundle& bundle, const LayeredImage& band, std::size_t first,
                  std::size_t size, const std::function<void(const HitBatch&)>& use) const;

  private:
    /// What a batch has that the band does not.
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
    std::vector<std::uint32_t> materials_;  ///< of DrawList::surfaces(), as HitPlace has them
};

/// The outputs of makeHitOutput() for arrays, .ply and .exr.
std::unique_ptr<RayOutput> makeHitArrays(const std::string& path, const HitOptions& options);
std::unique_ptr<RayOutput> makeHitPlanes(const std::string& path, const HitOptions& options);
std::unique_ptr<RayOutput> makeHitPoints(const std::string& path, const HitOptions& options);
std::unique_ptr<RayOutput> makeHitImage(const std::string& path, const HitOptions& options);

}  // namespace peeler
