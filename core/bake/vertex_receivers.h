// SPDX-License-Identifier: Apache-2.0
// Receivers at the vertices of a scene.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/bake/bake.h"
#include "core/scene/posed_scene.h"

namespace peeler {

/// What positions and normals take 12 GiB for.
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
/// their areas, on the front. Vertices are not welded: only those that triangles share by index
/// are shared. One that no triangle uses has normal 0.
class VertexReceivers {
  public:
    /// Throws Error (kInput) if there would be more than kMostReceivers. Primitives are done in
    /// parallel; the result does not depend on how.
    explicit VertexReceivers(const PosedScene& posed);

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

}  // namespace peeler
