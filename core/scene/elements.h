// SPDX-License-Identifier: Apache-2.0
// The points, lines and triangles of primitives: their vertices, world positions, and ray
// intersections.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include <peeler/scene.h>
#include "core/scene/posed_scene.h"

namespace peeler {

/// Returns the number of elements that GL draws for a primitive, as numbered by gl_PrimitiveID.
std::uint64_t elementsOf(const Primitive& primitive);

/// The vertices of an element.
struct Corners {
    int count = 0;  ///< number of vertices, 1 to 3
    std::array<std::size_t, 3> vertex{};
};

/// Like cornersOf(), which is faster for indexed triangles.
Corners cornersOfAny(const Primitive& primitive, std::uint32_t element);

/// Returns the vertices of a primitive's `element`-th element in GL's drawing order. Odd triangles
/// of a strip are reversed, so that all triangles have the same orientation (OpenGL 4.5 core,
/// §10.1).
inline Corners cornersOf(const Primitive& primitive, std::uint32_t element) {
    if (primitive.topology != Topology::kTriangles || primitive.indices.empty())
        return cornersOfAny(primitive, element);
    const std::uint32_t* const vertex = &primitive.indices[std::size_t{3} * element];
    return {3, {vertex[0], vertex[1], vertex[2]}};
}

/// The point, line or triangle that a key identifies, in world space.
struct WorldElement {
    KeyOrigin origin;
    const MeshInstance* instance = nullptr;
    const Primitive* primitive = nullptr;
    // Set by placeCorners().
    Corners corners;
    std::array<glm::dvec3, 3> corner{};  ///< positions of the corners, world space

    /// Returns the normal. It points to the side from which the triangle is counter-clockwise in
    /// the mesh. Its length is twice the triangle's area. For lines and points it is 0.
    glm::dvec3 normal() const;
    /// Returns the weighted mean of the corners.
    glm::dvec3 weighted(const std::array<double, 3>& weight) const {
        return weight[0] * corner[0] + weight[1] * corner[1] + weight[2] * corner[2];
    }
    /// Returns the corners' weights at the point where a ray meets the plane of the triangle, or
    /// comes nearest to the line. The rasteriser snaps corners to a grid, so a fragment's ray can
    /// miss the element by a fraction of a pixel. Weights are therefore clamped to the element.
    /// `direction` may have any length.
    std::array<double, 3> weightsAt(const glm::dvec3& ray_origin,
                                    const glm::dvec3& direction) const;
};

/// Returns the element of a key, without its corners.
WorldElement elementOf(const PosedScene& posed, std::uint32_t key);

/// Computes the element's corners in double precision. `posed` may be another pose of the same
/// scene.
void placeCorners(const PosedScene& posed, WorldElement& element);

/// A cache of recently used elements and their normals, since neighbouring rays mostly hit the same
/// elements. Not thread-safe.
class RecentElements {
  public:
    struct Entry {
        std::uint32_t key = 0;  ///< 0 if the entry is empty
        WorldElement element;   ///< the element, with its corners if they are requested
        glm::dvec3 normal{0};   ///< WorldElement::normal()
        glm::dvec3 unit{0};     ///< unit vector along `normal`; 0 if `normal` is 0
    };

    /// `posed` must outlive this object. Without `corners`, entries have no normals.
    RecentElements(const PosedScene& posed, bool corners)
        : posed_(posed), corners_(corners), entries_(kEntries) {}

    /// Returns an element, valid until the next call.
    const Entry& at(std::uint32_t key) {
        Entry& entry = entries_[key % kEntries];
        if (entry.key != key) find(key, entry);
        return entry;
    }

  private:
    /// Number of entries, few enough to fit a core's cache.
    static constexpr std::size_t kEntries = 512;

    void find(std::uint32_t key, Entry& entry) const;

    const PosedScene& posed_;
    bool corners_;
    std::vector<Entry> entries_;
};

}  // namespace peeler
