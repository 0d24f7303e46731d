// SPDX-License-Identifier: Apache-2.0
// Look-at, rigid parts of node matrices, and fitting a box into a frame.
#include "cmd/framing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace peeler::cmd {

namespace {

/// Share of the frame that a framed scene may fill.
constexpr double kFill = 0.94;

/// Directions closer than this (sine of the angle) count as parallel.
constexpr double kParallel = 1e-7;

/// Unit length, or nothing. Divides by the largest component first: a tiny scene's matrix may hold
/// numbers whose squares vanish.
std::optional<glm::dvec3> normalized(const glm::dvec3& v) {
    const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    if (!(largest > 0) || !std::isfinite(largest)) return std::nullopt;
    return glm::normalize(v / largest);
}

std::array<glm::dvec3, 8> corners(const Bounds& bounds) {
    std::array<glm::dvec3, 8> points;
    for (int i = 0; i < 8; ++i) {
        points[static_cast<std::size_t>(i)] = {i & 1 ? bounds.max.x : bounds.min.x,
                                               i & 2 ? bounds.max.y : bounds.min.y,
                                               i & 4 ? bounds.max.z : bounds.min.z};
    }
    return points;
}

/// A corner as the camera's axes see it from `target`.
struct SeenCorner {
    double right, up, depth;
};

std::array<SeenCorner, 8> seenCorners(const Bounds& bounds, const glm::dvec3& target,
                                      const glm::dvec3& forward, const glm::dvec3& up) {
    const glm::dvec3 right = glm::normalize(glm::cross(forward, up));
    const glm::dvec3 above = glm::cross(right, forward);
    std::array<SeenCorner, 8> seen{};
    const auto points = corners(bounds);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const glm::dvec3 offset = points[i] - target;
        seen[i] = {std::abs(glm::dot(offset, right)), std::abs(glm::dot(offset, above)),
                   glm::dot(offset, forward)};
    }
    return seen;
}

}  // namespace

std::optional<glm::dmat4> lookAlong(const glm::dvec3& eye, const glm::dvec3& forward,
                                    const glm::dvec3& up) {
    const auto ahead = normalized(forward), upwards = normalized(up);
    if (!ahead || !upwards) return std::nullopt;
    const glm::dvec3 side = glm::cross(*ahead, *upwards);
    if (glm::length(side) < kParallel) return std::nullopt;
    const glm::dvec3 right = glm::normalize(side);
    const glm::dvec3 above = glm::normalize(glm::cross(right, *ahead));
    return glm::dmat4(glm::dvec4(right, 0), glm::dvec4(above, 0), glm::dvec4(-*ahead, 0),
                      glm::dvec4(eye, 1));
}

std::optional<glm::dmat4> rigid(const glm::dmat4& world) {
    return lookAlong(glm::dvec3(world[3]), -glm::dvec3(world[2]), glm::dvec3(world[1]));
}

glm::dvec3 pleasingForward(const glm::dvec3& up) {
    const double azimuth = glm::radians(35.0), elevation = glm::radians(20.0);
    const glm::dvec3 from{std::sin(azimuth) * std::cos(elevation), std::sin(elevation),
                          std::cos(azimuth) * std::cos(elevation)};
    // The shortest rotation that takes +Y to `up` (Rodrigues; cos = −1 turns about X).
    const glm::dvec3 axis = glm::cross(glm::dvec3(0, 1, 0), up);
    const double cosine = up.y;
    if (cosine < -1 + 1e-12) return {-from.x, from.y, from.z};
    const glm::dvec3 turned =
        from * cosine + glm::cross(axis, from) + axis * (glm::dot(axis, from) / (1 + cosine));
    return -glm::normalize(turned);
}

double sceneSize(const Bounds& bounds) {
    const double diagonal = glm::length(bounds.max - bounds.min);
    if (diagonal > 0) return diagonal;
    const glm::dvec3 place = glm::max(glm::abs(bounds.min), glm::abs(bounds.max));
    // A single point: any size will do if eye and target stay apart in double precision.
    return std::max(1.0, 1e-3 * std::max({place.x, place.y, place.z}));
}

glm::dvec3 framingEye(const Bounds& bounds, const glm::dvec3& target, const glm::dvec3& forward,
                      const glm::dvec3& up, const Projection& projection) {
    const double size = sceneSize(bounds);
    double distance = -std::numeric_limits<double>::infinity();
    for (const SeenCorner& corner : seenCorners(bounds, target, forward, up)) {
        // Flat and single-point scenes need no room sideways, but the eye must stay in front of
        // them.
        distance = std::max(distance, 0.05 * size - corner.depth);
        if (!projection.perspective) continue;
        distance =
            std::max(distance, corner.right / (kFill * projection.half_width) - corner.depth);
        distance = std::max(distance, corner.up / (kFill * projection.half_height) - corner.depth);
    }
    return target - forward * std::max(distance, 0.05 * size);
}

DepthRange depthRange(const Bounds& bounds, const glm::dmat4& camera_to_world) {
    const glm::dvec3 forward = -glm::dvec3(camera_to_world[2]), eye(camera_to_world[3]);
    DepthRange range{std::numeric_limits<double>::infinity(),
                     -std::numeric_limits<double>::infinity()};
    for (const glm::dvec3& corner : corners(bounds)) {
        const double depth = glm::dot(corner - eye, forward);
        range.nearest = std::min(range.nearest, depth);
        range.farthest = std::max(range.farthest, depth);
    }
    return range;
}

}  // namespace peeler::cmd
