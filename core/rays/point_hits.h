// SPDX-License-Identifier: Apache-2.0
// What the hits of a bundle say of points beside its rays.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <span>

#include <peeler/bundle.h>
#include <peeler/layered_image.h>
#include "core/scene/posed_scene.h"

namespace peeler {

struct NextHit {
    /// From the point, scene units, never negative; infinite if there is no hit.
    double distance = std::numeric_limits<double>::infinity();
    std::uint32_t key = 0;  ///< 0 = none
};

/// A surface that a point lies on (but for rounding: 1e-12 of the coordinates) is before it, at
/// distance 0. Of surfaces that coincide, the one drawn last is next before a point, the one drawn
/// first next after it.
struct PointHits {
    NextHit before;  ///< at point − distance · direction
    NextHit after;   ///< at point + distance · direction
};

/// The pixel of a parallel bundle that a point (world space) falls into; nothing if it is beside
/// the bundle.
std::optional<glm::ivec2> nearestRay(const Bundle& bundle, const glm::dvec3& point);

/// Finds the hits next to those points whose nearest ray is in the band; `found`, one for each
/// point, keeps what it has for the others. The band is of a parallel bundle; its extra[0] are the
/// keys (kKeyChannel).
///
/// Rays do not go through the points. So a point's place in the list of the nearest ray is found by
/// binary search, and the primitives around that place are followed to the point's own ray: a
/// distance is exact where that meets the primitive that the nearest ray has hit. Else it is where
/// it meets the primitive's plane, or the primitive's nearest point if that is far from there. What
/// is thinner than the distance of rays can be missed. Points are done in parallel; the result does
/// not depend on how.
void findPointHits(const PosedScene& posed, const Bundle& bundle, const LayeredImage& band,
                   std::span<const glm::dvec3> points, std::span<PointHits> found);

}  // namespace peeler
