// SPDX-License-Identifier: Apache-2.0
// Nearest hits before and after arbitrary points, from the hits of a bundle.
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
    /// Distance from the point in scene units, 0 or greater; infinite if there is no hit.
    double distance = std::numeric_limits<double>::infinity();
    std::uint32_t key = 0;  ///< key of the hit; 0 if there is no hit
};

/// The nearest hits before and after a point. A surface through the point (up to rounding: 1e-12 of
/// the coordinates) counts as a hit before the point, at distance 0. Among coincident surfaces,
/// `before` is the one drawn last, and `after` is the one drawn first.
struct PointHits {
    NextHit before;  ///< hit at point − distance · direction
    NextHit after;   ///< hit at point + distance · direction
};

/// Returns the pixel of a parallel bundle that contains a point (world space); nullopt if the point
/// is outside the bundle.
std::optional<glm::ivec2> nearestRay(const Bundle& bundle, const glm::dvec3& point);

/// Finds the hits next to the points whose nearest ray is in the band. `found` has one entry per
/// point; entries of other points stay unchanged. The band must belong to a parallel bundle and
/// hold the keys (kKeyChannel) in extra[0].
///
/// The bundle's rays do not go through the points. A binary search finds a point's position in the
/// hit list of its nearest ray. The primitives hit around this position are then intersected with a
/// parallel ray through the point. A distance is exact if the parallel ray meets the primitive.
/// Otherwise it is the distance to the primitive's plane or, if the plane is far away there, to the
/// primitive's nearest point. Features thinner than the ray spacing can be missed. Points run in
/// parallel; the result does not depend on their order.
void findPointHits(const PosedScene& posed, const Bundle& bundle, const LayeredImage& band,
                   std::span<const glm::dvec3> points, std::span<PointHits> found);

}  // namespace peeler
