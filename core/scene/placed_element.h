// SPDX-License-Identifier: Apache-2.0
// The point, line or triangle that a key stands for, where it is in the world, and where a ray
// meets it.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include "core/scene/draw_list.h"
#include "core/scene/primitive_corners.h"
#include "core/scene/scene.h"
#include "core/scene/scene_contents.h"

namespace peeler {

struct PlacedElement {
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

/// Without its corners.
PlacedElement elementOf(const Scene& scene, const SceneContents& contents, const DrawList& list,
                        std::uint32_t key);

/// Finds the corners, in double precision. Of another moment's contents of the same scene: where
/// the same element is then.
void placeCorners(const Scene& scene, const SceneContents& contents, PlacedElement& element);

}  // namespace peeler
