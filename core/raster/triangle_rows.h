// SPDX-License-Identifier: Apache-2.0
// The rays that a triangle covers, row by row, in exact integer arithmetic.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>

#include "core/base/lanes.h"
#include "core/raster/corner_grid.h"

namespace peeler {

/// The rays of a section of a picture. They are numbered as in the grid (CornerGrid::origin()).
struct RayWindow {
    int bits = 0;
    std::int32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;

    /// Returns the first ray at or after a coordinate, which is in grid steps.
    std::int32_t rayFrom(std::int32_t coordinate) const {
        const std::uint32_t step = (std::uint32_t{1} << bits) - 1;
        return static_cast<std::int32_t>((static_cast<std::uint32_t>(coordinate) + step) >> bits);
    }
};

/// The points where successive rows cross an edge from `a` down to `b`. For each row, gives the
/// first ray on the edge or right of it, by Bresenham's quotient and remainder.
class EdgeRows {
  public:
    EdgeRows(const SnappedCorner& a, const SnappedCorner& b, std::int32_t row, int bits)
        : across_(std::int64_t{b.x} - a.x), down_(std::int64_t{b.y} - a.y), bits_(bits) {
        // The crossing is a.x + (y − a.y) · across / down. No intermediate value exceeds 2^63: the
        // sum of the two products is `down` times the crossing, and the crossing is on the grid.
        const std::int64_t y = std::int64_t{row} << bits;
        whole_ = down_ << bits;
        const std::int64_t sum = a.x * down_ + (y - a.y) * across_ + whole_ - 1;
        inverse_ = 1.0 / static_cast<double>(whole_);
        at_ = divided(sum, whole_, inverse_, rest_);
    }

    std::int32_t ray() const { return static_cast<std::int32_t>(at_); }

    /// Computes the step from row to row. Must be called before the first nextRow().
    void prepareSteps() {
        step_ = divided(across_, down_, inverse_ * static_cast<double>(std::int64_t{1} << bits_),
                        rest_step_);
        rest_step_ <<= bits_;
    }
    void nextRow() {
        at_ += step_;
        rest_ += rest_step_;
        const std::int64_t carry = rest_ >= whole_ ? 1 : 0;
        at_ += carry;
        rest_ -= whole_ & -carry;
    }

  private:
    /// Divides, and rounds the quotient down. Multiplies by the inverse in floating point and
    /// corrects the result, which is off by at most one (quotients are below 2^31): much faster
    /// than an integer division.
    static std::int64_t divided(std::int64_t value, std::int64_t by, double inverse,
                                std::int64_t& rest) {
        auto quotient = static_cast<std::int64_t>(static_cast<double>(value) * inverse);
        rest = value - quotient * by;
        while (rest < 0) {
            rest += by;
            --quotient;
        }
        while (rest >= by) {
            rest -= by;
            ++quotient;
        }
        return quotient;
    }

    std::int64_t across_, down_;
    int bits_;
    std::int64_t whole_ = 0, at_ = 0, rest_ = 0, step_ = 0, rest_step_ = 0;
    double inverse_ = 0;
};

/// Returns twice the area of a triangle, positive if its corners are clockwise (y is down).
inline std::int64_t doubledArea(const SnappedCorner& a, const SnappedCorner& b,
                                const SnappedCorner& c) {
    return (std::int64_t{b.x} - a.x) * (std::int64_t{c.y} - a.y) -
           (std::int64_t{c.x} - a.x) * (std::int64_t{b.y} - a.y);
}

/// The corners of a triangle, sorted from top to bottom. Corners of equal height are sorted from
/// left to right.
struct SortedTriangle {
    SortedTriangle(const SnappedCorner& a, const SnappedCorner& b, const SnappedCorner& c) {
        // Packs y, x and index into one integer, so that sorting needs no branches that could be
        // mispredicted.
        constexpr int kYShift = 33, kXShift = 2;
        const auto packed = [](const SnappedCorner& at, std::uint64_t place) {
            return static_cast<std::uint64_t>(at.y) << kYShift |
                   static_cast<std::uint64_t>(at.x) << kXShift | place;
        };
        std::uint64_t p = packed(a, 0), q = packed(b, 1), r = packed(c, 2);
        const auto order = [](std::uint64_t& low, std::uint64_t& high) {
            const std::uint64_t least = std::min(low, high), most = std::max(low, high);
            low = least;
            high = most;
        };
        order(p, q);
        order(q, r);
        order(p, q);
        const std::array<std::uint64_t, 3> sorted = {p, q, r};
        for (std::size_t i = 0; i < 3; ++i) {
            corner[i].y = static_cast<std::int32_t>(sorted[i] >> kYShift);
            corner[i].x = static_cast<std::int32_t>(sorted[i] >> kXShift & 0x7FFFFFFF);
            which[i] = static_cast<std::uint8_t>(sorted[i] & 3);
        }
        area = doubledArea(corner[0], corner[1], corner[2]);
    }

    /// Whether the corners are clockwise in their original order. The area must not be 0.
    bool clockwise() const {
        const bool turned = which[1] != (which[0] + 1) % 3;
        return (area > 0) != turned;
    }

    std::array<SnappedCorner, 3> corner;
    std::array<std::uint8_t, 3> which{};  ///< original indices of the corners
    std::int64_t area = 0;  ///< twice the area; positive if the middle corner is on the right
};

/// Emits the rays that a triangle covers, row by row, in 64-bit integers.
template <class Emit>
void forEachLongRow(const SortedTriangle& triangle, const RayWindow& window, Emit&& emit) {
    const auto& [a, b, c] = triangle.corner;
    const std::int32_t top = window.y0, bottom = window.y1;
    const std::int32_t middle = std::clamp(window.rayFrom(b.y), top, bottom);
    EdgeRows whole(a, c, top, window.bits);
    if (bottom - top > 1) whole.prepareSteps();
    const auto rows = [&](EdgeRows&& part, std::int32_t from, std::int32_t to) {
        if (to - from > 1) part.prepareSteps();
        const EdgeRows& left = triangle.area > 0 ? whole : part;
        const EdgeRows& right = triangle.area > 0 ? part : whole;
        for (std::int32_t row = from; row < to; ++row) {
            const std::int32_t first = std::max(left.ray(), window.x0);
            const std::int32_t end = std::min(right.ray(), window.x1);
            emit(row, first, end);
            whole.nextRow();
            part.nextRow();
        }
    };
    if (top < middle) rows(EdgeRows(a, b, top, window.bits), top, middle);
    if (middle < bottom) rows(EdgeRows(b, c, middle, window.bits), middle, bottom);
}

/// Emits the same rays as forEachLongRow() for a small triangle, two rows at once and without
/// branches. A crossing is the quotient of two numbers below 2^53, rounded to a double. Rounding
/// never moves a crossing onto or past an integer.
template <class Emit>
void forEachShortRow(const SortedTriangle& triangle, const RayWindow& window, Emit&& emit) {
    const auto& [a, b, c] = triangle.corner;
    const std::int64_t steps = std::int64_t{1} << window.bits;
    const std::int64_t x0 = window.x0 * steps, y0 = window.y0 * steps;
    const double width = window.x1 - window.x0;
    // The two short edges lie on the same side of the long edge. In each row, the covered rays lie
    // between the long edge and the nearer crossing of the short edges: the smaller crossing if the
    // short edges are on the right, the larger one if they are on the left. Multiplying by `sign`
    // turns the second case into the first.
    const double sign = triangle.area > 0 ? 1 : -1;
    struct Edge {
        double at, slope, down;
        TwoDoubles crossing(const TwoDoubles& y) const { return (at + y * slope) / down; }
    };
    const auto edge = [&](const SnappedCorner& from, const SnappedCorner& to) {
        const std::int64_t across = std::int64_t{to.x} - from.x, down = std::int64_t{to.y} - from.y;
        return Edge{static_cast<double>((from.x - x0) * down + (y0 - from.y) * across) * sign,
                    static_cast<double>(across) * sign * static_cast<double>(steps),
                    static_cast<double>(down) * static_cast<double>(steps)};
    };
    // A horizontal edge bounds no row, so it is replaced by the other short edge.
    const Edge whole = edge(a, c), upper = a.y == b.y ? edge(b, c) : edge(a, b),
               lower = b.y == c.y ? edge(a, b) : edge(b, c);
    const TwoDoubles none{}, all = none + width;
    TwoDoubles y = {0, 1};
    for (std::int32_t row = window.y0; row < window.y1; row += 2, y += 2) {
        const TwoDoubles one = whole.crossing(y) * sign;
        const TwoDoubles other = least(upper.crossing(y), lower.crossing(y)) * sign;
        const TwoDoubles left = least(most(least(one, other), none), all);
        const TwoDoubles right = least(most(most(one, other), none), all);
        for (int i = 0; i < 2; ++i) {
            const auto l = static_cast<std::int32_t>(left[i]),
                       r = static_cast<std::int32_t>(right[i]);
            const std::int32_t first = l + (left[i] > l ? 1 : 0), end = r + (right[i] > r ? 1 : 0);
            emit(row + i, window.x0 + first, window.x0 + (row + i < window.y1 ? end : 0));
        }
    }
}

/// Calls emit(row, first, end) with the rays that a triangle covers: rays inside the triangle and
/// on its left and top edges (the top-left rule). So a ray on a shared edge belongs to only one
/// triangle. In an empty row, first >= end. `window` must have at least one row. None of its rows
/// may be above or below the triangle.
template <class Emit>
void forEachRow(const SortedTriangle& triangle, const RayWindow& window, Emit&& emit) {
    constexpr std::int32_t kShort = 8, kSmall = 1 << 22;
    const auto& [a, b, c] = triangle.corner;
    const std::int32_t left = std::min({a.x, b.x, c.x}), right = std::max({a.x, b.x, c.x});
    if (window.y1 - window.y0 <= kShort && right - left < kSmall && c.y - a.y < kSmall)
        forEachShortRow(triangle, window, emit);
    else
        forEachLongRow(triangle, window, emit);
}

/// Emits the covered rays of any polygon, by parity: a ray is covered if it crosses an odd number
/// of edges.
template <class Emit>
void forEachRow(std::span<const SnappedCorner> corners, const RayWindow& window, Emit&& emit) {
    std::int32_t top = window.y1, bottom = window.y0;
    for (const SnappedCorner& corner : corners) {
        top = std::min(top, window.rayFrom(corner.y));
        bottom = std::max(bottom, window.rayFrom(corner.y));
    }
    top = std::max(top, window.y0);
    bottom = std::min(bottom, window.y1);
    std::array<std::int32_t, std::tuple_size_v<decltype(PlacedPolygon::corner)>> crossing{};
    for (std::int32_t row = top; row < bottom; ++row) {
        std::size_t crossings = 0;
        for (std::size_t i = 0; i < corners.size(); ++i) {
            SnappedCorner a = corners[i], b = corners[(i + 1) % corners.size()];
            if (b.y < a.y) std::swap(a, b);
            if (row < window.rayFrom(a.y) || row >= window.rayFrom(b.y)) continue;
            // Insertion sort, since there are only a few crossings.
            const std::int32_t ray = EdgeRows(a, b, row, window.bits).ray();
            std::size_t at = crossings++;
            for (; at > 0 && crossing[at - 1] > ray; --at)
                crossing[at] = crossing[at - 1];
            crossing[at] = ray;
        }
        for (std::size_t i = 0; i + 1 < crossings; i += 2) {
            const std::int32_t first = std::max(crossing[i], window.x0);
            const std::int32_t end = std::min(crossing[i + 1], window.x1);
            emit(row, first, end);
        }
    }
}

}  // namespace peeler
