// SPDX-License-Identifier: Apache-2.0
// How rigid a camera's matrix is, and a view's pixels against points in space.
#pragma once

#include <cmath>
#include <glm/glm.hpp>

#include <peeler/view.h>

namespace peeler {

/// How far a matrix is from one that turns and moves and does nothing else: the most by which its
/// determinant is not 1, its axes are not of length 1 (squared) or not at right angles (dot
/// products). NaN or infinite where the matrix is.
double distanceFromRigid(const glm::dmat4& matrix);

/// What is nearer is as rigid as rounding leaves it: lookAlong() and rigid() make nothing that is
/// farther away.
inline constexpr double kRigidByRounding = 1e-12;

/// A view's pixels against points in its camera's own space (it looks along −Z, +Y up). Pixel
/// coordinates are continuous, y down: (0, 0) is the display window's upper left corner, and pixel
/// (x, y) has its sample at (x, y) + View::sample.
///
/// Depth along the axis (Z, positive in front) also goes by its *planar* measure: 1/Z of a
/// perspective camera, Z of an orthographic one. On a plane in space it is a linear function of the
/// pixel coordinates.
class PixelRays {
  public:
    explicit PixelRays(const View& view)
        : perspective_(view.projection.perspective),
          size_(view.width, view.height),
          half_(view.projection.half_width, view.projection.half_height) {}

    bool perspective() const { return perspective_; }

    double planar(double z) const { return perspective_ ? 1 / z : z; }
    /// Whether a planar depth is one of a point that the camera can see.
    bool isSeen(double planar) const {
        return perspective_ ? planar > 0 && planar < kFarthest : std::abs(planar) < kFarthest;
    }

    glm::dvec3 point(const glm::dvec2& pixel, double planar) const {
        const glm::dvec2 at = (2.0 * pixel / size_ - 1.0) * half_;
        return perspective_ ? glm::dvec3(at.x, -at.y, -1) / planar
                            : glm::dvec3(at.x, -at.y, -planar);
    }

    /// The pixel coordinates of a point; of a perspective camera one in front of it.
    glm::dvec2 pixel(const glm::dvec3& point) const {
        glm::dvec2 at(point.x, -point.y);
        if (perspective_) at /= -point.z;
        return (at / half_ + 1.0) * 0.5 * size_;
    }

    /// How much a pixel's area in space shrinks on the picture with depth: weights of projective
    /// interpolation (1/Z, or 1 for an orthographic camera).
    double weight(double z) const { return perspective_ ? 1 / z : 1; }

    /// How much planar depth changes from a pixel to the next on a surface that is turned by 45°
    /// from facing the camera, at this planar depth.
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
