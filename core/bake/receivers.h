// SPDX-License-Identifier: Apache-2.0
// Receivers at the vertices of a scene, and at the texels of textures that are yet to be made.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <peeler/memory_budget.h>
#include "core/bake/bake.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// The most receivers: their positions and normals take 18 GiB.
inline constexpr std::size_t kMostReceivers = std::size_t{1} << 29;

/// The vertices of a primitive where an instance shows it: receivers first … first + count − 1, in
/// the order of the vertices.
struct VertexRange {
    std::size_t instance = 0;   ///< index into PosedScene::meshes()
    std::size_t primitive = 0;  ///< of the mesh
    std::size_t first = 0, count = 0;
};

/// A receiver for every vertex of every primitive of triangles that the scene shows, deformed as it
/// is at the moment. Its normal is the vertex's own; where a primitive has none (glTF 2.0 §3.7.2.1:
/// its surface is flat then) or it has no length, the mean of the vertex's triangles, weighted by
/// their areas, on the front. Vertices are not welded: only those that triangles share by index are
/// shared. One that no triangle uses has normal 0.
class VertexReceivers {
  public:
    /// Throws Error (kInput) if there would be more than kMostReceivers, and (kMemory) if they are
    /// over the budget. Primitives are done in parallel; the result does not depend on how.
    explicit VertexReceivers(const PosedScene& posed, const MemoryBudget& budget = {});

    const Receivers& receivers() const { return receivers_; }
    /// By instance, then primitive; none is left out, but those not of triangles are empty.
    const std::vector<VertexRange>& ranges() const { return ranges_; }
    const VertexRange& range(std::size_t instance, std::size_t primitive) const {
        return ranges_[first_range_[instance] + primitive];
    }

    /// Values between vertices: those of the corners of the primitive with this key, weighted
    /// (`barycentric`: of the second and third corner). This must outlive it.
    SurfaceLookup lookup() const;

  private:
    void fill(const VertexRange& range);

    PosedScene posed_;
    Receivers receivers_;
    std::vector<VertexRange> ranges_;
    std::vector<std::size_t> first_range_;  ///< of each instance
};

/// Whether GL makes triangles of it.
inline bool isOfTriangles(const Primitive& primitive) {
    return primitive.topology >= Topology::kTriangles;
}

struct TexelSettings {
    int size = 1024;  ///< texels a side
    int uv_set = 0;   ///< TEXCOORD_0 or TEXCOORD_1
};

/// The texture of one material. Texel (x, y), row 0 at v = 0, is the texel number y · size + x.
struct TexelAtlas {
    int material = 0;  ///< index into Scene::materials
    /// The receivers of texel i are first[i] … first[i + 1] − 1.
    std::vector<std::uint32_t> first;
    std::uint64_t covered = 0;  ///< texels whose centre some triangle covers
    std::uint64_t shared = 0;   ///< of those, by several triangles: mirrored or tiled
};

/// For every material that a triangle of the scene uses and that has this UV set, a texture: every
/// texel whose centre the UV image of a triangle covers is a receiver, at that point of the
/// triangle with its interpolated normal (or its flat one if the primitive has none). Of triangles
/// that share an edge one covers a centre on it (the fill rule of rasterisers). Triangles that
/// share a texel have a receiver each, of which a texel has at most 8, in draw order. A texel that
/// is not covered but whose circumscribed circle a triangle touches is a receiver at the nearest
/// point of the nearest such triangle, so that narrow charts and borders have values, too. UVs
/// outside 0–1 repeat.
class TexelReceivers {
  public:
    /// Throws Error (kInput) if no triangle has such UVs, or if they repeat a texture so often that
    /// more than 2^29 texels would have to be looked at, or if all textures together have more than
    /// 2^30 texels or kMostReceivers receivers, and (kMemory) if they are over the budget. Rows are
    /// done in parallel; the result does not depend on how.
    TexelReceivers(const PosedScene& posed, const VertexReceivers& vertices,
                   const TexelSettings& settings, const MemoryBudget& budget = {});

    const Receivers& receivers() const { return receivers_; }
    const std::vector<TexelAtlas>& atlases() const { return atlases_; }  ///< by material
    const TexelSettings& settings() const { return settings_; }
    /// Primitives (as instances show them) of triangles without that UV set.
    std::uint64_t withoutUvs() const { return without_uvs_; }

    /// The value of the texel that the point's UV lies in. This must outlive it.
    SurfaceLookup lookup() const;

    /// The pixels of an atlas, row by row, of the values of all receivers, `components` each: a
    /// texel's is the mean of its receivers'. One without takes over from the nearest one that has
    /// some within `padding` texels, across the borders, so that filtering does not mix in what is
    /// beside a chart; the others get the mean of all that have one.
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

/// For every texel of a square of `size` a side the nearest one of which `filled` is true, itself
/// among them, at most `reach` texels away (Euclidean; of equally near ones the same on every run)
/// in a plane that repeats the square; −1 = there is none. Two passes, columns then rows (Saito &
/// Toriwaki 1994).
std::vector<std::int32_t> nearestFilled(const std::vector<char>& filled, int size, int reach);

}  // namespace peeler
