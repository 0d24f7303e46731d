// SPDX-License-Identifier: Apache-2.0
// The grid that corners of triangles are snapped to, so that coverage is a matter of integers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include <peeler/view.h>

namespace peeler {

/// A corner on the grid, in its steps, y down. A snapped one is not negative in either.
struct SnappedCorner {
    std::int32_t x = kNowhere, y = kNowhere;

    static constexpr std::int32_t kNowhere = -1;
    bool operator==(const SnappedCorner&) const = default;
};

/// A grid with 2^bits steps from a ray of a view to the next one, of which each ray stands on a
/// point: 65,536 steps, or fewer in pictures of more than 16,384 pixels a side, so that products of
/// two distances on the grid fit into 64 bits. The grid is that of the display window: a crop has
/// the same one. It goes beyond the picture on all sides; triangles that reach farther are cut off
/// there (placedPolygon()).
class CornerGrid {
  public:
    explicit CornerGrid(const View& view);

    /// Coordinates are from 0 to this.
    static constexpr std::int32_t kLast = 0x7FFFFFFF;

    int bits() const { return bits_; }
    double steps() const { return static_cast<double>(std::int64_t{1} << bits_); }
    /// The ray of pixel (x, y) of the picture stands at (x + origin().x, y + origin().y) · steps().
    glm::ivec2 origin() const { return origin_; }

  private:
    int bits_;
    glm::ivec2 origin_;
};

/// A corner where it is: x and y in steps of the grid, Z of the camera.
struct PlacedCorner {
    double x = 0, y = 0, z = 0;
};

/// Whether a value may be rounded to a coordinate of the grid. NaN may not.
inline bool isOnGrid(double value) {
    return value >= 0 && value <= CornerGrid::kLast;
}

/// A triangle that was cut off: at most one corner more for each of five planes.
struct PlacedPolygon {
    std::array<PlacedCorner, 8> corner;
    std::size_t corners = 0;
};

/// From the space of a mesh to the grid and Z. All in double precision; the same corner comes out
/// the same wherever it is asked for.
class CornerPlacement {
  public:
    CornerPlacement(const View& view, const CornerGrid& grid, const glm::dmat4& world_from_model);

    bool perspective() const { return perspective_; }
    /// Pinholes see nothing that is nearer than this (scene units): a share of the near plane's
    /// distance.
    double nearest() const { return nearest_; }
    /// Where the axis of the view is on the grid.
    const glm::dvec2& middle() const { return middle_; }

    /// Of a pinhole the corner has to be in front of it.
    PlacedCorner place(const glm::vec3& position) const {
        PlacedCorner corner = unprojected(position);
        project(corner);
        return corner;
    }

    /// Snaps corners; those that are not on the grid, or not in front of a pinhole, become
    /// SnappedCorner::kNowhere.
    void snap(std::span<const glm::vec3> positions, SnappedCorner* out) const;

    /// What of a triangle is on the grid and in front of a pinhole; a polygon without corners if
    /// nothing is, or if a coordinate is not finite. The cut of an edge is the same whichever of
    /// its triangles asks and in whatever order its corners stand, so surfaces stay closed.
    PlacedPolygon placedPolygon(const std::array<glm::vec3, 3>& positions) const;

    /// Of a pinhole x and y are from middle() on and times Z: the corner where it is, in other
    /// units.
    PlacedCorner unprojected(const glm::vec3& p) const {
        const double x = double{p.x}, y = double{p.y}, z = double{p.z};
        return {x_[0] * x + x_[1] * y + x_[2] * z + x_[3],
                y_[0] * x + y_[1] * y + y_[2] * z + y_[3],
                z_[0] * x + z_[1] * y + z_[2] * z + z_[3]};
    }

  private:
    void project(PlacedCorner& corner) const {
        if (!perspective_) return;
        corner.x = corner.x / corner.z + middle_.x;
        corner.y = corner.y / corner.z + middle_.y;
    }

    bool perspective_;
    double nearest_;
    glm::dvec2 middle_;                // of the axis; orthographic: part of the rows
    std::array<double, 4> x_, y_, z_;  // rows of the matrix
};

/// Rounds a placed corner that is on the grid.
SnappedCorner snapped(const PlacedCorner& corner);

}  // namespace peeler
