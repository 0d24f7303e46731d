// SPDX-License-Identifier: Apache-2.0
// A camera and the picture it takes: where it stands, and which ray goes through which pixel.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <span>
#include <string>

#include "core/base/window.h"

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

/// Camera to world of a camera or light at `eye` that looks along `forward` with `up` upwards in
/// the picture. Nothing if the two are parallel or one of them has no length.
std::optional<glm::dmat4> lookAlong(const glm::dvec3& eye, const glm::dvec3& forward,
                                    const glm::dvec3& up);

/// Rotation and translation of a node's matrix, which may also scale, mirror and shear. The viewing
/// axis (−Z) keeps its direction and +Y its side of it; the picture is never mirrored. Nothing if
/// the matrix leaves no direction to look along.
std::optional<glm::dmat4> rigid(const glm::dmat4& world);

/// How far a matrix is from one that turns and moves and does nothing else: the most by which its
/// determinant is not 1, its axes are not of length 1 (squared) or not at right angles (dot
/// products). NaN or infinite where the matrix is.
double distanceFromRigid(const glm::dmat4& matrix);

/// What is nearer is as rigid as rounding leaves it: lookAlong() and rigid() make nothing that is
/// farther away.
inline constexpr double kRigidByRounding = 1e-12;

/// The frustum or box of a camera that looks along −Z of its own space (glTF's convention).
/// `half_width` and `half_height` are measured at distance 1 for a perspective camera (tan of half
/// the field of view) and in scene units for an orthographic one.
struct Projection {
    bool perspective = true;
    double half_width = 1, half_height = 1;
    double near = 0.01;
    double far = std::numeric_limits<double>::infinity();  ///< finite if orthographic

    /// Clip-space matrix (column vectors, reversed Z in [0, 1]: 1 at near, 0 at far) of the
    /// sub-rectangle [u0, u1] × [v0, v1] of the picture, u right and v down, both 0–1.
    glm::dmat4 matrix(double u0 = 0, double v0 = 0, double u1 = 1, double v1 = 1) const;

    /// Camera Z (positive in front, scene units) of a buffer depth. Monotone: never grows with
    /// depth.
    double linearZ(double depth) const;
    /// The same of many at once, in place, rounded to float.
    void toLinearZ(std::span<float> depths) const;
};

/// Everything that says which ray goes through which pixel.
struct View {
    std::string camera_name;        ///< "" if the camera is not from the scene
    glm::dmat4 camera_to_world{1};  ///< rigid: rotation and translation only
    Projection projection;
    int width = 1280, height = 720;  ///< display window
    Window crop;                     ///< the pixels that are rendered, inside the display window
    glm::dvec2 sample{0.5};          ///< where in a pixel its sample lies, 0–1, y down
    bool known = true;               ///< false: from a file that tells the windows alone
};

/// The point in world space at camera Z `z` (scene units) on the ray through (x, y) of the picture:
/// pixels from the upper left corner of the display window, y down, so that the centre of pixel
/// (i, j) is (i + 0.5, j + 0.5). For a pixel's sample add `view.sample` instead.
glm::dvec3 worldPosition(const View& view, double x, double y, double z);

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

}  // namespace peeler::inline v0

#pragma GCC visibility pop
