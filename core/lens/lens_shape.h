// SPDX-License-Identifier: Apache-2.0
// The mapping of a lens model between directions and its image plane.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>

#include <peeler/camera_choice.h>

namespace peeler {

/// A direction and its derivatives by two coordinates.
struct LensRay {
    glm::dvec3 direction{0};  ///< of length 1
    glm::dvec3 per_x{0}, per_y{0};
};

/// A lens with focal length 1 and principal point (0, 0). Directions have OpenCV's axes: x right, y
/// down, z forward. Both functions calculate with portable operations only
/// (core/base/portable_math.h), so their results have the same bits on every machine.
class LensShape {
  public:
    LensShape() = default;
    LensShape(const LensShape&) = delete;
    LensShape& operator=(const LensShape&) = delete;
    virtual ~LensShape() = default;

    /// Returns the point that sees a direction (of any length above 0); nothing if no point does.
    virtual std::optional<glm::dvec2> plane(const glm::dvec3& direction) const = 0;
    /// Returns the ray of a point; nothing if the lens maps no direction to it.
    virtual std::optional<LensRay> ray(const glm::dvec2& plane) const = 0;
    /// Writes the directions of the rays of a grid's points, row by row; (0, 0, 0) for no ray.
    virtual void fill(std::span<const double> columns, std::span<const double> rows,
                      std::span<glm::dvec3> directions) const {
        fillBy([this](const glm::dvec2& point) { return ray(point); }, columns, rows, directions);
    }

  protected:
    template <class RayOf>
    static void fillBy(const RayOf& ray_of, std::span<const double> columns,
                       std::span<const double> rows, std::span<glm::dvec3> directions) {
        auto to = directions.begin();
        for (const double y : rows) {
            for (const double x : columns) {
                const std::optional<LensRay> ray = ray_of(glm::dvec2(x, y));
                *to++ = ray ? ray->direction : glm::dvec3(0);
            }
        }
    }
};

// One function per row of the table of models (LensModel::shape), with the meaning of its
// coefficients.

std::unique_ptr<const LensShape> pinholeShape(std::span<const double> coefficients,
                                              const Size& size);
/// k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, τx, τy.
std::unique_ptr<const LensShape> opencvShape(std::span<const double> coefficients,
                                             const Size& size);
/// k1, k2, k3, k4.
std::unique_ptr<const LensShape> fisheyeShape(std::span<const double> coefficients,
                                              const Size& size);
/// k1, k2, p1, p2, k3, k4, sx1, sy1.
std::unique_ptr<const LensShape> thinPrismFisheyeShape(std::span<const double> coefficients,
                                                       const Size& size);
/// k1, …, k6, p1, p2, s1, …, s4.
std::unique_ptr<const LensShape> radTanThinPrismFisheyeShape(std::span<const double> coefficients,
                                                             const Size& size);
/// ω.
std::unique_ptr<const LensShape> fovShape(std::span<const double> coefficients, const Size& size);
/// p0, …, p5, c, d, e, largest angle.
std::unique_ptr<const LensShape> fthetaShape(std::span<const double> coefficients,
                                             const Size& size);
std::unique_ptr<const LensShape> fthetaForwardShape(std::span<const double> coefficients,
                                                    const Size& size);
std::unique_ptr<const LensShape> equirectangularShape(std::span<const double> coefficients,
                                                      const Size& size);
std::unique_ptr<const LensShape> cubeShape(std::span<const double> coefficients, const Size& size);

}  // namespace peeler
