// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <peeler/error.h>
#include "core/base/cross.h"
#include "formats/meshes/mesh_parts.h"

namespace peeler {
namespace {

constexpr std::uint64_t kMostSteps = std::uint64_t{1} << 29;

/// Returns Newell's normal (M. E. Newell; F. Tampieri, Graphics Gems III, V.5). Its length is twice
/// the polygon's area.
glm::dvec3 normalOf(std::span<const glm::vec3> corners) {
    glm::dvec3 normal(0);
    for (std::size_t i = 0; i < corners.size(); ++i) {
        // Subtract the first corner to keep precision far from the origin.
        const glm::dvec3 a = glm::dvec3(corners[i]) - glm::dvec3(corners[0]);
        const glm::dvec3 b = glm::dvec3(corners[(i + 1) % corners.size()]) - glm::dvec3(corners[0]);
        normal += glm::cross(a, b);
    }
    return normal;
}

}  // namespace

std::span<const PolygonCutter::Triangle> PolygonCutter::cut(std::span<const glm::vec3> corners) {
    triangles_.clear();
    left_ = static_cast<std::uint32_t>(corners.size());
    if (left_ < 3) return triangles_;
    if (left_ == 3) {
        fan();
        return triangles_;
    }
    spend(left_);
    project(corners);
    if (turnsOneWay())
        fan();
    else
        cutEars();
    return triangles_;
}

void PolygonCutter::fan() {
    for (std::uint32_t i = 1; i + 1 < left_; ++i)
        triangles_.push_back({0, i, i + 1});
}

/// Projects the corners by dropping a coordinate, which needs no rounding. If the polygon is seen
/// from behind, swaps the other two coordinates.
void PolygonCutter::project(std::span<const glm::vec3> corners) {
    const glm::dvec3 normal = normalOf(corners), size = glm::abs(normal);
    int axis = size.y > size.x ? 1 : 0;
    if (size.z > size[axis]) axis = 2;
    int across = (axis + 1) % 3, up = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(across, up);
    points_.resize(corners.size());
    for (std::size_t i = 0; i < corners.size(); ++i)
        points_[i] = {corners[i][across], corners[i][up]};
}

/// Returns twice the area of a triangle, which is positive if the corners are counter-clockwise.
double PolygonCutter::turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return cross(points_[b] - points_[a], points_[c] - points_[a]);
}

bool PolygonCutter::turnsOneWay() const {
    for (std::uint32_t i = 0; i < left_; ++i)
        if (!(turn((i + left_ - 1) % left_, i, (i + 1) % left_) > 0)) return false;
    return true;
}

void PolygonCutter::spend(std::uint64_t steps) {
    spent_ += steps;
    if (spent_ > kMostSteps)
        throw Error(ErrorKind::kInput, "cutting the polygons into triangles takes too long", "",
                    "split polygons with thousands of corners first");
}

/// Whether a corner is an ear: it is convex, and its triangle contains no other corner. Ignores
/// corners at the position of one of the triangle's corners, where the outline touches itself or
/// has a bridge to a hole.
bool PolygonCutter::isEar(std::uint32_t corner) const {
    const std::uint32_t a = previous_[corner], c = next_[corner];
    if (!(turn(a, corner, c) > 0)) return false;
    for (std::uint32_t other = next_[c]; other != a; other = next_[other]) {
        if (!reflex_[other]) continue;
        const glm::dvec2 p = points_[other];
        if (p == points_[a] || p == points_[corner] || p == points_[c]) continue;
        if (turn(a, corner, other) >= 0 && turn(corner, c, other) >= 0 && turn(c, a, other) >= 0)
            return false;
    }
    return true;
}

void PolygonCutter::cutOff(std::uint32_t corner) {
    const std::uint32_t a = previous_[corner], c = next_[corner];
    triangles_.push_back({a, corner, c});
    next_[a] = c;
    previous_[c] = a;
    --left_;
    for (const std::uint32_t side : {a, c})
        reflex_[side] = turn(previous_[side], side, next_[side]) > 0 ? 0 : 1;
}

void PolygonCutter::cutEars() {
    next_.resize(left_);
    previous_.resize(left_);
    reflex_.resize(left_);
    for (std::uint32_t i = 0; i < left_; ++i) {
        next_[i] = (i + 1) % left_;
        previous_[i] = (i + left_ - 1) % left_;
    }
    for (std::uint32_t i = 0; i < left_; ++i)
        reflex_[i] = turn(previous_[i], i, next_[i]) > 0 ? 0 : 1;
    std::uint32_t corner = 0, tried = 0;
    while (left_ > 3) {
        spend(left_);
        if (isEar(corner)) {
            // Skip the next corner, because cutting off adjacent ears would make a fan of slivers.
            const std::uint32_t after = next_[next_[corner]];
            cutOff(corner);
            corner = after;
            tried = 0;
        } else if (++tried < left_) {
            corner = next_[corner];
        } else {
            // A self-intersecting or collinear polygon may have no ear. Then cut off the flattest
            // corner.
            std::uint32_t best = corner;
            double least = std::numeric_limits<double>::infinity();
            for (std::uint32_t i = 0; i < left_; ++i, corner = next_[corner]) {
                const double area = std::abs(turn(previous_[corner], corner, next_[corner]));
                if (area < least) {
                    least = area;
                    best = corner;
                }
            }
            corner = next_[best];
            cutOff(best);
            tried = 0;
        }
    }
    triangles_.push_back({previous_[corner], corner, next_[corner]});
}

}  // namespace peeler
