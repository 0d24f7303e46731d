// SPDX-License-Identifier: Apache-2.0
#include "core/trace/ray_packet.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/glm.hpp>
#include <limits>

#include "core/trace/eight_lanes.h"

namespace peeler {
namespace {

constexpr double kUnit = TriangleBlock::kUnit;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

std::size_t RayPacket::take(std::span<const std::optional<ExactRay>> rays) {
    rays_ = rays;
    cone_ = {};
    count_ = 0;
    if (rays.empty() || !rays.front()) return 0;
    const ExactRay& first = *rays.front();
    std::size_t axis = 0;
    for (std::size_t i = 1; i < 3; ++i)
        if (std::abs(first.direction[i]) > std::abs(first.direction[axis])) axis = i;
    cone_.origin = first.origin;
    cone_.axis = {static_cast<std::uint8_t>((axis + 1) % 3),
                  static_cast<std::uint8_t>((axis + 2) % 3), static_cast<std::uint8_t>(axis)};
    cone_.backwards = first.direction[axis] < 0;
    const std::size_t most = std::min(rays.size(), kMost);
    for (; count_ < most && rays[count_]; ++count_) {
        const ExactRay& ray = *rays[count_];
        const Cells offset = ray.origin - first.origin;
        for (std::size_t k = 0; k < 3; ++k) {
            along_[k][count_] = static_cast<double>(ray.direction[k]);
            offset_[k][count_] = static_cast<double>(offset[k]);
        }
        scale_[count_] =
            ray.start == 0 ? powerOfTwo(ray.exponent) : std::numeric_limits<double>::quiet_NaN();
    }
    while (count_ > 1 && !isClose(count_))
        count_ /= 2;
    if (count_ == 1) isClose(1);
    return count_;
}

/// Finds the cone of the first rays. Returns false if they are not close to each other.
bool RayPacket::isClose(std::size_t count) {
    // The largest width of the cone, and the largest spread, 1/16 of half the scene. They do not
    // affect the hits.
    constexpr double kWidest = 0.25, kFarthest = 0x1p46;
    const auto& depths = along_[cone_.axis[2]];
    const double sign = cone_.backwards ? -1 : 1;
    double least_depth = 1;
    for (std::size_t i = 0; i < count; ++i)
        least_depth = std::min(least_depth, sign * depths[i]);
    if (!(least_depth > 0)) return false;
    for (std::size_t k = 0; k < 2; ++k) {
        const auto& parts = along_[cone_.axis[k]];
        double low = kInfinity, high = -kInfinity;
        for (std::size_t i = 0; i < count; ++i) {
            const double slope = parts[i] * (sign / depths[i]);
            low = std::min(low, slope);
            high = std::max(high, slope);
        }
        if (low < -1 - kWidest || high > 1 + kWidest || high - low > kWidest) return false;
        cone_.low[k] = low;
        cone_.high[k] = high;
    }
    cone_.spread = 0;
    for (const auto& offsets : offset_)
        for (std::size_t i = 0; i < count; ++i)
            cone_.spread = std::max(cone_.spread, std::abs(offsets[i]));
    if (cone_.spread > kFarthest) return false;
    largest_moment_ = 0;
    constexpr double kDirection = 0x1p-52;
    for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
        for (std::size_t i = 0; i < count; ++i)
            direction_[k][i] = static_cast<float>(along_[k][i] * kDirection);
        if (cone_.spread == 0) continue;
        for (std::size_t i = 0; i < count; ++i) {
            const double moment = (along_[l][i] * offset_[m][i] - along_[m][i] * offset_[l][i]) *
                                  (kDirection * kUnit);
            moment_[k][i] = static_cast<float>(moment);
            largest_moment_ = std::max(largest_moment_, std::abs(moment));
        }
    }
    return true;
}

namespace {

/// The edges of a block's triangles, and the normals of their planes through a point. For a ray,
/// the sign of normal · direction − edge · moment is edgeSide().
struct BlockEdges {
    EightFloats normal[3][3], edge[3][3];  ///< by edge and axis
    EightFloats error;                     ///< of this difference (README.md)
};

/// Bounds of errors (README.md).
struct EdgeErrors {
    float per_edge = 0, least = 0;
};

PEELER_INLINE void findEdges(const TriangleBlock& block, const std::array<float, 3>& origin,
                             const EdgeErrors& errors, BlockEdges& edges) {
    EightFloats from[3][3], farthest{}, longest{};
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
            from[i][k] = lanesAt(block.corner[i][k].data()) - origin[k];
            raise(farthest, from[i][k]);
            raise(farthest, -from[i][k]);
            edges.edge[i][k] =
                lanesAt(block.corner[(i + 1) % 3][k].data()) - lanesAt(block.corner[i][k].data());
            raise(longest, edges.edge[i][k]);
            raise(longest, -edges.edge[i][k]);
        }
    }
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
            edges.normal[i][k] = from[i][l] * edges.edge[i][m] - from[i][m] * edges.edge[i][l];
        }
    }
    edges.error =
        farthest * (longest * 0x1p-18F + 0x1p-21F) + longest * errors.per_edge + errors.least;
}

glm::dvec3 vector(const Cells& v) {
    return {v[0], v[1], v[2]};
}
double size(const glm::dvec3& v) {
    return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

using FourDoubles = double __attribute__((vector_size(32), may_alias));

PEELER_INLINE const FourDoubles& fourAt(const double* lanes) {
    return *reinterpret_cast<const FourDoubles*>(lanes);
}

}  // namespace

/// The tests of a packet. Compiled for several processors.
struct PacketTests {
    /// What is known about t of the rays' intersections with a triangle's plane, as bits.
    struct Times {
        std::uint64_t known = 0;   ///< of the rays whose t is known
        std::uint64_t behind = 0;  ///< of the rays that begin behind the plane for certain
        std::uint64_t back = 0;    ///< of the rays that leave through the plane, if known
        std::array<float, RayPacket::kMost> t;
    };

    /// Tests rays and a triangle of a block.
    template <bool kSpread>
    PEELER_INLINE static void testRays(const RayPacket& packet, const BlockEdges& edges,
                                       std::size_t lane, PacketCandidate& candidate) {
        const float error = edges.error[lane];
        for (std::size_t first = 0; first < packet.count_; first += 8) {
            const auto at = [&](const auto& lanes, std::size_t axis) -> const EightFloats& {
                return lanesAt(lanes[axis].data() + first);
            };
            EightFloats low, high;
            for (std::size_t i = 0; i < 3; ++i) {
                const auto& normal = edges.normal[i];
                EightFloats side = at(packet.direction_, 0) * normal[0][lane] +
                                   at(packet.direction_, 1) * normal[1][lane] +
                                   at(packet.direction_, 2) * normal[2][lane];
                if constexpr (kSpread) {
                    const auto& edge = edges.edge[i];
                    side = side - (at(packet.moment_, 0) * edge[0][lane] +
                                   at(packet.moment_, 1) * edge[1][lane] +
                                   at(packet.moment_, 2) * edge[2][lane]);
                }
                if (i == 0) low = high = side;
                lower(low, side);
                raise(high, side);
            }
            const unsigned may = bitsOf((low < -error) & (high > error)) ^ 0xFFU;
            const unsigned inside = bitsOf((low > error) | (high < -error));
            candidate.may |= std::uint64_t{may} << first;
            candidate.inside |= std::uint64_t{inside} << first;
        }
    }

    template <bool kSpread>
    PEELER_INLINE static void testBlocks(const RayPacket& packet, std::span<const BlockPart> blocks,
                                         std::vector<PacketCandidate>& found) {
        std::array<float, 3> origin{};
        double farthest = 1;
        for (std::size_t k = 0; k < 3; ++k) {
            const double at = static_cast<double>(packet.cone_.origin[k]) * kUnit;
            origin[k] = static_cast<float>(at);
            farthest = std::max(farthest, 1 + std::abs(at));
        }
        const double moment = packet.largest_moment_, spread = packet.cone_.spread * kUnit;
        const EdgeErrors errors{
            static_cast<float>(farthest * 0x1p-21 + moment * 0x1p-19 + spread * 0x1p-46),
            static_cast<float>(moment * 0x1p-22)};
        const std::uint64_t all = ~std::uint64_t{0} >> (RayPacket::kMost - packet.count_);
        BlockEdges edges;
        for (const auto& [block, lanes] : blocks) {
            findEdges(*block, origin, errors, edges);
            for (unsigned left = lanes; left != 0; left &= left - 1) {
                const auto lane = static_cast<std::size_t>(std::countr_zero(left));
                PacketCandidate candidate{block->triangle[lane]};
                testRays<kSpread>(packet, edges, lane, candidate);
                candidate.may &= all;
                if (candidate.may != 0) found.push_back(candidate);
            }
        }
    }
    PEELER_INLINE static void testBlocks(const RayPacket& packet, std::span<const BlockPart> blocks,
                                         std::vector<PacketCandidate>& found) {
        if (packet.cone_.spread == 0)
            testBlocks<false>(packet, blocks, found);
        else
            testBlocks<true>(packet, blocks, found);
    }

    /// Decides in double precision which rays pass inside, where floats did not.
    PEELER_INLINE static void testEdges(const RayPacket& packet, const CellCorners& corners,
                                        PacketCandidate& candidate) {
        std::array<glm::dvec3, 3> edge, normal;
        double farthest = packet.cone_.spread, longest = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            const glm::dvec3 from = vector(corners[i] - packet.cone_.origin);
            edge[i] = vector(corners[(i + 1) % 3] - corners[i]);
            normal[i] = glm::cross(from, edge[i]);
            farthest = std::max(farthest, packet.cone_.spread + size(from));
            longest = std::max(longest, size(edge[i]));
        }
        const double error = longest * farthest * (0x1p52 * 0x1p-47);
        const std::uint64_t open = candidate.may & ~candidate.inside;
        for (std::size_t first = 0; first < packet.count_; first += 4) {
            if ((open >> first & 0xF) == 0) continue;
            const auto& [x, y, z] = packet.along_;
            const auto& [u, v, w] = packet.offset_;
            const FourDoubles moment[3] = {
                fourAt(&y[first]) * fourAt(&w[first]) - fourAt(&z[first]) * fourAt(&v[first]),
                fourAt(&z[first]) * fourAt(&u[first]) - fourAt(&x[first]) * fourAt(&w[first]),
                fourAt(&x[first]) * fourAt(&v[first]) - fourAt(&y[first]) * fourAt(&u[first])};
            FourDoubles low, high;
            for (std::size_t i = 0; i < 3; ++i) {
                FourDoubles side;
                dot(packet.along_, first, normal[i], side);
                side =
                    side - (moment[0] * edge[i].x + moment[1] * edge[i].y + moment[2] * edge[i].z);
                if (i == 0) low = high = side;
                low = side < low ? side : low;
                high = side > high ? side : high;
            }
            const auto bits = [&](const auto& lanes) {
                return std::uint64_t{bitsOf(__builtin_convertvector(lanes, FourInts))} << first;
            };
            candidate.may &= ~bits((low < -error) & (high > error));
            candidate.inside |= bits((low > error) | (high < -error));
        }
    }

    PEELER_INLINE static void dot(const RayPacket::Lanes<double>& lanes, std::size_t first,
                                  const glm::dvec3& normal, FourDoubles& result) {
        result = fourAt(lanes[0].data() + first) * normal.x +
                 fourAt(lanes[1].data() + first) * normal.y +
                 fourAt(lanes[2].data() + first) * normal.z;
    }

    /// Finds t in double precision where its error does not matter (README.md).
    PEELER_INLINE static void findTimes(const RayPacket& packet, const CellCorners& corners,
                                        PacketCandidate& candidate, Times& times) {
        if (candidate.may != candidate.inside) testEdges(packet, corners, candidate);
        const glm::dvec3 from = vector(corners[0] - packet.cone_.origin),
                         u = vector(corners[1] - corners[0]), v = vector(corners[2] - corners[0]),
                         normal = glm::cross(u, v);
        const double plane = glm::dot(normal, from), area = size(u) * size(v),
                     plane_error = area * (size(from) + packet.cone_.spread) * 0x1p-47,
                     along_error = area * (0x1p52 * 0x1p-47);
        constexpr float kLeast = std::numeric_limits<float>::min(),
                        kMost = std::numeric_limits<float>::max();
        for (std::size_t first = 0; first < packet.count_; first += 4) {
            if ((candidate.may >> first & 0xF) == 0) continue;
            FourDoubles along, across;
            dot(packet.along_, first, normal, along);
            dot(packet.offset_, first, normal, across);
            const FourDoubles inverse = 1 / along, quotient = (plane - across) * inverse;
            FourDoubles size_of = quotient < 0 ? -quotient : quotient,
                        per_along = inverse < 0 ? -inverse : inverse;
            per_along = per_along * along_error < 0x1p-20 ? per_along : kInfinity;
            const FourDoubles error =
                (plane_error + size_of * along_error) * per_along * 1.01 + size_of * 0x1p-50;
            const FourDoubles& scale = fourAt(packet.scale_.data() + first);
            const FourFloats least =
                                 __builtin_convertvector((quotient - error) * scale, FourFloats),
                             most = __builtin_convertvector((quotient + error) * scale, FourFloats),
                             sign = __builtin_convertvector(along, FourFloats);
            std::memcpy(times.t.data() + first, &least, sizeof(least));
            const auto bits = [&](const FourInts& lanes) {
                return std::uint64_t{bitsOf(lanes)} << first;
            };
            times.known |= bits((least == most) & (least >= kLeast) & (most <= kMost));
            times.behind |= bits(most < 0);
            times.back |= bits(sign > 0);
        }
    }

#ifdef __x86_64__
    [[gnu::target("avx2")]] static void testBlocksOnAvx2(const RayPacket& packet,
                                                         std::span<const BlockPart> blocks,
                                                         std::vector<PacketCandidate>& found) {
        testBlocks(packet, blocks, found);
    }
    [[gnu::target("avx2")]] static void findTimesOnAvx2(const RayPacket& packet,
                                                        const CellCorners& corners,
                                                        PacketCandidate& candidate, Times& times) {
        findTimes(packet, corners, candidate, times);
    }
#endif
};

void RayPacket::candidates(std::span<const BlockPart> blocks,
                           std::vector<PacketCandidate>& found) const {
    found.clear();
#ifdef __x86_64__
    if (hasAvx2()) return PacketTests::testBlocksOnAvx2(*this, blocks, found);
#endif
    PacketTests::testBlocks(*this, blocks, found);
}

void RayPacket::findHits(const CellCorners& corners, PacketCandidate candidate,
                         std::vector<Hit>& hits) const {
    hits.clear();
    PacketTests::Times times;
#ifdef __x86_64__
    if (hasAvx2())
        PacketTests::findTimesOnAvx2(*this, corners, candidate, times);
    else
#endif
        PacketTests::findTimes(*this, corners, candidate, times);
    for (std::uint64_t may = candidate.may & ~times.behind; may != 0; may &= may - 1) {
        const auto i = static_cast<std::size_t>(std::countr_zero(may));
        const bool inside = (candidate.inside >> i & 1) != 0;
        if (inside && (times.known >> i & 1) != 0)
            hits.push_back({static_cast<std::uint32_t>(i), times.t[i], (times.back >> i & 1) != 0});
        else if (const auto hit = exactHit(*rays_[i], corners, inside))
            hits.push_back({static_cast<std::uint32_t>(i), hit->t, hit->back});
    }
}

}  // namespace peeler
