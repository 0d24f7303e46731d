// SPDX-License-Identifier: Apache-2.0
// Where rays meet triangles: in the plane of the triangle as it is, unlike coverage, which goes by
// snapped corners.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>

#include "core/raster/alpha_test.h"
#include "core/raster/corner_grid.h"
#include "core/raster/span_store.h"
#include "core/scene/view.h"

namespace peeler {

struct HitView;

/// The plane of a triangle as the rays of a view meet it. Of what is seen edge-on it is the mean of
/// the corners.
HitTriangle hitTriangle(const CornerPlacement& placement, const HitView& seen,
                        const std::array<glm::vec3, 3>& positions);

/// The Z of a hit from its planar depth, rounded once, and within that of the corners: a ray that
/// has a snapped triangle may miss the true one by a fraction of its distance from the next ray.
template <bool kPerspective>
inline float hitZ(const HitTriangle& triangle, double planar) {
    const auto z = static_cast<float>(kPerspective ? 1 / planar : planar);
    // In this order NaN, of planes too steep for numbers, becomes the nearest corner's.
    const float near = z > triangle.nearest ? z : triangle.nearest;
    return (near < triangle.farthest ? near : triangle.farthest) + 0.0F;  // never −0
}

inline float hitZAt(const HitTriangle& triangle, bool perspective, int x, int y) {
    const double planar = triangle.along_x * x + (triangle.along_y * y + triangle.at_origin);
    return perspective ? hitZ<true>(triangle, planar) : hitZ<false>(triangle, planar);
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
