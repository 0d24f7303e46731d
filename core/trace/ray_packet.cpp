// SPDX-License-Identifier: Apache-2.0
#include "core/trace/ray_packet.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/glm.hpp>

#include "core/trace/eight_lanes.h"

namespace peeler {

std::size_t RayPacket::take(std::span<const std::optional<ExactRay>> rays) {
    count_ = 0;
    cone_ = {};
    largest_moment_ = 0;
    for (const auto& ray : rays.first(std::min(rays.size(), kMost))) {
        RayCone wider = cone_;
        if (!add(ray, wider)) break;
        cone_ = wider;
    }
    return count_;
}

/// Adds a ray. Returns false if the packet would become too wide.
bool RayPacket::add(const std::optional<ExactRay>& added, RayCone& cone) {
    // The largest width of the cone, and the largest spread, 1/16 of half the scene. They do not
    // affect the hits.
    constexpr double kWidest = 0.25, kFarthest = 0x1p46;
    if (!added) return false;
    const ExactRay& ray = rays_[count_] = *added;
    if (count_ == 0) {
        std::size_t axis = 0;
        for (std::size_t i = 1; i < 3; ++i)
            if (std::abs(ray.direction[i]) > std::abs(ray.direction[axis])) axis = i;
        cone.origin = ray.origin;
        cone.axis = {static_cast<std::uint8_t>((axis + 1) % 3),
                     static_cast<std::uint8_t>((axis + 2) % 3), static_cast<std::uint8_t>(axis)};
        cone.backwards = ray.direction[axis] < 0;
    }
    const std::int64_t depth_part = ray.direction[cone.axis[2]];
    if (depth_part == 0 || (depth_part < 0) != cone.backwards) return false;
    const double depth = 1 / std::abs(static_cast<double>(depth_part));
    for (std::size_t k = 0; k < 2; ++k) {
        const double along = static_cast<double>(ray.direction[cone.axis[k]]) * depth;
        if (std::abs(along) > 1 + kWidest) return false;
        cone.low[k] = count_ == 0 ? along : std::min(cone.low[k], along);
        cone.high[k] = count_ == 0 ? along : std::max(cone.high[k], along);
        if (cone.high[k] - cone.low[k] > kWidest) return false;
    }
    glm::dvec3 direction, offset;
    for (int k = 0; k < 3; ++k) {
        const auto axis = static_cast<std::size_t>(k);
        direction[k] = static_cast<double>(ray.direction[axis]) * 0x1p-52;
        offset[k] = static_cast<double>(ray.origin[axis]) - static_cast<double>(cone.origin[axis]);
        cone.spread = std::max(cone.spread, std::abs(offset[k]));
    }
    if (cone.spread > kFarthest) return false;
    const glm::dvec3 moment = glm::cross(direction, offset);
    for (int k = 0; k < 3; ++k) {
        along_[static_cast<std::size_t>(k)][count_] = static_cast<float>(direction[k]);
        moment_[static_cast<std::size_t>(k)][count_] = static_cast<float>(moment[k]);
        largest_moment_ = std::max(largest_moment_, std::abs(moment[k]));
    }
    ++count_;
    return true;
}

namespace {

/// A plane through the eye and an edge, in floats. On its front, edgeSide() is as needed for a hit.
struct EdgePlane {
    std::array<float, 3> normal{};
    float error = 0;  ///< of normal · direction (README.md)
};

EdgePlane planeOf(const Cells& from, const Cells& edge, double sign) {
    const auto size = [](const Cells& v) {
        return std::max({std::abs(static_cast<double>(v[0])), std::abs(static_cast<double>(v[1])),
                         std::abs(static_cast<double>(v[2]))});
    };
    EdgePlane plane;
    double largest = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        const double part = static_cast<double>(from[j]) * static_cast<double>(edge[k]) -
                            static_cast<double>(from[k]) * static_cast<double>(edge[j]);
        plane.normal[i] = static_cast<float>(sign * part);
        largest = std::max(largest, std::abs(part));
    }
    plane.error = static_cast<float>(largest * 0x1p-20 + size(from) * size(edge) * 0x1p-48);
    return plane;
}

/// A plane through the first ray's origin and an edge, and the edge, in floats. For a ray, the sign
/// of normal · direction − edge · moment is edgeSide().
struct EdgeLine {
    std::array<float, 3> normal{}, edge{};
    float error = 0;  ///< of this difference (README.md)
};

EdgeLine lineOf(const Cells& from, const Cells& edge, const RayCone& cone, double moment) {
    const EdgePlane plane = planeOf(from, edge, 1);
    EdgeLine line{plane.normal, {}, 0};
    double largest = 0, longest = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        line.edge[i] = static_cast<float>(edge[i]);
        largest = std::max(largest, std::abs(static_cast<double>(plane.normal[i])));
        longest = std::max(longest, std::abs(static_cast<double>(edge[i])));
    }
    line.error = static_cast<float>(static_cast<double>(plane.error) + largest * 0x1p-20 +
                                    longest * (moment * 0x1p-19 + cone.spread * 0x1p-46));
    return line;
}

using RayLanes = std::array<std::array<float, RayPacket::kMost>, 3>;

/// Finds the rays that may pass inside the edges, and those that do for certain.
struct PlaneTest {
    std::uint64_t may = 0, inside = 0;
};

PEELER_INLINE void testPlanes(const std::array<EdgePlane, 3>& planes, const RayLanes& along,
                              std::size_t count, PlaneTest& test) {
    for (std::size_t first = 0; first < count; first += 8) {
        const EightFloats x = lanesAt(along[0].data() + first),
                          y = lanesAt(along[1].data() + first),
                          z = lanesAt(along[2].data() + first);
        EightInts out{}, near{};
        for (const EdgePlane& plane : planes) {
            const EightFloats side =
                x * plane.normal[0] + y * plane.normal[1] + z * plane.normal[2];
            out |= side < -plane.error;
            near |= side <= plane.error;
        }
        test.may |= std::uint64_t{bitsOf(out) ^ 0xFFU} << first;
        test.inside |= std::uint64_t{bitsOf(near) ^ 0xFFU} << first;
    }
}

PEELER_INLINE void testLines(const std::array<EdgeLine, 3>& lines, const RayLanes& along,
                             const RayLanes& moment, std::size_t count, PlaneTest& test) {
    for (std::size_t first = 0; first < count; first += 8) {
        const EightFloats x = lanesAt(along[0].data() + first),
                          y = lanesAt(along[1].data() + first),
                          z = lanesAt(along[2].data() + first),
                          u = lanesAt(moment[0].data() + first),
                          v = lanesAt(moment[1].data() + first),
                          w = lanesAt(moment[2].data() + first);
        EightInts some_left{}, some_right{}, near{};
        for (const EdgeLine& line : lines) {
            const EightFloats side =
                (x * line.normal[0] + y * line.normal[1] + z * line.normal[2]) -
                (u * line.edge[0] + v * line.edge[1] + w * line.edge[2]);
            const EightInts left = side > line.error, right = side < -line.error;
            some_left |= left;
            some_right |= right;
            near |= ~(left | right);
        }
        const unsigned out = bitsOf(some_left & some_right);
        test.may |= std::uint64_t{out ^ 0xFFU} << first;
        test.inside |= std::uint64_t{(out | bitsOf(near)) ^ 0xFFU} << first;
    }
}

#ifdef __x86_64__
[[gnu::target("avx2")]] void testPlanesOnAvx2(const std::array<EdgePlane, 3>& planes,
                                              const RayLanes& along, std::size_t count,
                                              PlaneTest& test) {
    testPlanes(planes, along, count, test);
}
[[gnu::target("avx2")]] void testLinesOnAvx2(const std::array<EdgeLine, 3>& lines,
                                             const RayLanes& along, const RayLanes& moment,
                                             std::size_t count, PlaneTest& test) {
    testLines(lines, along, moment, count, test);
}
#endif

}  // namespace

void RayPacket::addHits(const CellCorners& corners, std::uint32_t triangle,
                        std::vector<Hit>& hits) const {
    if (cone_.spread == 0) return addHitsOfEye(corners, triangle, hits);
    const auto& [a, b, c] = corners;
    const std::array<EdgeLine, 3> lines = {lineOf(a - cone_.origin, b - a, cone_, largest_moment_),
                                           lineOf(b - cone_.origin, c - b, cone_, largest_moment_),
                                           lineOf(c - cone_.origin, a - c, cone_, largest_moment_)};
    PlaneTest test;
#ifdef __x86_64__
    if (hasAvx2())
        testLinesOnAvx2(lines, along_, moment_, count_, test);
    else
#endif
        testLines(lines, along_, moment_, count_, test);
    test.may &= ~std::uint64_t{0} >> (64 - count_);
    for (std::uint64_t may = test.may; may != 0; may &= may - 1) {
        const auto i = static_cast<std::size_t>(std::countr_zero(may));
        if (const auto hit = exactHit(rays_[i], corners, (test.inside >> i & 1) != 0))
            hits.push_back({static_cast<std::uint32_t>(i), triangle, hit->t, hit->back});
    }
}

/// Appends the hits of rays that all begin at one point.
void RayPacket::addHitsOfEye(const CellCorners& corners, std::uint32_t triangle,
                             std::vector<Hit>& hits) const {
    const auto& [a, b, c] = corners;
    const Cells from_a = a - cone_.origin;
    const std::array<Wide, 3> normal = crossOf(b - a, c - a);
    const WideSum distance = dotOf(normal, from_a);
    const int ahead = aheadOf(distance, normal);
    const std::array<EdgePlane, 3> planes = {planeOf(from_a, b - a, ahead),
                                             planeOf(b - cone_.origin, c - b, ahead),
                                             planeOf(c - cone_.origin, a - c, ahead)};
    PlaneTest test;
#ifdef __x86_64__
    if (hasAvx2())
        testPlanesOnAvx2(planes, along_, count_, test);
    else
#endif
        testPlanes(planes, along_, count_, test);
    test.may &= ~std::uint64_t{0} >> (64 - count_);
    if (test.may == 0) return;
    const WideSum magnitude = distance.magnitude();
    for (std::uint64_t may = test.may; may != 0; may &= may - 1) {
        const auto i = static_cast<std::size_t>(std::countr_zero(may));
        const ExactRay& ray = rays_[i];
        if ((test.inside >> i & 1) == 0 &&
            (edgeSide(ray, a, b) != ahead || edgeSide(ray, b, c) != ahead ||
             edgeSide(ray, c, a) != ahead))
            continue;
        hits.push_back({static_cast<std::uint32_t>(i), triangle,
                        hitT(ray, magnitude, dotOf(normal, ray.direction).magnitude()), ahead > 0});
    }
}

}  // namespace peeler
