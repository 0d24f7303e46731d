// SPDX-License-Identifier: Apache-2.0
// The integer grid to which triangle corners are snapped, so that coverage is exact.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include <peeler/view.h>

namespace peeler {

/// A corner in grid steps, y down. Both coordinates are kNowhere if the corner is off the grid.
/// Otherwise both are 0 or greater.
struct SnappedCorner {
    std::int32_t x = kNowhere, y = kNowhere;

    static constexpr std::int32_t kNowhere = -1;
    bool operator==(const SnappedCorner&) const = default;
};

/// A grid with 2^bits steps between neighbouring rays of a view. Every ray is on a grid point.
/// There are 65,536 steps, or fewer for pictures of more than 16,384 pixels per side, so that
/// products of two grid distances fit into 64 bits. The grid depends only on the display window,
/// not on the crop. The grid extends beyond the picture on all sides; triangles are clipped to it
/// (placedPolygon()).
class CornerGrid {
  public:
    explicit CornerGrid(const View& view);

    /// The maximum coordinate; the minimum is 0.
    static constexpr std::int32_t kLast = 0x7FFFFFFF;

    int bits() const { return bits_; }
    double steps() const { return static_cast<double>(std::int64_t{1} << bits_); }
    /// Returns the grid's offset. The ray of pixel (x, y) of the picture is at (x + origin().x, y +
    /// origin().y) · steps().
    glm::ivec2 origin() const { return origin_; }

  private:
    int bits_;
    glm::ivec2 origin_;
};

/// An unsnapped corner: x and y in grid steps, and camera Z.
struct PlacedCorner {
    double x = 0, y = 0, z = 0;
};

/// Whether a value can be rounded to a grid coordinate. False for NaN.
inline bool isOnGrid(double value) {
    return value >= 0 && value <= CornerGrid::kLast;
}

/// A clipped triangle. It has at most eight corners, since each of the five clipping planes adds at
/// most one corner.
struct PlacedPolygon {
    std::array<PlacedCorner, 8> corner;
    std::size_t corners = 0;
};

/// The transform from mesh space to grid coordinates and camera Z, in double precision. Equal
/// positions always give equal results.
class CornerPlacement {
  public:
    CornerPlacement(const View& view, const CornerGrid& grid, const glm::dmat4& world_from_model);

    bool perspective() const { return perspective_; }
    /// Returns the distance (scene units) at which a pinhole's rays begin: a fraction of the near
    /// plane's distance.
    double nearest() const { return nearest_; }
    /// Returns the grid position of the view's axis.
    const glm::dvec2& middle() const { return middle_; }

    /// Places a corner. It must be in front of the camera if the camera is a pinhole.
    PlacedCorner place(const glm::vec3& position) const {
        PlacedCorner corner = unprojected(position);
        project(corner);
        return corner;
    }

    /// Snaps corners. A corner off the grid, or not in front of a pinhole, becomes
    /// SnappedCorner::kNowhere.
    void snap(std::span<const glm::vec3> positions, SnappedCorner* out) const;

    /// Clips a triangle to the grid and to the space in front of a pinhole. Returns a polygon
    /// without corners if nothing remains, or if a coordinate is not finite. An edge shared by two
    /// triangles is cut at exactly the same point in both, so surfaces stay closed.
    PlacedPolygon placedPolygon(const std::array<glm::vec3, 3>& positions) const;

    /// Transforms a position without the perspective division. For a pinhole, x and y are relative
    /// to middle() and multiplied by Z.
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
    // Grid position of the axis. For an orthographic camera, x_ and y_ include this position.
    glm::dvec2 middle_;
    std::array<double, 4> x_, y_, z_;  // rows of the transform to grid x, grid y and camera Z
};

/// Rounds a placed corner that is on the grid.
SnappedCorner snapped(const PlacedCorner& corner);

}  // namespace peeler
