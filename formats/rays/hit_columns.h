// SPDX-License-Identifier: Apache-2.0
// What the writers of hits share: the columns of arrays and point clouds, and the function that
// makes each writer.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/image/channels.h"
#include "core/image/layered_image.h"
#include "core/rays/bundle.h"
#include "core/scene/posed_scene.h"
#include "formats/arrays/table_writers.h"
#include "formats/rays/ray_output.h"

namespace peeler {

struct Hit {
    double t = 0;            ///< distance from where the ray starts, scene units
    glm::dvec3 position{0};  ///< world space
    KeyOrigin origin;
    const MeshInstance* instance = nullptr;
    const Primitive* primitive = nullptr;
    std::uint32_t material = 0;  ///< index into those of the scene's file, 0xFFFFFFFF = none
    std::uint32_t ordinal = 0;   ///< of the instance among those of its node
    std::array<float, 2> barycentric{};
    float facing = 1;                          ///< 1 = the ray meets the front, −1 = the back
    glm::vec3 normal{0}, geometric_normal{0};  ///< world space, on the front's side
    std::uint32_t bundle = 0;                  ///< number of the bundle
};

/// A column: one or several numbers of every hit.
struct HitColumn {
    std::string_view name;  ///< of the array
    NumberType type;
    std::vector<std::string_view> properties;  ///< names in a point cloud, one a component
    void (*put)(const Hit&, std::byte* out);

    std::size_t components() const { return properties.size(); }
    std::size_t bytes() const { return components() * infoOf(type).size; }
};
/// The columns: t_hit, geometry_ids, primitive_ids and primitive_uvs as Open3D's
/// RaycastingScene.list_intersections() has them, primitive_normals as its cast_rays(), and our
/// own. Columns of fragments that mean the same have the same names and numbers
/// (formats/arrays/fragment_columns.h).
std::span<const HitColumn> hitColumns();

/// The channels that HitReader needs of every fragment.
std::vector<Channel> hitChannels();

/// Makes hits of fragments, by looking up what their keys stand for.
class HitReader {
  public:
    explicit HitReader(PosedScene posed);

    /// Calls use(hits) for all of a band, in order, some rows at a time, so that memory is bounded.
    void read(const Bundle& bundle, std::size_t index, const LayeredImage& band,
              const std::function<void(std::span<const Hit>)>& use);

  private:
    PosedScene posed_;
    std::vector<std::uint32_t> ordinals_;
    std::vector<Hit> hits_;
};

/// The outputs of makeHitOutput() for .npz, .ply and .exr.
std::unique_ptr<RayOutput> makeHitArrays(const std::string& path, const HitOptions& options);
std::unique_ptr<RayOutput> makeHitPoints(const std::string& path, const HitOptions& options);
std::unique_ptr<RayOutput> makeHitImage(const std::string& path, const HitOptions& options);

}  // namespace peeler
