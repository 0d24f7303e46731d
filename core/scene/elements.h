// SPDX-License-Identifier: Apache-2.0
// The points, lines and triangles that GL makes of primitives: which vertices they have, where they
// are in the world, and where a ray meets them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include <peeler/scene.h>
#include "core/scene/posed_scene.h"

namespace peeler {

/// How many elements GL makes of a primitive; also what gl_PrimitiveID counts.
std::uint64_t elementsOf(const Primitive& primitive);

/// The vertices of an element.
struct Corners {
    int count = 0;  ///< 1 to 3
    std::array<std::size_t, 3> vertex{};
};

/// Of the element that GL makes as the `element`-th of a primitive, in the order in which GL draws
/// it: odd triangles of a strip are turned, so that all have one orientation (OpenGL 4.5 core,
/// §10.1).
Corners cornersOf(const Primitive& primitive, std::uint32_t element);

/// The point, line or triangle that a key stands for, where it is in the world.
struct WorldElement {
    KeyOrigin origin;
    const MeshInstance* instance = nullptr;
    const Primitive* primitive = nullptr;
    // The rest by placeCorners().
    Corners corners;
    std::array<glm::dvec3, 3> corner{};  ///< world space

    /// Counter-clockwise in the mesh, twice the triangle's area long; 0 for lines and points.
    glm::dvec3 normal() const;
    /// A mean of the corners.
    glm::dvec3 weighted(const std::array<double, 3>& weight) const {
        return weight[0] * corner[0] + weight[1] * corner[1] + weight[2] * corner[2];
    }
    /// Weights of the corners at the point where a ray meets the plane of the triangle, or comes
    /// nearest to the line. The rasteriser snaps corners to a grid, so a ray of a fragment can miss
    /// by a fraction of a pixel: weights are clamped to the element. Any length of `direction`.
    std::array<double, 3> weightsAt(const glm::dvec3& ray_origin,
                                    const glm::dvec3& direction) const;
};

/// The element that a key stands for, without its corners.
WorldElement elementOf(const PosedScene& posed, std::uint32_t key);

/// Finds the corners, in double precision; in another pose of the same scene, where the same
/// element is then.
void placeCorners(const PosedScene& posed, WorldElement& element);

/// Elements with what it takes a while to find out, those that were asked for lately being at hand:
/// rays beside each other mostly meet the same ones. Not for several threads at once.
class RecentElements {
  public:
    struct Entry {
        std::uint32_t key = 0;  ///< 0 = none yet
        WorldElement element;   ///< with its corners, if they are wanted
        glm::dvec3 normal{0};   ///< WorldElement::normal()
        glm::dvec3 unit{0};     ///< of that direction; 0 if it has none
    };

    /// `posed` must outlive it. Without corners there are no normals, either.
    RecentElements(const PosedScene& posed, bool corners)
        : posed_(posed), corners_(corners), entries_(kEntries) {}

    /// Until the next call.
    const Entry& at(std::uint32_t key) {
        Entry& entry = entries_[key % kEntries];
        if (entry.key != key) find(key, entry);
        return entry;
    }

  private:
    static constexpr std::size_t kEntries = 512;  ///< fit a processor's own cache

    void find(std::uint32_t key, Entry& entry) const;

    const PosedScene& posed_;
    bool corners_;
    std::vector<Entry> entries_;
};

}  // namespace peeler
