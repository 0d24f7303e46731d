// SPDX-License-Identifier: Apache-2.0
// What the fragments of a picture say in a few numbers: how far away they are, and where they lie
// in the world.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <span>

#include "core/image/layered_image.h"
#include "core/scene/view.h"

namespace peeler {

/// The median Z of the first fragments in the middle ninth of the picture, or of all if there is
/// none; nothing where there is not a single fragment. Scene units.
std::optional<double> medianDepth(const LayeredImage& image, const View& view);

/// Per pixel the mean of the two smallest distinct Z (Woo, "The Shadow Depth Map Revisited",
/// Graphics Gems III, 1992), in scene units; +inf where there is no second one. Two depths are
/// distinct if they differ by more than the rounding of rasterised depths (2^-18 of Z, or of the
/// depth range of an orthographic view): surfaces that coincide but are triangulated differently
/// must not get the midpoint between them, which would lie on both.
/// `out` has a value for each pixel of the window.
void midpoints(const LayeredImage& image, const Projection& projection, std::span<float> out);

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
