// SPDX-License-Identifier: Apache-2.0
// Pictures of all directions: equirectangular, and the six faces of a cube.
#include "core/lens/panoramas.h"

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <peeler/error.h>
#include "core/base/portable_math.h"
#include "core/lens/lens_shape.h"

namespace peeler {
namespace {

/// Longitude and latitude in radians, clockwise seen from above and downwards. The same picture as
/// COLMAP's EQUIRECTANGULAR (src/colmap/sensor/models.h) and nerfstudio's.
class EquirectangularShape : public LensShape {
  public:
    std::optional<glm::dvec2> plane(const glm::dvec3& direction) const override {
        const double level = std::sqrt(direction.x * direction.x + direction.z * direction.z);
        return glm::dvec2(portableAtan2(direction.x, direction.z),
                          portableAtan2(direction.y, level));
    }
    std::optional<LensRay> ray(const glm::dvec2& plane) const override {
        const auto longitude = turnOf(plane.x, 2), latitude = turnOf(plane.y, 1);
        if (!longitude || !latitude) return {};
        const auto [sin_x, cos_x] = *longitude;
        const auto [sin_y, cos_y] = *latitude;
        return LensRay{directionOf(*longitude, *latitude),
                       {cos_y * cos_x, 0, -cos_y * sin_x},
                       {-sin_y * sin_x, cos_y, -sin_y * cos_x}};
    }
    void fill(std::span<const double> columns, std::span<const double> rows,
              std::span<glm::dvec3> directions) const override {
        std::vector<std::optional<SinCos>> longitudes;
        for (const double x : columns)
            longitudes.push_back(turnOf(x, 2));
        auto to = directions.begin();
        for (const double y : rows) {
            const auto latitude = turnOf(y, 1);
            for (const auto& longitude : longitudes)
                *to++ = longitude && latitude ? directionOf(*longitude, *latitude) : glm::dvec3(0);
        }
    }

  private:
    /// Returns nothing for an angle of more than some quarters of a turn.
    static std::optional<SinCos> turnOf(double angle, int quarters) {
        constexpr double kQuarter = std::numbers::pi / 2 + 1e-9;
        if (!(std::abs(angle) <= quarters * kQuarter)) return {};
        return portableSinCos(angle);
    }
    static glm::dvec3 directionOf(const SinCos& longitude, const SinCos& latitude) {
        return {latitude.cos * longitude.sin, latitude.sin, latitude.cos * longitude.cos};
    }
};

/// A face: the directions of its centre, its right and its lower edge.
struct CubeFace {
    glm::dvec3 ahead, right, down;
};
/// The faces in the order and orientation of GL's cube maps (OpenGL 4.5, table 8.19), seen from
/// inside: +X, −X, +Y, −Y, +Z, −Z of GL are right, left, up, down, front and back of the camera.
constexpr std::array<CubeFace, 6> kFaces{{
    {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}},
    {{-1, 0, 0}, {0, 0, 1}, {0, 1, 0}},
    {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}},
    {{0, 1, 0}, {1, 0, 0}, {0, 0, -1}},
    {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}},
    {{0, 0, -1}, {-1, 0, 0}, {0, 1, 0}},
}};

/// Six faces row by row. The plane's unit is a face, and its origin is the upper left corner.
class CubeShape : public LensShape {
  public:
    explicit CubeShape(int columns) : columns_(columns) {}

    std::optional<glm::dvec2> plane(const glm::dvec3& direction) const override {
        // The nearest face; at an edge, the first one.
        std::size_t nearest = 0;
        for (std::size_t i = 1; i < kFaces.size(); ++i)
            if (glm::dot(kFaces[i].ahead, direction) > glm::dot(kFaces[nearest].ahead, direction))
                nearest = i;
        const auto& [ahead, right, down] = kFaces[nearest];
        const double distance = glm::dot(ahead, direction);
        const glm::dvec2 on_face(glm::dot(right, direction), glm::dot(down, direction));
        return (on_face / distance + 1.0) * 0.5 + corner(static_cast<int>(nearest));
    }
    std::optional<LensRay> ray(const glm::dvec2& plane) const override {
        const glm::dvec2 cell = glm::floor(plane);
        const int face = static_cast<int>(cell.y) * columns_ + static_cast<int>(cell.x);
        if (cell.x < 0 || cell.x >= columns_ || face < 0 || face >= 6) return {};
        const auto& [ahead, right, down] = kFaces[static_cast<std::size_t>(face)];
        const glm::dvec2 at = 2.0 * (plane - cell) - 1.0;
        const double length = std::sqrt(glm::dot(at, at) + 1);
        const glm::dvec3 direction = (ahead + right * at.x + down * at.y) / length;
        const auto per = [&](const glm::dvec3& axis) {
            return (axis - direction * glm::dot(direction, axis)) * (2 / length);
        };
        return LensRay{direction, per(right), per(down)};
    }

  private:
    glm::dvec2 corner(int face) const { return glm::dvec2(face % columns_, face / columns_); }

    int columns_;
};

/// Returns the number of faces beside each other in a picture of this size.
int cubeColumns(const Size& size) {
    for (const int columns : {1, 2, 3, 6})
        if (size.width % columns == 0 && size.width / columns * (6 / columns) == size.height)
            return columns;
    throw Error(ErrorKind::kUsage, "the picture does not divide into the six faces of a cube",
                std::to_string(size.width) + "x" + std::to_string(size.height),
                "give a width of 6, 3, 2 or 1 faces and a height of 1, 2, 3 or 6");
}

}  // namespace

Intrinsics equirectangularFilling(const Size& size) {
    return {size.width / (2 * std::numbers::pi), size.height / std::numbers::pi,
            size.width / 2.0 - 0.5, size.height / 2.0 - 0.5};
}

std::unique_ptr<const LensShape> equirectangularShape(std::span<const double>, const Size&) {
    return std::make_unique<EquirectangularShape>();
}

Intrinsics cubeFilling(const Size& size) {
    const double side = size.width / static_cast<double>(cubeColumns(size));
    return {side, side, -0.5, -0.5};
}

std::unique_ptr<const LensShape> cubeShape(std::span<const double>, const Size& size) {
    return std::make_unique<CubeShape>(size == Size{} ? 1 : cubeColumns(size));
}

}  // namespace peeler
