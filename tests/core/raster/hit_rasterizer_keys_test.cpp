// SPDX-License-Identifier: Apache-2.0
// Tests the keys of CPU hits: the hit element, and the draw order of coincident elements.
#include <gtest/gtest.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>

#include "core/raster/hit_rasterizer.h"
#include "core/scene/elements.h"
#include "support/closed_meshes.h"
#include "support/one_mesh.h"
#include "support/test_support.h"
#include "support/traced_hits.h"

namespace peeler::test {
namespace {

/// Two coincident meshes have two hits at exactly the same Z, in draw order, for any first corner
/// and winding of their triangles.
TEST(HitRasterizer, WhatCoincidesIsHitTwiceInDrawOrder) {
    const Primitive first = icosphere(3);
    Primitive second = first;
    for (std::size_t i = 0; i < second.indices.size(); i += 3) {
        std::rotate(second.indices.begin() + static_cast<std::ptrdiff_t>(i),
                    second.indices.begin() + static_cast<std::ptrdiff_t>(i + 1 + i % 2),
                    second.indices.begin() + static_cast<std::ptrdiff_t>(i + 3));
        if (i % 4 == 0) std::swap(second.indices[i], second.indices[i + 1]);
    }
    const Scene once = sceneOf({{"", {first}}}), twice = sceneOf({{"", {first}}, {"", {second}}});
    const PosedScene posed(once), both(twice);
    HitRasterizer one(posed), two(both);
    const auto keys = static_cast<std::uint32_t>(first.indices.size() / 3);
    for (const View& view : {bundleOf(posed, {1, 2, 3}, 100).view, pinhole({1, 2, 3}, 100)}) {
        const TracedHits expected = trace(one, view), found = trace(two, view);
        ASSERT_EQ(found.image.fragments(), 2 * expected.image.fragments());
        for (std::size_t p = 0; p + 1 < expected.image.offsets.size(); ++p) {
            ASSERT_EQ(found.image.count(p), 2 * expected.image.count(p));
            const auto was = expected.keys(p), now = found.keys(p);
            for (std::size_t i = 0; i < was.size(); ++i) {
                const std::size_t at = found.image.offsets[p] + 2 * i;
                ASSERT_EQ(found.image.z[at], found.image.z[at + 1]);
                ASSERT_EQ(now[2 * i], was[i]);
                ASSERT_EQ(now[2 * i + 1], was[i] + keys);
            }
        }
    }
}

TEST(HitRasterizer, InstancesThatAreDrawnAtOnceHaveKeysOfTheirOwn) {
    Scene scene = oneMesh({square(0, 0, 4, 4, -1)});
    scene.nodes[0].instances.emplace();
    for (int i = 0; i < 3; ++i)
        scene.nodes[0].instances->push_back(glm::translate(glm::dmat4(1), glm::dvec3(0, 0, -i)));
    const PosedScene posed(scene);
    HitRasterizer source(posed);
    const TracedHits traced = trace(source, parallelView(4, 4));
    for (std::size_t p = 0; p < 16; ++p) {
        const auto keys = traced.keys(p);
        ASSERT_EQ(keys.size(), 3U);
        for (std::size_t i = 0; i < 3; ++i)
            EXPECT_EQ(posed.drawList().originOf(keys[i]).instance, i);
    }
}

/// Keys are those of the draw list for every topology, instance and primitive. Lines and points
/// have no hits.
TEST(HitRasterizer, KeysSayWhatWasHit) {
    Primitive list = square(0, 0, 2, 8, -1), strip, fan, lines = list;
    strip.topology = Topology::kTriangleStrip;
    strip.positions = {{2, -8, -1}, {2, 0, -1}, {4, -8, -1}, {4, 0, -1}};
    fan.topology = Topology::kTriangleFan;
    fan.positions = {{4, 0, -1}, {4, -8, -1}, {6, -8, -1}, {6, 0, -1}};
    lines.topology = Topology::kLines;
    Scene scene = oneMesh({list, lines, strip, fan});
    scene.nodes[0].instances = {glm::dmat4(1), glm::translate(glm::dmat4(1), glm::dvec3(0, 0, -1))};
    const PosedScene posed(scene);
    HitRasterizer source(posed);
    const TracedHits traced = trace(source, parallelView(8, 8));
    const View view = parallelView(8, 8);
    std::size_t hits = 0;
    for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 8; ++x) {
            const auto keys = traced.keys(traced.image.pixelIndex(x, y));
            ASSERT_EQ(keys.size(), x < 6 ? 2U : 0U) << x << ", " << y;
            for (std::size_t i = 0; i < keys.size(); ++i, ++hits) {
                WorldElement element = elementOf(posed, keys[i]);
                placeCorners(posed, element);
                EXPECT_EQ(element.origin.instance, i);
                EXPECT_EQ(element.origin.primitive, x < 2 ? 0U : x < 4 ? 2U : 3U);
                const glm::dvec3 from = worldPosition(view, x + 0.5, y + 0.5, 0);
                const auto weight = element.weightsAt(from, {0, 0, -1});
                const glm::dvec3 at = element.weighted(weight);
                EXPECT_NEAR(at.x, from.x, 1e-6);
                EXPECT_NEAR(at.y, from.y, 1e-6);
            }
        }
    }
    EXPECT_EQ(hits, 96U);
}

}  // namespace
}  // namespace peeler::test
