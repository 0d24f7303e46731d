// SPDX-License-Identifier: Apache-2.0
// Tests that the hierarchy finds every triangle that a ray hits, alone and in a cone.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/trace/triangle_tree.h"

namespace peeler::test {
namespace {

/// Returns triangles of many sizes, crowded around the origin and along its axes.
std::vector<CellCorners> crowd(std::mt19937_64& random, std::size_t count) {
    std::uniform_real_distribution<double> unit(-1, 1);
    std::vector<CellCorners> triangles(count);
    for (CellCorners& triangle : triangles) {
        const double size = std::ldexp(1.0, static_cast<int>(random() % 46) + 2);
        Cells at{};
        for (std::int64_t& coordinate : at) {
            const double place = unit(random);
            coordinate = static_cast<std::int64_t>(place * place * place * place * place * 0x1p49);
        }
        for (Cells& corner : triangle)
            for (std::size_t i = 0; i < 3; ++i)
                corner[i] = at[i] + static_cast<std::int64_t>(unit(random) * size);
    }
    return triangles;
}

/// Returns a ray through a corner of a triangle, or near it. The origin may be far away.
ExactRay rayAt(std::mt19937_64& random, const Cells& target, const Cells& origin) {
    ExactRay ray;
    ray.origin = origin;
    const Cells way = target - origin;
    std::int64_t most = 1;
    for (const std::int64_t part : way)
        most = std::max(most, std::abs(part));
    for (std::size_t i = 0; i < 3; ++i)
        ray.direction[i] = static_cast<std::int64_t>(static_cast<double>(way[i]) /
                                                     static_cast<double>(most) * 0x1.8p51);
    if (random() % 8 == 0) ray.direction[random() % 3] = 0;
    return ray;
}

TEST(TriangleTree, MissesNoTriangle) {
    std::mt19937_64 random(1);
    const std::vector<CellCorners> triangles = crowd(random, 40'000);
    const TriangleTree tree(triangles.size(), [&](std::uint32_t i) { return triangles[i]; });
    std::vector<Candidate> found;
    std::size_t hits = 0;
    for (int i = 0; i < 150; ++i) {
        const int far = static_cast<int>(random() % 12);
        Cells origin = triangles[random() % triangles.size()][0];
        if (far > 1) origin[random() % 3] = (std::int64_t{1} << (48 + far)) * (i % 2 == 0 ? 1 : -1);
        const ExactRay ray = rayAt(random, triangles[random() % triangles.size()][1], origin);
        if (ray.direction == Cells{}) continue;
        tree.candidates(ray, found);
        std::vector<int> seen(triangles.size());  // 1: a candidate, 2: certainly inside
        for (const Candidate& candidate : found) {
            EXPECT_EQ(seen[candidate.triangle], 0);
            seen[candidate.triangle] = candidate.inside ? 2 : 1;
        }
        for (std::size_t k = 0; k < triangles.size(); ++k) {
            const bool hit = exactHit(ray, triangles[k], false).has_value();
            ASSERT_TRUE(!hit || seen[k] != 0) << "triangle " << k << " of ray " << i;
            // A certain one is hit unless it lies behind the origin.
            if (seen[k] == 2) {
                ASSERT_EQ(hit, exactHit(ray, triangles[k], true).has_value());
            }
            hits += hit ? 1 : 0;
        }
    }
    EXPECT_GT(hits, 150U);
}

TEST(TriangleTree, ConesMissNoTriangle) {
    std::mt19937_64 random(2);
    const std::vector<CellCorners> triangles = crowd(random, 40'000);
    const TriangleTree tree(triangles.size(), [&](std::uint32_t i) { return triangles[i]; });
    std::vector<BlockPart> found;
    std::vector<PacketCandidate> candidates;
    std::vector<RayPacket::Hit> packet_hits;
    std::size_t hits = 0, packets = 0, spread = 0;
    for (int i = 0; i < 120; ++i) {
        const int far = static_cast<int>(random() % 12);
        Cells origin = triangles[random() % triangles.size()][0];
        if (far > 1) origin[random() % 3] = (std::int64_t{1} << (48 + far)) * (i % 2 == 0 ? 1 : -1);
        const CellCorners& aim = triangles[random() % triangles.size()];
        std::vector<std::optional<ExactRay>> rays;
        for (int k = 0; k < 8; ++k) {
            Cells from = origin;
            for (std::int64_t& part : from)  // in half of the packets, origins differ
                part += i % 4 < 2 ? 0 : static_cast<std::int64_t>(random() >> (19 + i % 9));
            rays.emplace_back(rayAt(random, aim[0], from));
            for (std::int64_t& part : rays.back()->direction)
                part += static_cast<std::int64_t>(random() >> 15) * (k % 2 == 0 ? 1 : 0);
        }
        RayPacket packet;
        if (packet.take(rays) < rays.size()) continue;
        ++packets;
        spread += packet.cone().spread > 0 ? 1 : 0;
        ASSERT_TRUE(tree.candidates(packet.cone(), triangles.size(), found));
        packet.candidates(found, candidates);
        std::vector<const PacketCandidate*> seen(triangles.size());
        for (const PacketCandidate& candidate : candidates)
            seen[candidate.triangle] = &candidate;
        for (std::uint32_t k = 0; k < triangles.size(); ++k) {
            packet_hits.clear();
            if (seen[k]) packet.findHits(triangles[k], *seen[k], packet_hits);
            auto next = packet_hits.begin();
            for (std::uint32_t r = 0; r < rays.size(); ++r) {
                const auto hit = exactHit(*rays[r], triangles[k], false);
                const bool in_packet = next != packet_hits.end() && next->ray == r;
                ASSERT_EQ(hit.has_value(), in_packet) << "triangle " << k << " of packet " << i;
                if (!hit) continue;
                ASSERT_EQ(hit->t, next->t);
                ASSERT_EQ(hit->back, next->back);
                ++next;
                ++hits;
            }
        }
        EXPECT_FALSE(!found.empty() && tree.candidates(packet.cone(), 0, found));
    }
    EXPECT_GT(packets, 30U);
    EXPECT_GT(spread, 15U);
    EXPECT_GT(hits, 100U);
}

TEST(TriangleTree, MayBeEmptyOrSmall) {
    std::vector<Candidate> found{{}};
    const ExactRay ray{{0, 0, -100}, {0, 0, std::int64_t{1} << 51}};
    const TriangleTree empty;
    empty.candidates(ray, found);
    EXPECT_TRUE(found.empty());
    const TriangleTree one(1, [](std::uint32_t) {
        return CellCorners{Cells{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}};
    });
    one.candidates(ray, found);
    ASSERT_EQ(found.size(), 1U);
    const auto hit = exactHit(ray, {Cells{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}}, false);
    ASSERT_TRUE(hit);
    EXPECT_TRUE(hit->back);
    EXPECT_EQ(hit->t, 100 * 0x1p-51F);
}

}  // namespace
}  // namespace peeler::test
