// SPDX-License-Identifier: Apache-2.0
// Where the fragments of a picture lie in the world, in a few numbers.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>

#include "core/image/layered_image.h"
#include "core/scene/view.h"

namespace peeler {

/// Number, bounding box and mean of world-space points, accumulated in double precision in the
/// order in which they come, so that the numbers do not depend on how a picture is cut into bands.
struct PointStatistics {
    std::uint64_t points = 0;
    glm::dvec3 least{std::numeric_limits<double>::infinity()};
    glm::dvec3 largest{-std::numeric_limits<double>::infinity()};
    glm::dvec3 sum{0};

    void add(const glm::dvec3& point);
    bool empty() const { return points == 0; }

    /// To be printed: a coordinate below 1e-9 of the box's diagonal is what rounding left of 0, and
    /// is 0.
    glm::dvec3 boxMin() const { return tidy(least); }
    glm::dvec3 boxMax() const { return tidy(largest); }
    glm::dvec3 mean() const { return tidy(sum / static_cast<double>(points)); }

  private:
    glm::dvec3 tidy(glm::dvec3 v) const;
};

/// Adds every fragment of a band, unprojected through its pixel's centre.
void addPoints(const View& view, const LayeredImage& band, PointStatistics& statistics);

}  // namespace peeler
