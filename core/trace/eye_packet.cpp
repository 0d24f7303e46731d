// SPDX-License-Identifier: Apache-2.0
#include "core/trace/eye_packet.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/trace/eight_lanes.h"

namespace peeler {

bool EyePacket::take(std::span<const std::optional<ExactRay>> rays) {
    // The largest width of the cone. It does not affect the hits.
    constexpr double kWidest = 0.25;
    if (rays.empty() || rays.size() > kMost || !rays[0]) return false;
    count_ = rays.size();
    const ExactRay& first = *rays[0];
    std::size_t axis = 0;
    for (std::size_t i = 1; i < 3; ++i)
        if (std::abs(first.direction[i]) > std::abs(first.direction[axis])) axis = i;
    cone_.origin = first.origin;
    cone_.axis = {static_cast<std::uint8_t>((axis + 1) % 3),
                  static_cast<std::uint8_t>((axis + 2) % 3), static_cast<std::uint8_t>(axis)};
    cone_.backwards = first.direction[axis] < 0;
    for (std::size_t i = 0; i < count_; ++i) {
        if (!rays[i] || rays[i]->origin != first.origin || rays[i]->start != first.start)
            return false;
        const ExactRay& ray = rays_[i] = *rays[i];
        if (ray.direction[axis] == 0 || (ray.direction[axis] < 0) != cone_.backwards) return false;
        const double depth = 1 / std::abs(static_cast<double>(ray.direction[axis]));
        for (std::size_t k = 0; k < 2; ++k) {
            const double along = static_cast<double>(ray.direction[cone_.axis[k]]) * depth;
            if (std::abs(along) > 1 + kWidest) return false;
            cone_.low[k] = i == 0 ? along : std::min(cone_.low[k], along);
            cone_.high[k] = i == 0 ? along : std::max(cone_.high[k], along);
        }
        for (std::size_t k = 0; k < 3; ++k)
            along_[k][i] = static_cast<float>(static_cast<double>(ray.direction[k]) * 0x1p-52);
    }
    return cone_.high[0] - cone_.low[0] <= kWidest && cone_.high[1] - cone_.low[1] <= kWidest;
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

using RayLanes = std::array<std::array<float, EyePacket::kMost>, 3>;

/// Finds the rays that may pass inside the three planes, and those that do for certain.
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

#ifdef __x86_64__
[[gnu::target("avx2")]] void testPlanesOnAvx2(const std::array<EdgePlane, 3>& planes,
                                              const RayLanes& along, std::size_t count,
                                              PlaneTest& test) {
    testPlanes(planes, along, count, test);
}
#endif

}  // namespace

void EyePacket::addHits(const CellCorners& corners, std::uint32_t triangle,
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
