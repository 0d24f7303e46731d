// SPDX-License-Identifier: Apache-2.0
// Rigidity of camera matrices, and the mapping between a view's pixels and points in space.
#pragma once

#include <cmath>
#include <glm/glm.hpp>

#include <peeler/view.h>
#include "core/lens/picture_rays.h"

namespace peeler {

/// Returns the ray through a point of the picture, in pixel coordinates as in worldPosition(). In
/// world space; the point at Z `z` (LayeredImage::z) is origin + z · direction. The direction is
/// (0, 0, 0) if the point has no ray.
Ray rayOf(const View& view, const glm::dvec2& pixel);

/// Returns the lens of a view; null for pinholes, parallel rays, moving cameras and lists.
inline const LensCamera* lensCameraOf(const View& view) {
    return view.rays ? view.rays->lens() : nullptr;
}

/// Returns the derivatives of rayOf(), in world space.
RayDifferentials differentialsOf(const View& view, const glm::dvec2& pixel);

/// Returns a matrix's distance from a rigid transform: the largest deviation of the determinant
/// from 1, of the squared lengths of the axes from 1, or of the dot products of the axes from 0.
/// NaN or infinite if the matrix is NaN or infinite.
double distanceFromRigid(const glm::dmat4& matrix);

/// The maximum distanceFromRigid() of a matrix that is rigid up to rounding. Matrices from
/// lookAlong() and rigid() do not exceed it.
inline constexpr double kRigidByRounding = 1e-12;

/// Mapping between a view's pixels and points in camera space (looking along −Z, +Y up). Pixel
/// coordinates are continuous, y down: (0, 0) is the display window's upper left corner, and the
/// sample of pixel (x, y) is at (x, y) + View::sample.
///
/// Depth along the axis (Z, positive in front) also has a *planar* form: 1/Z for a perspective
/// camera, Z for an orthographic camera. Along a plane in space, planar depth is linear in the
/// pixel coordinates.
class PixelRays {
  public:
    explicit PixelRays(const View& view)
        : perspective_(view.projection.perspective),
          size_(view.width, view.height),
          half_(view.projection.half_width, view.projection.half_height) {}

    bool perspective() const { return perspective_; }

    double planar(double z) const { return perspective_ ? 1 / z : z; }
    /// Whether the camera can see a point with this planar depth.
    bool isSeen(double planar) const {
        return perspective_ ? planar > 0 && planar < kFarthest : std::abs(planar) < kFarthest;
    }

    glm::dvec3 point(const glm::dvec2& pixel, double planar) const {
        const glm::dvec2 at = (2.0 * pixel / size_ - 1.0) * half_;
        return perspective_ ? glm::dvec3(at.x, -at.y, -1) / planar
                            : glm::dvec3(at.x, -at.y, -planar);
    }

    /// Returns the pixel coordinates of a point. If the camera is perspective, the point must be in
    /// front of it.
    glm::dvec2 pixel(const glm::dvec3& point) const {
        glm::dvec2 at(point.x, -point.y);
        if (perspective_) at /= -point.z;
        return (at / half_ + 1.0) * 0.5 * size_;
    }

    /// Returns the weight for perspective-correct interpolation: 1/Z, or 1 for an orthographic
    /// camera.
    double weight(double z) const { return perspective_ ? 1 / z : 1; }

    /// Returns the change of planar depth per pixel, at this planar depth, on a surface that is
    /// turned by 45° away from the camera.
    glm::dvec2 unitStep(double planar) const {
        const glm::dvec2 spacing = 2.0 * half_ / size_;
        return perspective_ ? spacing * planar : spacing;
    }

  private:
    static constexpr double kFarthest = 1e30;

    bool perspective_;
    glm::dvec2 size_, half_;
};

}  // namespace peeler
