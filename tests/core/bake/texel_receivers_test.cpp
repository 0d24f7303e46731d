// SPDX-License-Identifier: Apache-2.0
// Tests texel receivers: which texels have receivers, their positions, shared texels, chart
// borders, and values between texels and beyond charts.
#include "core/bake/receivers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <peeler/error.h>
#include "core/bake/texel_coverage.h"
#include "support/one_mesh.h"

namespace peeler {
namespace {

using test::oneMesh;

/// Returns the unit square in the plane z = 0 in two triangles, u along x, v along y.
Primitive quad(float u0 = 0, float v0 = 0, float u1 = 1, float v1 = 1) {
    Primitive primitive;
    primitive.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    primitive.texcoords[0] = {{u0, v0}, {u1, v0}, {u1, v1}, {u0, v1}};
    primitive.indices = {0, 1, 2, 0, 2, 3};
    return primitive;
}

struct PlacedTexels {
    PlacedTexels(Scene from, const TexelSettings& settings)
        : scene(std::move(from)),
          shown(scene, 0),
          vertices(shown),
          texels(shown, vertices, settings) {}

    Scene scene;
    PosedScene shown;
    VertexReceivers vertices;
    TexelReceivers texels;
    const Receivers& receivers = texels.receivers();
};

TEST(TexelReceivers, OfAQuadThatFillsTheTextureAreTheCentres) {
    constexpr int kSize = 16;
    const PlacedTexels placed(oneMesh({quad()}), {kSize, 0});
    ASSERT_EQ(placed.receivers.size(), std::size_t{kSize} * kSize);
    ASSERT_EQ(placed.texels.atlases().size(), 1U);
    const TexelAtlas& atlas = placed.texels.atlases()[0];
    EXPECT_EQ(atlas.covered, std::uint64_t{kSize} * kSize);
    EXPECT_EQ(atlas.shared, 0U);
    for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) {
            const std::size_t i = atlas.first[static_cast<std::size_t>(y * kSize + x)];
            const glm::dvec3 centre((static_cast<float>(x) + 0.5F) / kSize,
                                    (static_cast<float>(y) + 0.5F) / kSize, 0);
            EXPECT_LT(glm::length(placed.receivers.positions[i] - centre), 1e-6);
            EXPECT_EQ(placed.receivers.normals[i], glm::vec3(0, 0, 1));
        }
}

TEST(TexelReceivers, WrapAroundAsTexturesRepeat) {
    constexpr int kSize = 8;
    const PlacedTexels placed(oneMesh({quad(-2.5F, 1, -1.5F, 2)}), {kSize, 0});
    const TexelAtlas& atlas = placed.texels.atlases()[0];
    EXPECT_EQ(atlas.covered, std::uint64_t{kSize} * kSize);
    EXPECT_EQ(atlas.shared, 0U);
    // Texel 0 is at u = −2 + 1/16, which is 9/16 of the way across the quad.
    EXPECT_NEAR(placed.receivers.positions[atlas.first[0]].x, 0.5F + 0.0625F, 1e-6);
}

TEST(TexelReceivers, OfTiledOrMirroredUvsShareTexels) {
    const PlacedTexels tiled(oneMesh({quad(0, 0, 2, 1)}), {8, 0});
    EXPECT_EQ(tiled.texels.atlases()[0].shared, 64U);
    EXPECT_EQ(tiled.receivers.size(), 128U);
    const PlacedTexels mirrored(oneMesh({quad(), quad(1, 0, 0, 1)}), {8, 0});
    EXPECT_EQ(mirrored.texels.atlases()[0].shared, 64U);
    // Each texel is shared by both sides of the mirror and gets the mean of both, 0.5.
    std::vector<float> values;
    for (const glm::dvec3& position : mirrored.receivers.positions)
        values.push_back(static_cast<float>(position.x));
    for (const float value : mirrored.texels.pixels(mirrored.texels.atlases()[0], values, 1, 0))
        EXPECT_NEAR(value, 0.5F, 1e-6);
    const PlacedTexels many(oneMesh({quad(0, 0, 20, 1)}), {8, 0});
    EXPECT_EQ(many.receivers.size(), 64U * TexelCoverage::kMostSamples);
}

TEST(TexelReceivers, OfNarrowChartsAreTheNearestPoints) {
    // A ribbon along V spans U from 2.4 to 2.492 texels. No texel centre is inside; the centre at
    // 2.5 is just outside.
    const PlacedTexels placed(oneMesh({quad(0.30F, 0, 0.3115F, 1)}), {8, 0});
    const TexelAtlas& atlas = placed.texels.atlases()[0];
    EXPECT_EQ(atlas.covered, 0U);
    for (std::size_t y = 0; y < 8; ++y) {
        const std::size_t texel = y * 8 + 2;
        ASSERT_EQ(atlas.first[texel + 1] - atlas.first[texel], 1U) << y;
        const glm::dvec3 position = placed.receivers.positions[atlas.first[texel]];
        EXPECT_NEAR(position.x, 1, 1e-4);  // the nearest point is on the ribbon's right border
        EXPECT_NEAR(position.y, (static_cast<float>(y) + 0.5F) / 8, 1e-4);
    }
}

TEST(TexelReceivers, HaveATextureAMaterialAndTheAskedUvSet) {
    Primitive second = quad();
    second.material = 1;
    second.texcoords[1] = quad(0, 0, 0.5F, 0.5F).texcoords[0];
    Primitive without = quad();
    without.texcoords[0].clear();
    const Scene scene = oneMesh({quad(), second, without});
    const PlacedTexels first_set(scene, {8, 0});
    ASSERT_EQ(first_set.texels.atlases().size(), 2U);
    EXPECT_EQ(first_set.texels.atlases()[1].material, 1);
    EXPECT_EQ(first_set.texels.withoutUvs(), 1U);
    const PlacedTexels second_set(scene, {8, 1});
    ASSERT_EQ(second_set.texels.atlases().size(), 1U);
    EXPECT_EQ(second_set.texels.atlases()[0].material, 1);
    EXPECT_EQ(second_set.texels.atlases()[0].covered, 16U);
    try {
        const PlacedTexels none(oneMesh({quad()}), {8, 1});
        FAIL() << "there is no such UV set";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_NE(error.hint().find("`uv_set`"), std::string::npos);
    }
}

TEST(TexelReceivers, RefuseUvsThatRepeatWithoutEnd) {
    for (const float end : {1e4F, 1e30F}) {
        try {
            const PlacedTexels placed(oneMesh({quad(0, 0, end, end)}), {1024, 0});
            FAIL() << end;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kInput);
        }
    }
}

TEST(TexelReceivers, RefuseMoreTexturesThanFit) {
    std::vector<Primitive> primitives;
    for (int i = 0; i < 3; ++i) {
        primitives.push_back(quad());
        primitives.back().material = i;
    }
    try {
        const PlacedTexels placed(oneMesh(primitives), {20000, 0});
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_NE(error.hint().find("`size`"), std::string::npos);
    }
}

TEST(TexelReceivers, GiveTheTexelUnderAHit) {
    const PlacedTexels placed(oneMesh({quad(0, 0, 1, 1)}), {4, 0});
    const SurfaceLookup lookup = placed.texels.lookup();
    std::vector<float> values;
    for (std::size_t i = 0; i < placed.receivers.size(); ++i) {
        const glm::vec3 p(placed.receivers.positions[i]);
        values.insert(values.end(), {p.x, p.y, 1});
    }
    // Barycentric (0.3, 0.5) in triangle 2, which is (0,0) (1,1) (0,1), is the point (0.3, 0.8), in
    // texel (1, 3).
    const glm::vec3 found = lookup(values, 2, {0.3F, 0.5F});
    EXPECT_NEAR(found.x, 0.375F, 1e-6);
    EXPECT_NEAR(found.y, 0.875F, 1e-6);
}

TEST(TexelCoverage, GivesEveryCentreOnAnEdgeToOneTriangle) {
    // Triangle fans with corners on texel centres and between texel centres. Triangles share the
    // inner edges, so every centre inside a fan must be covered exactly once.
    const unsigned seed = 20261121;
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> half(4, 60);
    for (int round = 0; round < 50; ++round) {
        const glm::dvec2 middle(half(random) * 0.5, half(random) * 0.5);
        const glm::dvec2 corners[] = {{0, 0}, {32, 0}, {32, 32}, {0, 32}};
        std::vector<UvTriangle> triangles;
        for (std::size_t i = 0; i < 4; ++i) {
            UvTriangle triangle{corners[i], corners[(i + 1) % 4], middle};
            // Some triangles have the opposite winding, as in mirrored charts.
            if (random() % 2) std::swap(triangle[0], triangle[1]);
            triangles.push_back(triangle);
        }
        const TexelCoverage coverage(triangles, 32);
        std::uint64_t covered = 0, shared = 0;
        for (int y = 0; y < 32; ++y) {
            const TexelRow row = coverage.row(y);
            covered += row.covered;
            shared += row.shared;
        }
        EXPECT_EQ(covered, 1024U) << "seed " << seed << ", round " << round;
        EXPECT_EQ(shared, 0U) << "seed " << seed << ", round " << round;
    }
}

TEST(NearestFilled, IsTheNearestWithinReachAcrossBorders) {
    constexpr int kSize = 13;
    const unsigned seed = 7;
    std::mt19937 random(seed);
    for (const int reach : {0, 1, 3, 6, 20}) {
        std::vector<char> filled(kSize * kSize, 0);
        for (int i = 0; i < 5; ++i)
            filled[random() % filled.size()] = 1;
        const auto found = nearestFilled(filled, kSize, reach);
        for (int at = 0; at < kSize * kSize; ++at) {
            const auto away2 = [&](int to) {
                const auto along = [](int a, int b) {
                    const int d = std::abs(a - b);
                    return std::min(d, kSize - d);
                };
                const int dx = along(at % kSize, to % kSize), dy = along(at / kSize, to / kSize);
                return dx * dx + dy * dy;
            };
            int best = reach * reach + 1;
            for (int to = 0; to < kSize * kSize; ++to)
                if (filled[static_cast<std::size_t>(to)]) best = std::min(best, away2(to));
            const int nearest = found[static_cast<std::size_t>(at)];
            if (best > reach * reach) {
                EXPECT_EQ(nearest, -1) << at << " reach " << reach << " seed " << seed;
            } else {
                ASSERT_GE(nearest, 0) << at << " reach " << reach << " seed " << seed;
                EXPECT_TRUE(filled[static_cast<std::size_t>(nearest)]);
                EXPECT_EQ(away2(nearest), best) << at << " reach " << reach;
            }
        }
    }
}

TEST(TexelPixels, SpreadBeyondChartsAndFillTheRestWithTheMean) {
    // The chart fills the left quarter. Dilation repeats the border's value over 2 texels beyond
    // the border; all other texels get the mean.
    const PlacedTexels placed(oneMesh({quad(0, 0, 0.25F, 1)}), {16, 0});
    std::vector<float> values;
    for (const glm::dvec3& position : placed.receivers.positions)
        values.push_back(position.x < 0.999F && position.x > 0.001F ? 1.0F : 3.0F);
    const TexelAtlas& atlas = placed.texels.atlases()[0];
    const std::vector<float> pixels = placed.texels.pixels(atlas, values, 1, 2);
    // Texels 0 to 3 have their centres in the chart, texels 4 and 15 (= −1) touch the chart, and
    // texels 5, 6, 13 and 14 are dilated.
    const float mean = (4 * 1.0F + 2 * 3.0F) / 6;
    const float expected[] = {1, 1, 1, 1, 3, 3, 3, mean, mean, mean, mean, mean, mean, 3, 3, 3};
    for (std::size_t x = 0; x < 16; ++x)
        EXPECT_NEAR(pixels[5 * 16 + x], expected[x], 1e-6) << x;
}

}  // namespace
}  // namespace peeler
