// SPDX-License-Identifier: Apache-2.0
// The rays that a triangle covers, row by row, in integers alone.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>

#include "core/raster/corner_grid.h"

namespace peeler {

/// The rays of a section of a picture, counted as the grid counts them (CornerGrid::origin()).
struct RayWindow {
    int bits = 0;
    std::int32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;

    /// The first ray at a coordinate or after it.
    std::int32_t rayFrom(std::int32_t coordinate) const {
        const std::uint32_t step = (std::uint32_t{1} << bits) - 1;
        return static_cast<std::int32_t>((static_cast<std::uint32_t>(coordinate) + step) >> bits);
    }
};

/// Where an edge from `a` down to `b` crosses one row after the other: the first ray on it or to
/// the right of it, by Bresenham's quotient and remainder.
class EdgeRows {
  public:
    EdgeRows(const SnappedCorner& a, const SnappedCorner& b, std::int32_t row, int bits)
        : across_(std::int64_t{b.x} - a.x), down_(std::int64_t{b.y} - a.y), bits_(bits) {
        // The crossing is a.x + (y − a.y) · across / down. Nothing here passes 2^63: the sum of the
        // two products is the crossing, which is on the grid, times `down`.
        const std::int64_t y = std::int64_t{row} << bits;
        whole_ = down_ << bits;
        const std::int64_t sum = a.x * down_ + (y - a.y) * across_ + whole_ - 1;
        inverse_ = 1.0 / static_cast<double>(whole_);
        at_ = divided(sum, whole_, inverse_, rest_);
    }

    std::int32_t ray() const { return static_cast<std::int32_t>(at_); }

    /// Before the first nextRow().
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
    /// Quotient, rounded down, and remainder. A product in floating point is off by one at most
    /// (quotients are below 2^31), and much sooner there than a division of integers.
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

/// Twice the area of a triangle, positive where its corners go clockwise as seen (y is down).
inline std::int64_t doubledArea(const SnappedCorner& a, const SnappedCorner& b,
                                const SnappedCorner& c) {
    return (std::int64_t{b.x} - a.x) * (std::int64_t{c.y} - a.y) -
           (std::int64_t{c.x} - a.x) * (std::int64_t{b.y} - a.y);
}

/// Calls emit(row, first, end) for the rays that a triangle covers: its inside, its left and its
/// top edges (the top-left rule), so that of two triangles at an edge one has the rays on it.
template <class Emit>
inline void forEachRow(SnappedCorner a, SnappedCorner b, SnappedCorner c, const RayWindow& window,
                       Emit&& emit) {
    if (b.y < a.y) std::swap(a, b);
    if (c.y < b.y) std::swap(b, c);
    if (b.y < a.y) std::swap(a, b);
    const std::int32_t top = std::max(window.rayFrom(a.y), window.y0);
    const std::int32_t bottom = std::min(window.rayFrom(c.y), window.y1);
    if (top >= bottom) return;
    const std::int32_t middle = std::clamp(window.rayFrom(b.y), top, bottom);
    const bool long_is_left = doubledArea(a, b, c) > 0;
    EdgeRows whole(a, c, top, window.bits);
    if (bottom - top > 1) whole.prepareSteps();
    const auto rows = [&](EdgeRows&& part, std::int32_t from, std::int32_t to) {
        if (to - from > 1) part.prepareSteps();
        const EdgeRows& left = long_is_left ? whole : part;
        const EdgeRows& right = long_is_left ? part : whole;
        for (std::int32_t row = from; row < to; ++row) {
            const std::int32_t first = std::max(left.ray(), window.x0);
            const std::int32_t end = std::min(right.ray(), window.x1);
            if (first < end) emit(row, first, end);
            whole.nextRow();
            part.nextRow();
        }
    };
    if (top < middle) rows(EdgeRows(a, b, top, window.bits), top, middle);
    if (middle < bottom) rows(EdgeRows(b, c, middle, window.bits), middle, bottom);
}

/// The same of any polygon, by parity: a ray is covered if it crosses an odd number of edges.
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
            // In order; they are few.
            const std::int32_t ray = EdgeRows(a, b, row, window.bits).ray();
            std::size_t at = crossings++;
            for (; at > 0 && crossing[at - 1] > ray; --at)
                crossing[at] = crossing[at - 1];
            crossing[at] = ray;
        }
        for (std::size_t i = 0; i + 1 < crossings; i += 2) {
            const std::int32_t first = std::max(crossing[i], window.x0);
            const std::int32_t end = std::min(crossing[i + 1], window.x1);
            if (first < end) emit(row, first, end);
        }
    }
}

}  // namespace peeler
