// SPDX-License-Identifier: Apache-2.0
// Receivers at the vertices of a scene, and at the texels of the textures to bake.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <peeler/memory_budget.h>
#include "core/bake/bake.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// The maximum number of receivers: their positions and normals take 18 GiB.
inline constexpr std::size_t kMostReceivers = std::size_t{1} << 29;

/// The receivers of one instance of a primitive: first … first + count − 1, in the order of the
/// vertices.
struct VertexRange {
    std::size_t instance = 0;   ///< index into PosedScene::meshes()
    std::size_t primitive = 0;  ///< of the mesh
    std::size_t first = 0, count = 0;
};

/// A receiver for every vertex of every visible triangle primitive, in its current deformation. Its
/// normal is the vertex's own. If the primitive has no normals (glTF 2.0 §3.7.2.1: its surface is
/// flat then) or the normal has no length, it is the area-weighted mean of the normals of the
/// vertex's triangles, on the front. Vertices are not welded: triangles share only those that they
/// share by index. A vertex that no triangle uses has normal 0.
class VertexReceivers {
  public:
    /// Throws Error (kInput) if there are more than kMostReceivers, and (kMemory) if they exceed
    /// the budget. Primitives are processed in parallel; the result does not depend on the order.
    explicit VertexReceivers(const PosedScene& posed, const MemoryBudget& budget = {});

    const Receivers& receivers() const { return receivers_; }
    /// By instance, then primitive. None is left out; the ranges of other topologies are empty.
    const std::vector<VertexRange>& ranges() const { return ranges_; }
    const VertexRange& range(std::size_t instance, std::size_t primitive) const {
        return ranges_[first_range_[instance] + primitive];
    }

    /// Returns a lookup that interpolates the values at the three corners of the primitive with the
    /// given key (`barycentric` weighs the second and third corner). This must outlive it.
    SurfaceLookup lookup() const;

  private:
    void fill(const VertexRange& range);

    PosedScene posed_;
    Receivers receivers_;
    std::vector<VertexRange> ranges_;
    std::vector<std::size_t> first_range_;  ///< of each instance
};

/// Whether GL draws the primitive as triangles.
inline bool isOfTriangles(const Primitive& primitive) {
    return primitive.topology >= Topology::kTriangles;
}

struct TexelSettings {
    int size = 1024;  ///< texels per side
    int uv_set = 0;   ///< TEXCOORD_0 or TEXCOORD_1
};

/// The texture of one material. Texel (x, y), row 0 at v = 0, has index y · size + x.
struct TexelAtlas {
    int material = 0;  ///< index into Scene::materials
    /// The receivers of texel i are first[i] … first[i + 1] − 1.
    std::vector<std::uint32_t> first;
    std::uint64_t covered = 0;  ///< texels whose centre lies in a triangle
    std::uint64_t shared = 0;   ///< those covered by several triangles: mirrored or tiled
};

/// A texture for every material that a visible triangle with this UV set uses. Each texel whose
/// centre lies in the UV image of a triangle is a receiver at that point of the triangle, with its
/// interpolated normal (or its flat one if the primitive has no normals). A centre on an edge
/// shared by two triangles belongs to one of them (the fill rule of rasterisers). Triangles that
/// share a texel have a receiver each, at most 8 per texel, in draw order. An uncovered texel whose
/// circumscribed circle a triangle touches is a receiver at the nearest point of the nearest such
/// triangle, so that narrow charts and borders have values, too. UVs outside 0–1 repeat.
class TexelReceivers {
  public:
    /// Throws Error (kInput) if no triangle has such UVs, if they repeat a texture so often that
    /// more than 2^29 texels would have to be tested, or if all textures together have more than
    /// 2^30 texels or kMostReceivers receivers; and (kMemory) if they exceed the budget. Rows are
    /// processed in parallel; the result does not depend on the order.
    TexelReceivers(const PosedScene& posed, const VertexReceivers& vertices,
                   const TexelSettings& settings, const MemoryBudget& budget = {});

    const Receivers& receivers() const { return receivers_; }
    const std::vector<TexelAtlas>& atlases() const { return atlases_; }  ///< by material
    const TexelSettings& settings() const { return settings_; }
    /// Returns the number of triangle primitives, counted per instance, without that UV set.
    std::uint64_t withoutUvs() const { return without_uvs_; }

    /// Returns a lookup of the texel that contains the point's UV. This must outlive it.
    SurfaceLookup lookup() const;

    /// Returns the pixels of an atlas, row by row, from the values of all receivers (`components`
    /// each). A texel gets the mean of its receivers. A texel without receivers copies the nearest
    /// one that has some within `padding` texels, across the borders, so that filtering does not
    /// bleed into charts. All others get the mean of the texels that have receivers.
    std::vector<float> pixels(const TexelAtlas& atlas, std::span<const float> values,
                              std::size_t components, int padding) const;

  private:
    PosedScene posed_;
    TexelSettings settings_;
    Receivers receivers_;
    std::vector<TexelAtlas> atlases_;
    std::vector<int> atlas_of_material_;  ///< −1 = none
    std::uint64_t without_uvs_ = 0;
};

/// Returns, for each texel of a square with `size` texels per side, the nearest texel where
/// `filled` is true, the texel itself included; −1 if there is none within `reach` texels
/// (Euclidean, in a plane that repeats the square). Ties are resolved the same way on every run.
/// Two passes, columns then rows (Saito & Toriwaki 1994).
std::vector<std::int32_t> nearestFilled(const std::vector<char>& filled, int size, int reach);

}  // namespace peeler
