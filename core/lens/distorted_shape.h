// SPDX-License-Identifier: Apache-2.0
// Lenses made of a projection to a plane and a distortion of that plane.
#pragma once

#include <cmath>
#include <numbers>

#include "core/base/portable_math.h"
#include "core/lens/lens_shape.h"

namespace peeler {

/// A value of two variables and its derivatives: column 0 by the first variable, column 1 by the
/// second.
struct PlaneValue {
    glm::dvec2 value{0};
    glm::dmat2 slopes{1};
};

/// The projection of a pinhole: (x / z, y / z).
struct PerspectivePlane {
    /// The largest radius of a point.
    static constexpr double kReach = 1e6;

    static std::optional<glm::dvec2> plane(const glm::dvec3& direction) {
        if (!(direction.z > 0)) return {};
        return glm::dvec2(direction) / direction.z;
    }
    static LensRay ray(const glm::dvec2& plane) {
        const double length = std::sqrt(glm::dot(plane, plane) + 1);
        const glm::dvec3 d = glm::dvec3(plane, 1) / length;
        return {d, (glm::dvec3(1, 0, 0) - d * d.x) / length,
                (glm::dvec3(0, 1, 0) - d * d.y) / length};
    }
};

/// The equidistant projection: the radius is the angle θ from the axis. Kannala, Brandt, A Generic
/// Camera Model and Calibration Method for Conventional, Wide-Angle, and Fish-Eye Lenses, 2006.
struct EquidistantPlane {
    static constexpr double kReach = std::numbers::pi;

    static std::optional<glm::dvec2> plane(const glm::dvec3& direction) {
        const glm::dvec2 across(direction);
        const double length = std::sqrt(glm::dot(across, across));
        const double angle = portableAtan2(length, direction.z);
        if (length == 0) return glm::dvec2(angle, 0);
        return across * (angle / length);
    }
    static LensRay ray(const glm::dvec2& plane) {
        const double square = glm::dot(plane, plane);
        if (square == 0) return {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};
        const double angle = std::sqrt(square);
        const auto [sin, cos] = portableSinCos(angle);
        const double scale = sin / angle;
        const double bend = (cos - scale) / square;  // d scale / d angle, divided by the angle
        const double x = plane.x, y = plane.y;
        return {{x * scale, y * scale, cos},
                {scale + x * x * bend, x * y * bend, -x * scale},
                {x * y * bend, scale + y * y * bend, -y * scale}};
    }
};

/// A lens whose picture is the distorted plane of a projection. `Distortion` has
/// std::optional<glm::dvec2> distorted(plane) and its inverse, with derivatives,
/// std::optional<PlaneValue> undistorted(plane).
template <class Plane, class Distortion>
class DistortedShape : public LensShape {
  public:
    explicit DistortedShape(Distortion distortion) : distortion_(std::move(distortion)) {}

    std::optional<glm::dvec2> plane(const glm::dvec3& direction) const override {
        const auto flat = Plane::plane(direction);
        return flat ? distortion_.distorted(*flat) : flat;
    }
    std::optional<LensRay> ray(const glm::dvec2& plane) const override { return rayOf(plane); }
    void fill(std::span<const double> columns, std::span<const double> rows,
              std::span<glm::dvec3> directions) const override {
        // Inlined, without the derivatives.
        fillBy([this](const glm::dvec2& point) { return rayOf(point); }, columns, rows, directions);
    }

  private:
    std::optional<LensRay> rayOf(const glm::dvec2& plane) const {
        const std::optional<PlaneValue> flat = distortion_.undistorted(plane);
        if (!flat) return {};
        const LensRay ray = Plane::ray(flat->value);
        const glm::dmat2& slopes = flat->slopes;
        return LensRay{ray.direction, ray.per_x * slopes[0].x + ray.per_y * slopes[0].y,
                       ray.per_x * slopes[1].x + ray.per_y * slopes[1].y};
    }

    Distortion distortion_;
};

/// Returns a point scaled to the radius `radius` from the radius `from`, with the derivatives by
/// the point. `slope` is the derivative of `radius` by `from`. At the centre, `slope` is the scale.
inline PlaneValue scaledRadially(const glm::dvec2& point, double from, double radius,
                                 double slope) {
    if (from == 0) return {glm::dvec2(0), glm::dmat2(slope)};
    const double scale = radius / from;
    const glm::dvec2 along = point / from;
    return {point * scale, glm::dmat2(scale) + glm::outerProduct(along, along) * (slope - scale)};
}

/// Returns the x in [0, end) at which an increasing function has the value `value`, or nothing if
/// it does not reach this value there. function(x) returns the value and the derivative. The
/// function must be 0 at 0. Newton's method inside a shrinking bracket.
template <class Function>
std::optional<double> increasingInverse(const Function& function, double value, double end) {
    if (value == 0) return 0.0;
    double low = 0, high = std::min(end, std::max(1.0, value));
    while (function(high).first < value) {
        if (high >= end) return {};
        low = high;
        high = std::min(end, 2 * high);
    }
    double x = std::min(std::max(value, low), high);
    constexpr int kMostSteps = 200;
    for (int step = 0; step < kMostSteps; ++step) {
        const auto [at, slope] = function(x);
        if (at == value) return x;
        (at < value ? low : high) = x;
        double next = x - (at - value) / slope;
        if (!(next > low && next < high)) next = low + (high - low) / 2;
        if (next == x || !(next > low && next < high)) return x;
        // Newton's method converges quadratically: after a step this small, `next` is exact.
        if (std::abs(next - x) <= 1e-9 * x && slope * x > 1e-3 * value) {
            const auto [again, last] = function(next);
            return next - (again - value) / last;
        }
        x = next;
    }
    return x;
}

}  // namespace peeler
