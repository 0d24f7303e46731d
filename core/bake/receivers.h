// SPDX-License-Identifier: Apache-2.0
// Receivers at the vertices of a scene, and at the texels of baked textures.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <peeler/memory_budget.h>
#include "core/bake/bake.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// The maximum number of receivers. The positions and normals of this many receivers take 18 GiB.
inline constexpr std::size_t kMostReceivers = std::size_t{1} << 29;

/// The receivers of one instance of a primitive: first … first + count − 1, in the order of the
/// vertices.
struct VertexRange {
    std::size_t instance = 0;   ///< index into PosedScene::meshes()
    std::size_t primitive = 0;  ///< index into the mesh's primitives
    std::size_t first = 0, count = 0;
};

/// One receiver for every vertex of every visible triangle primitive, in the current deformation. A
/// receiver gets the normal of its vertex. If the primitive has no normals (flat shading, by glTF
/// 2.0 §3.7.2.1) or the vertex's normal has length 0, the receiver gets the area-weighted mean of
/// the front normals of the triangles around the vertex. Vertices are not welded: triangles share a
/// receiver only if they use the same vertex index. A vertex that no triangle uses gets normal 0.
class VertexReceivers {
  public:
    /// Throws Error (kInput) if there are more than kMostReceivers receivers, (kMemory) if the
    /// receivers exceed the budget. Primitives are processed in parallel; the result does not
    /// depend on their order.
    explicit VertexReceivers(const PosedScene& posed, const MemoryBudget& budget = {});

    const Receivers& receivers() const { return receivers_; }
    /// The ranges are ordered by instance, then by primitive. Every primitive has a range. The
    /// range is empty if the primitive's topology is not triangles.
    const std::vector<VertexRange>& ranges() const { return ranges_; }
    const VertexRange& range(std::size_t instance, std::size_t primitive) const {
        return ranges_[first_range_[instance] + primitive];
    }

    /// Returns a lookup for the triangle primitive with the given key. It interpolates the values
    /// at the three corners of a triangle; `barycentric` holds the weights of the second and third
    /// corner. This object must outlive the lookup.
    SurfaceLookup lookup() const;

  private:
    void fill(const VertexRange& range);

    PosedScene posed_;
    Receivers receivers_;
    std::vector<VertexRange> ranges_;
    std::vector<std::size_t> first_range_;  ///< index of each instance's first range
};

/// Whether GL draws the primitive as triangles.
inline bool isOfTriangles(const Primitive& primitive) {
    return primitive.topology >= Topology::kTriangles;
}

struct TexelSettings {
    int size = 1024;  ///< texels per side
    int uv_set = 0;   ///< number of the UV set: 0 (TEXCOORD_0) or 1 (TEXCOORD_1)
};

/// The texture of one material. Texel (x, y) has index y · size + x; row 0 is at v = 0.
struct TexelAtlas {
    int material = 0;  ///< index into Scene::materials
    /// The receivers of texel i are first[i] … first[i + 1] − 1.
    std::vector<std::uint32_t> first;
    std::uint64_t covered = 0;  ///< number of texels whose centre is in a triangle
    /// number of texels whose centre lies in several triangles (mirrored or tiled UVs)
    std::uint64_t shared = 0;
};

/// One texture for every material that a visible triangle with this UV set uses. A texel whose
/// centre lies in a triangle in UV space gets a receiver at that point of the triangle, with the
/// interpolated normal (the flat normal if the primitive has no normals). A centre on an edge
/// shared by two triangles belongs to exactly one of the two triangles (the fill rule of
/// rasterisers). If several triangles cover a texel's centre, the texel gets one receiver for each,
/// in draw order, at most 8. If no triangle covers the centre but some triangles touch the texel's
/// circumscribed circle, the texel gets a receiver at the nearest point of the nearest of these
/// triangles. So narrow charts and borders have values, too. UVs outside 0–1 repeat.
class TexelReceivers {
  public:
    /// Throws Error (kInput) if no visible triangle has this UV set, if the UVs repeat a texture so
    /// often that more than 2^29 texels would have to be tested, or if all textures together have
    /// more than 2^30 texels or kMostReceivers receivers; (kMemory) if the receivers exceed the
    /// budget. Rows are processed in parallel; the result does not depend on their order.
    TexelReceivers(const PosedScene& posed, const VertexReceivers& vertices,
                   const TexelSettings& settings, const MemoryBudget& budget = {});

    const Receivers& receivers() const { return receivers_; }
    /// Returns the atlases, ordered by material.
    const std::vector<TexelAtlas>& atlases() const { return atlases_; }
    const TexelSettings& settings() const { return settings_; }
    /// Returns the number of triangle primitives without this UV set, counted per instance.
    std::uint64_t withoutUvs() const { return without_uvs_; }

    /// Returns a lookup that reads the texel at a point's UV. This object must outlive the lookup.
    SurfaceLookup lookup() const;

    /// Returns the pixels of an atlas, row by row, from the values of all receivers (`components`
    /// each). A texel with receivers gets the mean of their values. Any other texel copies the
    /// nearest texel with receivers within `padding` texels, also across the borders, so that
    /// filtering does not bleed into charts. Texels farther away get the mean of all texels with
    /// receivers.
    std::vector<float> pixels(const TexelAtlas& atlas, std::span<const float> values,
                              std::size_t components, int padding) const;

  private:
    PosedScene posed_;
    TexelSettings settings_;
    Receivers receivers_;
    std::vector<TexelAtlas> atlases_;
    /// Index of each material's atlas in atlases_; −1 if the material has no atlas.
    std::vector<int> atlas_of_material_;
    std::uint64_t without_uvs_ = 0;
};

/// Returns, for each texel of a square with `size` texels per side, the index of the nearest texel
/// where `filled` is true, which may be the texel itself. The index is −1 if all filled texels are
/// more than `reach` texels away (Euclidean, in a plane that repeats the square). Ties are resolved
/// the same way on every run. Two passes, columns then rows (Saito & Toriwaki 1994).
std::vector<std::int32_t> nearestFilled(const std::vector<char>& filled, int size, int reach);

}  // namespace peeler
