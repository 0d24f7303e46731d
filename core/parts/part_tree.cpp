// SPDX-License-Identifier: Apache-2.0
#include "core/parts/part_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace peeler {
namespace {

constexpr std::uint32_t kLeafTriangles = 4;

/// Directions that are unlikely to be parallel to an edge or a plane.
constexpr std::array<std::array<double, 3>, 8> kOddDirections{{
    {0.41283, 0.63127, 0.65648},
    {-0.57713, 0.27149, 0.77021},
    {0.71927, -0.48311, 0.49891},
    {0.30169, 0.82051, -0.48567},
    {-0.23917, -0.59441, 0.76763},
    {0.87541, 0.11863, 0.46851},
    {-0.68213, 0.69119, 0.23873},
    {0.15287, -0.93481, 0.32057},
}};

}  // namespace

Bounds boundsOf(const std::array<glm::dvec3, 3>& corners) {
    return {glm::min(corners[0], glm::min(corners[1], corners[2])),
            glm::max(corners[0], glm::max(corners[1], corners[2]))};
}

CheckedLine::CheckedLine(const glm::dvec3& origin, const glm::dvec3& direction)
    : origin_(origin), direction_(direction), inverse_(1.0 / (direction + 0.0)) {
    const glm::dvec3 size = glm::abs(direction);
    z_ = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    x_ = (z_ + 1) % 3;
    y_ = (x_ + 1) % 3;
    if (direction[z_] < 0) std::swap(x_, y_);
    shear_ = {direction[x_] / direction[z_], direction[y_] / direction[z_], 1 / direction[z_]};
}

bool CheckedLine::meets(const Bounds& box, double from, double to) const {
    // If a component of the direction is 0, `near` and `far` are infinite, or NaN if the origin is
    // in the plane of a side. The comparisons below are correct for infinities, and ignore NaN. The
    // constructor turns −0 into +0; otherwise, the far side could be at −infinity.
    constexpr double kSlack = 1e-12;
    for (int i = 0; i < 3; ++i) {
        double near = (box.min[i] - origin_[i]) * inverse_[i];
        double far = (box.max[i] - origin_[i]) * inverse_[i];
        if (near > far) std::swap(near, far);
        // Allows for rounding, so that triangles in a side of their box are not lost.
        near *= near > 0 ? 1 - kSlack : 1 + kSlack;
        far *= far > 0 ? 1 + kSlack : 1 - kSlack;
        if (near > from) from = near;
        if (far < to) to = far;
    }
    return from <= to;
}

std::optional<LineHit> CheckedLine::meets(const std::array<glm::dvec3, 3>& corners) const {
    std::array<glm::dvec3, 3> p{};
    for (std::size_t i = 0; i < 3; ++i) {
        const glm::dvec3 to = corners[i] - origin_;
        p[i] = {to[x_] - shear_.x * to[z_], to[y_] - shear_.y * to[z_], shear_.z * to[z_]};
    }
    const double u = p[2].x * p[1].y - p[2].y * p[1].x;
    const double v = p[0].x * p[2].y - p[0].y * p[2].x;
    const double w = p[1].x * p[0].y - p[1].y * p[0].x;
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return std::nullopt;
    const double sum = u + v + w;
    if (sum == 0) return std::nullopt;
    LineHit hit;
    hit.t = (u * p[0].z + v * p[1].z + w * p[2].z) / sum;
    hit.leaves = sum < 0;
    hit.on_edge = u == 0 || v == 0 || w == 0;
    return hit;
}

PartTree::PartTree(const PartMesh& mesh) : mesh_(mesh), order_(mesh.triangles.size()) {
    if (order_.empty()) return;
    std::iota(order_.begin(), order_.end(), 0U);
    std::vector<Bounds> boxes;
    boxes.reserve(order_.size());
    for (std::size_t t = 0; t < order_.size(); ++t)
        boxes.push_back(boundsOf(mesh.corners(t)));
    nodes_.reserve(order_.size());
    nodes_.emplace_back();
    build(0, 0, static_cast<std::uint32_t>(order_.size()), boxes);
}

void PartTree::build(std::uint32_t node, std::uint32_t begin, std::uint32_t end,
                     const std::vector<Bounds>& boxes) {
    Bounds box = boxes[order_[begin]];
    Bounds middles{box.min + box.max, box.min + box.max};
    for (std::uint32_t i = begin; i < end; ++i) {
        const Bounds& one = boxes[order_[i]];
        box.min = glm::min(box.min, one.min);
        box.max = glm::max(box.max, one.max);
        middles.min = glm::min(middles.min, one.min + one.max);
        middles.max = glm::max(middles.max, one.min + one.max);
    }
    nodes_[node].box = box;
    if (end - begin <= kLeafTriangles) {
        nodes_[node].first = begin;
        nodes_[node].count = end - begin;
        return;
    }
    const glm::dvec3 size = middles.max - middles.min;
    const int axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    const std::uint32_t half = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + half, order_.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) {
                         const double x = boxes[a].min[axis] + boxes[a].max[axis];
                         const double y = boxes[b].min[axis] + boxes[b].max[axis];
                         return x < y || (x == y && a < b);
                     });
    const auto children = static_cast<std::uint32_t>(nodes_.size());
    nodes_[node].first = children;
    nodes_.resize(nodes_.size() + 2);
    build(children, begin, half, boxes);
    build(children + 1, half, end, boxes);
}

int PartTree::windingInFront(const glm::dvec3& point, const glm::dvec3& normal, double near) const {
    // The minimum cosine between ray and normal. Rays with a smaller cosine stay too close to the
    // surface.
    constexpr double kLeast = 0.15;
    constexpr double kEnd = std::numeric_limits<double>::infinity();
    int winding = 0;
    for (const auto& [x, y, z] : kOddDirections) {
        glm::dvec3 direction = glm::normalize(glm::dvec3(x, y, z));
        const double toward = glm::dot(direction, normal);
        if (std::abs(toward) < kLeast * glm::length(normal)) continue;
        if (toward < 0) direction = -direction;
        const CheckedLine line(point, direction);
        bool sure = true;
        winding = 0;
        visit([&](const Bounds& box) { return line.meets(box, 0, kEnd); },
              [&](std::uint32_t t) {
                  const auto hit = line.meets(mesh_.corners(t));
                  if (!hit || hit->t <= near) return;
                  winding += hit->leaves ? 1 : -1;
                  sure = sure && !hit->on_edge;
              });
        if (sure) break;
    }
    return winding;
}

}  // namespace peeler
