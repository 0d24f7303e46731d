// SPDX-License-Identifier: Apache-2.0
#include "core/raster/corner_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace peeler {
namespace {

constexpr int kMostBits = 16;
// The grid extends 2^kHalfBits steps from the picture's centre in each direction.
constexpr int kHalfBits = 30;
// A pinhole's rays begin, and triangles are cut, at this fraction of the near plane's distance. The
// cut is never visible, because the near plane is farther away. The cut is far enough from the
// pinhole to keep projected coordinates bounded.
constexpr double kNearestShare = 1.0 / 1024;

/// Rounds to the nearest integer, ties to even. Adds a constant with which the integer ends up in
/// the lower bits of the sum. Unlike a conversion, the addition needs no function call and can be
/// vectorised.
std::int32_t roundedToEven(double value) {
    constexpr double kShift = 6755399441055744.0;  // 1.5 · 2^52
    return static_cast<std::int32_t>(std::bit_cast<std::uint64_t>(value + kShift));
}

}  // namespace

CornerGrid::CornerGrid(const View& view) {
    const auto side = static_cast<unsigned>(std::max({view.width, view.height, 1}));
    bits_ = std::clamp(kHalfBits - static_cast<int>(std::bit_width(side - 1)), 0, kMostBits);
    const int half = 1 << (kHalfBits - bits_);
    origin_ = {half - view.width / 2, half - view.height / 2};
}

CornerPlacement::CornerPlacement(const View& view, const CornerGrid& grid,
                                 const glm::dmat4& world_from_model)
    : perspective_(view.projection.perspective),
      nearest_(view.projection.near * kNearestShare),
      middle_(
          (0.5 * glm::dvec2(view.width, view.height) - view.sample + glm::dvec2(grid.origin())) *
          grid.steps()) {
    const glm::dmat4 camera_from_model = glm::inverse(view.camera_to_world) * world_from_model;
    const double across = 0.5 * view.width / view.projection.half_width * grid.steps();
    const double down = -0.5 * view.height / view.projection.half_height * grid.steps();
    for (int i = 0; i < 4; ++i) {
        const auto at = static_cast<std::size_t>(i);
        x_[at] = across * camera_from_model[i].x;
        y_[at] = down * camera_from_model[i].y;
        z_[at] = -camera_from_model[i].z;
    }
    if (perspective_) return;
    x_[3] += middle_.x;
    y_[3] += middle_.y;
}

void CornerPlacement::snap(std::span<const glm::vec3> positions, SnappedCorner* out) const {
    if (perspective_) {
        for (const glm::vec3& position : positions) {
            PlacedCorner corner = unprojected(position);
            const bool ahead = corner.z >= nearest_;
            project(corner);
            *out++ = ahead && isOnGrid(corner.x) && isOnGrid(corner.y) ? snapped(corner)
                                                                       : SnappedCorner{};
        }
        return;
    }
    for (const glm::vec3& position : positions) {
        const PlacedCorner corner = unprojected(position);
        *out++ = isOnGrid(corner.x) && isOnGrid(corner.y) && std::isfinite(corner.z)
                     ? snapped(corner)
                     : SnappedCorner{};
    }
}

SnappedCorner snapped(const PlacedCorner& corner) {
    return {roundedToEven(corner.x), roundedToEven(corner.y)};
}

namespace {

/// Clips a polygon to the side where `inside` is not negative. The cut point of an edge is always
/// computed from the edge's end on this side, so both triangles at the edge get the same point.
template <class Inside>
void keepInside(PlacedPolygon& polygon, Inside&& inside) {
    PlacedPolygon kept;
    for (std::size_t i = 0; i < polygon.corners; ++i) {
        const PlacedCorner& a = polygon.corner[i];
        const PlacedCorner& b = polygon.corner[(i + 1) % polygon.corners];
        const double of_a = inside(a), of_b = inside(b);
        if (of_a >= 0) kept.corner[kept.corners++] = a;
        if ((of_a >= 0) == (of_b >= 0)) continue;
        const PlacedCorner& in = of_a >= 0 ? a : b;
        const PlacedCorner& out = of_a >= 0 ? b : a;
        const double of_in = std::max(of_a, of_b), share = of_in / (of_in - std::min(of_a, of_b));
        kept.corner[kept.corners++] = {in.x + share * (out.x - in.x), in.y + share * (out.y - in.y),
                                       in.z + share * (out.z - in.z)};
    }
    polygon = kept;
}

}  // namespace

PlacedPolygon CornerPlacement::placedPolygon(const std::array<glm::vec3, 3>& positions) const {
    PlacedPolygon polygon;
    for (const glm::vec3& position : positions) {
        const PlacedCorner corner = unprojected(position);
        if (!std::isfinite(corner.x) || !std::isfinite(corner.y) || !std::isfinite(corner.z))
            return {};
        polygon.corner[polygon.corners++] = corner;
    }
    if (perspective_) {
        keepInside(polygon, [&](const PlacedCorner& c) { return c.z - nearest_; });
        for (std::size_t i = 0; i < polygon.corners; ++i) {
            // Rounding may have moved a corner from the cut plane towards the camera.
            polygon.corner[i].z = std::max(polygon.corner[i].z, nearest_);
            project(polygon.corner[i]);
        }
    }
    constexpr double kEnd = CornerGrid::kLast;
    keepInside(polygon, [](const PlacedCorner& c) { return c.x; });
    keepInside(polygon, [](const PlacedCorner& c) { return kEnd - c.x; });
    keepInside(polygon, [](const PlacedCorner& c) { return c.y; });
    keepInside(polygon, [](const PlacedCorner& c) { return kEnd - c.y; });
    for (std::size_t i = 0; i < polygon.corners; ++i) {
        polygon.corner[i].x = std::clamp(polygon.corner[i].x, 0.0, kEnd);
        polygon.corner[i].y = std::clamp(polygon.corner[i].y, 0.0, kEnd);
    }
    return polygon;
}

}  // namespace peeler
