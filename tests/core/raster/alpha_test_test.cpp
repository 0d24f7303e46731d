// SPDX-License-Identifier: Apache-2.0
// Tests that the verdict on a whole triangle's alpha agrees with tests of its points.
#include "core/raster/alpha_test.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>

#include "support/one_mesh.h"

namespace peeler::test {
namespace {

using Random = std::mt19937;

float between(float least, float most, Random& random) {
    return std::uniform_real_distribution<float>(least, most)(random);
}

/// Returns an image with rectangles of random alpha. Its sides are no multiples of a tile.
Image rectangles(Random& random) {
    Image image;
    image.width = 150;
    image.height = 83;
    image.rgba.assign(4 * 150 * 83, 255);
    for (int i = 0; i < 12; ++i) {
        const int x0 = static_cast<int>(random() % 150), y0 = static_cast<int>(random() % 83);
        const auto alpha = static_cast<std::uint8_t>(random() % 3 * 100);
        for (int y = y0; y < std::min(y0 + 30, 83); ++y)
            for (int x = x0; x < std::min(x0 + 40, 150); ++x)
                image.rgba[static_cast<std::size_t>(4 * (y * 150 + x) + 3)] = alpha;
    }
    return image;
}

/// Returns 100 triangles that have only texture coordinates and, if asked for, vertex colours.
Primitive triangles(bool colors, Random& random) {
    Primitive primitive;
    primitive.positions.resize(300);
    for (int i = 0; i < 100; ++i) {
        const glm::vec2 middle(between(-2, 2, random), between(-2, 2, random));
        const float size = between(0, 0.3F, random);
        for (int k = 0; k < 3; ++k) {
            primitive.texcoords[0].push_back(
                middle + size * glm::vec2(between(-1, 1, random), between(-1, 1, random)));
            if (colors) primitive.colors.emplace_back(glm::vec3(1), between(0.9F, 1, random));
        }
    }
    return primitive;
}

TEST(AlphaTest, TheVerdictOnATriangleIsThatOnItsPoints) {
    constexpr int kNearest = 9728, kLinear = 9729;
    constexpr std::array kWraps{10497, 33648, 33071};  // GL_REPEAT, mirrored, clamped
    Random random(7);
    std::array<int, 3> found{};  // verdicts: none passes, all pass, not known
    for (int round = 0; round < 120; ++round) {
        Scene scene = oneMesh({triangles(round % 5 == 0, random)});
        scene.images = {rectangles(random)};
        Material& material = scene.materials[0];
        material.alpha_mode = round % 2 == 0 ? AlphaMode::kMask : AlphaMode::kBlend;
        material.alpha_cutoff = 100.0F / 255;
        material.base_color.a = round % 7 == 0 ? 0.9F : 1;
        TextureRef& texture = material.base_color_texture;
        texture.image = 0;
        texture.sampler.mag_filter = round % 4 < 2 ? kNearest : kLinear;
        texture.sampler.wrap_s = kWraps[random() % 3];
        texture.sampler.wrap_t = kWraps[random() % 3];
        texture.transform[0] = {between(-1, 1, random), between(-1, 1, random), 0};
        texture.transform[2] = {between(-1, 1, random), between(-1, 1, random), 1};
        const PosedScene posed(scene);
        const AlphaTest test(posed, posed.drawList().geometries()[0]);
        const AlphaRanges ranges(scene.images[0]);
        for (std::uint32_t i = 0; i < 300; i += 3) {
            const std::array<std::uint32_t, 3> vertex{i, i + 1, i + 2};
            const std::optional<bool> known = test.passesEverywhere(vertex, &ranges);
            ++found[known ? (*known ? 1 : 0) : 2];
            if (!known) continue;
            for (int k = 0; k < 200; ++k) {
                const double a = k == 0 ? 0 : between(0, 1, random);
                const double b = k == 1 ? 0 : between(0, 1, random) * (1 - a);
                ASSERT_EQ(test.passes(vertex, {a, b, 1 - a - b}), *known)
                    << "round " << round << ", triangle " << i / 3;
            }
        }
    }
    for (const int number : found)
        EXPECT_GT(number, 100);
}

// Points far outside the image, or nowhere, have no verdict unless the whole image has one.
TEST(AlphaTest, FarTexturesAreTestedPointByPoint) {
    Random random(7);
    Scene scene = oneMesh({triangles(false, random)});
    Image image;
    image.width = image.height = 2;
    image.rgba.assign(16, 255);
    scene.images = {image};
    scene.materials[0].alpha_mode = AlphaMode::kMask;
    scene.materials[0].base_color_texture.image = 0;
    for (const float far : {1e30F, -1e30F, NAN}) {
        scene.meshes[0].primitives[0].texcoords[0][1].x = far;
        for (const int alpha : {255, 0}) {
            scene.images[0].rgba[3] = static_cast<std::uint8_t>(alpha);
            const PosedScene posed(scene);
            const AlphaTest test(posed, posed.drawList().geometries()[0]);
            const AlphaRanges ranges(scene.images[0]);
            EXPECT_EQ(test.passesEverywhere({0, 1, 2}, &ranges),
                      alpha == 255 ? std::optional(true) : std::nullopt)
                << far;
        }
    }
}

}  // namespace
}  // namespace peeler::test
