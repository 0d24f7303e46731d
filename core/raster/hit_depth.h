// SPDX-License-Identifier: Apache-2.0
// Where rays meet triangles: in the plane of the triangle as it is, unlike coverage, which goes by
// snapped corners.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>

#include <peeler/view.h>
#include "core/raster/alpha_test.h"
#include "core/raster/corner_grid.h"
#include "core/raster/lanes.h"
#include "core/raster/span_store.h"

namespace peeler {

struct HitView;

/// The plane of a triangle as the rays of a view meet it. Of what is seen edge-on it is the mean of
/// the corners.
HitTriangle hitTriangle(const CornerPlacement& placement, const HitView& seen,
                        const std::array<glm::vec3, 3>& positions);

/// The Z of four hits from their planar depths, rounded once, and within that of the corners: a ray
/// that has a snapped triangle may miss the true one by a fraction of its distance from the next
/// ray. Of planes too steep for numbers (NaN) it is the nearest corner's.
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

/// Whether all hits of a triangle are from the near plane on, and before the far one.
inline bool isWithin(const HitTriangle& triangle, const Projection& projection) {
    return double{triangle.nearest} >= projection.near &&
           double{triangle.farthest} < projection.far;
}

/// Which of the rays that cover a triangle hit it.
class TriangleTest {
  public:
    TriangleTest(const HitView& seen, const CornerPlacement& placement, const HitTriangle& triangle,
                 const AlphaTest* alpha, const std::array<std::uint32_t, 3>& vertex,
                 const std::array<glm::vec3, 3>& positions);

    /// The ray of a pixel of the picture.
    bool passes(int x, int y) const;

  private:
    /// Of the corners: at the point where the ray meets the plane, clamped to the triangle.
    std::array<double, 3> weightsAt(int x, int y) const;

    const HitView& seen_;
    const HitTriangle& triangle_;
    const AlphaTest* alpha_;  // null: all pass
    std::array<std::uint32_t, 3> vertex_;
    std::array<glm::dvec3, 3> weights_{};  // over x, y and 1; up to a common factor
};

}  // namespace peeler
