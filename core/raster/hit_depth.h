// SPDX-License-Identifier: Apache-2.0
// Intersections of rays with the planes of unsnapped triangles. (Coverage uses snapped corners.)
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>

#include <peeler/view.h>
#include "core/base/lanes.h"
#include "core/raster/alpha_test.h"
#include "core/raster/corner_grid.h"
#include "core/raster/span_store.h"

namespace peeler {

struct HitView;

/// Returns the plane of a triangle in a view. The plane of an edge-on triangle has constant depth:
/// the mean of the nearest and the farthest corner.
HitTriangle hitTriangle(const CornerPlacement& placement, const HitView& seen,
                        const std::array<glm::vec3, 3>& positions);

/// Converts the planar depths of four hits to Z, rounded once. Clamps Z to the range of the
/// corners' Z, because a ray that hits the snapped triangle may miss the true triangle by a
/// fraction of the ray spacing. If the plane is too steep to represent (NaN), Z is the nearest
/// corner's.
template <bool kPerspective>
inline FourFloats hitZ(const TwoDoubles& first, const TwoDoubles& second, float nearest,
                       float farthest) {
    const FourFloats z = kPerspective ? toFloats(1 / first, 1 / second) : toFloats(first, second);
    const FourFloats none{};
    return least(most(z, none + nearest), none + farthest) + none;  // never −0
}

inline float hitZAt(const HitTriangle& triangle, bool perspective, int x, int y) {
    const TwoDoubles none{};
    const TwoDoubles planar =
        none + (triangle.along_x * x + (triangle.along_y * y + triangle.at_origin));
    return perspective ? hitZ<true>(planar, planar, triangle.nearest, triangle.farthest)[0]
                       : hitZ<false>(planar, planar, triangle.nearest, triangle.farthest)[0];
}

/// Whether all hits of a triangle lie between the near plane (inclusive) and the far plane
/// (exclusive).
inline bool isWithin(const HitTriangle& triangle, const Projection& projection) {
    return double{triangle.nearest} >= projection.near &&
           double{triangle.farthest} < projection.far;
}

/// A test for a ray that a triangle covers: whether the hit is in the depth range and passes the
/// alpha test.
class TriangleTest {
  public:
    TriangleTest(const HitView& seen, const CornerPlacement& placement, const HitTriangle& triangle,
                 const AlphaTest* alpha, const std::array<std::uint32_t, 3>& vertex,
                 const std::array<glm::vec3, 3>& positions);

    /// Tests the ray of a pixel of the picture.
    bool passes(int x, int y) const;

  private:
    /// Returns the barycentric weights where the ray meets the triangle's plane, clamped to the
    /// triangle.
    std::array<double, 3> weightsAt(int x, int y) const;

    const HitView& seen_;
    const HitTriangle& triangle_;
    const AlphaTest* alpha_;  // null if there is no alpha test
    std::array<std::uint32_t, 3> vertex_;
    // For each corner: its weight's coefficients of x, y and 1, up to a common factor.
    std::array<glm::dvec3, 3> weights_{};
};

}  // namespace peeler
