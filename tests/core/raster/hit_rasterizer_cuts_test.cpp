// SPDX-License-Identifier: Apache-2.0
// Tests the parts of surfaces that have no CPU hits: beyond clip planes, culled faces and alpha
// cutouts.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "core/raster/hit_rasterizer.h"
#include "support/one_mesh.h"
#include "support/traced_hits.h"

namespace peeler::test {
namespace {

/// A floor of strips extends behind the eye and far beyond the picture. Every downward ray must hit
/// the floor exactly once, even at the edges of strips and at the near plane.
TEST(HitRasterizer, WhatReachesBehindAPinholeIsCutWithoutCracks) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> jitter(-0.2F, 0.2F);
    for (const float reach : {50.0F, 1e6F, 1e30F}) {
        Primitive floor;
        constexpr std::uint32_t kStrips = 40;
        for (std::uint32_t i = 0; i <= kStrips; ++i) {
            const float x = i == 0         ? -reach
                            : i == kStrips ? reach
                                           : static_cast<float>(i) - 20 + jitter(random);
            floor.positions.emplace_back(x, -1, -reach);
            floor.positions.emplace_back(x + jitter(random), -1, 3 + jitter(random));
        }
        for (std::uint32_t i = 0; i < 2 * kStrips; i += 2) {
            const auto quad =
                i % 4 == 0 ? std::array<std::uint32_t, 6>{i, i + 1, i + 2, i + 2, i + 1, i + 3}
                           : std::array<std::uint32_t, 6>{i, i + 1, i + 3, i, i + 3, i + 2};
            floor.indices.insert(floor.indices.end(), quad.begin(), quad.end());
        }
        const Scene scene = oneMesh({floor});
        HitRasterizer source{PosedScene(scene)};
        View view = pinhole({0, 0, 1}, 200, 1.2, 0.1);
        view.camera_to_world = glm::dmat4(1);
        for (const bool clamp : {false, true}) {
            CaptureSettings settings = hitSettings();
            settings.depth_clamp = clamp;
            const TracedHits traced = trace(source, view, settings);
            for (int y = 0; y < 200; ++y) {
                // The smallest floor ends at a distance of 50. Skip the rays that would hit near or
                // beyond its end.
                const double down = view.projection.half_height * (2 * (y + 0.5) / 200 - 1);
                const std::uint32_t expected = down > 0 && 1 / down < 49 ? 1 : 0;
                if (down > 0 && !expected) continue;
                for (int x = 0; x < 200; ++x)
                    ASSERT_EQ(traced.image.count(traced.image.pixelIndex(x, y)), expected)
                        << x << ", " << y << " reach " << reach;
            }
        }
    }
}

TEST(HitRasterizer, HitsEndAtTheNearAndFarPlane) {
    // The square becomes a ramp with Z from 2 to 10 over the width of 80 rays.
    Primitive ramp = square(0, 0, 80, 4, 0);
    for (glm::vec3& p : ramp.positions)
        p.z = -(2 + p.x / 10);
    const Scene scene = oneMesh({ramp});
    HitRasterizer source{PosedScene(scene)};
    View view = parallelView(80, 4);
    view.projection.near = 4;
    view.projection.far = 7;
    CaptureSettings settings = hitSettings();
    settings.depth_clamp = false;
    const TracedHits traced = trace(source, view, settings);
    for (int x = 0; x < 80; ++x) {
        const double z = 2 + (x + 0.5) / 10;
        EXPECT_EQ(traced.image.count(static_cast<std::size_t>(x)), z >= 4 && z < 7 ? 1U : 0U) << x;
    }
    // A surface exactly on the near plane is hit; a surface exactly on the far plane is not.
    const Scene planes = oneMesh({square(0, 0, 80, 4, -4), square(0, 0, 80, 4, -7)});
    HitRasterizer both{PosedScene(planes)};
    const TracedHits at = trace(both, view, settings);
    EXPECT_EQ(at.image.fragments(), 320U);
    EXPECT_EQ(at.image.z.front(), 4.0F);
    settings.depth_clamp = true;
    EXPECT_EQ(trace(both, view, settings).image.fragments(), 640U);
    EXPECT_EQ(trace(source, view, settings).image.fragments(), 320U);
}

TEST(HitRasterizer, FacesAreCulledAsAsked) {
    Primitive front = square(0, 0, 4, 4, -1), back = square(0, 0, 4, 4, -2), both = back;
    std::reverse(back.indices.begin(), back.indices.end());
    std::reverse(both.indices.begin(), both.indices.end());
    for (glm::vec3& p : both.positions)
        p.z = -3;
    both.material = 1;
    const glm::dmat4 mirror = glm::translate(glm::dmat4(1), glm::dvec3(4, 0, 0)) *
                              glm::scale(glm::dmat4(1), glm::dvec3(-1, 1, 1));
    for (const glm::dmat4& local : {glm::dmat4(1), mirror}) {
        Scene scene = oneMesh({front, back, both}, local);
        scene.materials[1].double_sided = true;
        HitRasterizer source{PosedScene(scene)};
        CaptureSettings settings = hitSettings();
        const std::pair<Faces, std::vector<float>> rows[] = {{Faces::kGltf, {1, 3}},
                                                             {Faces::kFront, {1}},
                                                             {Faces::kBack, {2, 3}},
                                                             {Faces::kBoth, {1, 2, 3}}};
        for (const auto& [faces, z] : rows) {
            settings.faces = faces;
            const LayeredImage image = trace(source, parallelView(4, 4), settings).image;
            ASSERT_EQ(image.fragments(), 16 * z.size());
            EXPECT_EQ(std::vector<float>(image.z.begin(), image.z.begin() + image.count(0)), z);
        }
    }
}

Image checkered() {
    Image image;
    image.width = image.height = 2;
    image.rgba.assign(16, 255);
    // The upper right and lower left texels are transparent.
    image.rgba[4 + 3] = image.rgba[8 + 3] = 0;
    return image;
}

TEST(HitRasterizer, AlphaDecidesWhatIsThere) {
    Scene scene = oneMesh({square(0, 0, 8, 8, -1)});
    scene.images = {checkered()};
    Material& material = scene.materials[0];
    material.double_sided = true;
    material.base_color_texture.image = 0;
    Sampler& sampler = material.base_color_texture.sampler;
    sampler.mag_filter = 9728;
    const auto pattern = [&] {
        HitRasterizer source{PosedScene(scene)};
        return countsOf(trace(source, parallelView(8, 8)).image);
    };
    const auto expected = [](auto&& there) {
        std::vector<std::uint32_t> counts;
        for (int y = 0; y < 8; ++y)
            for (int x = 0; x < 8; ++x)
                counts.push_back(there(x, y) ? 1 : 0);
        return counts;
    };
    const auto squares = expected([](int x, int y) { return (x < 4) == (y < 4); });
    EXPECT_EQ(pattern(), std::vector<std::uint32_t>(64, 1));  // OPAQUE ignores alpha
    material.alpha_mode = AlphaMode::kMask;
    EXPECT_EQ(pattern(), squares);
    material.alpha_mode = AlphaMode::kBlend;
    EXPECT_EQ(pattern(), squares);
    // Shifts the texture by half a period, then halves its width and height under each wrap mode.
    material.base_color_texture.transform[2] = {0.5F, 0, 1};
    EXPECT_EQ(pattern(), expected([](int x, int y) { return (x < 4) != (y < 4); }));
    material.base_color_texture.transform = glm::mat3(1);
    material.base_color_texture.transform[0][0] = 2;
    material.base_color_texture.transform[1][1] = 2;
    EXPECT_EQ(pattern(), expected([](int x, int y) { return (x % 4 < 2) == (y % 4 < 2); }));
    sampler.wrap_s = sampler.wrap_t = 33648;  // GL_MIRRORED_REPEAT
    EXPECT_EQ(pattern(),
              expected([](int x, int y) { return (x < 2 || x >= 6) == (y < 2 || y >= 6); }));
    sampler.wrap_s = sampler.wrap_t = 33071;  // GL_CLAMP_TO_EDGE
    EXPECT_EQ(pattern(), expected([](int x, int y) { return (x < 2) == (y < 2); }));
    // With linear filtering, alpha is interpolated between texels, and is 1/2 in the middle of the
    // picture.
    material.base_color_texture.transform = glm::mat3(1);
    material.alpha_mode = AlphaMode::kMask;
    sampler.mag_filter = 9729;
    material.alpha_cutoff = 0.5F;
    // The condition (1 − u)(1 − v) + uv >= 1/2 is equivalent to (u − 1/2)(v − 1/2) >= 0.
    EXPECT_EQ(pattern(), squares);
    material.alpha_cutoff = 0.75F;
    EXPECT_EQ(pattern(), expected([](int x, int y) {
                  const auto share = [](int i) {
                      return std::clamp((i + 0.5) / 4 - 0.5, 0.0, 1.0);
                  };
                  const double u = share(x), v = share(y);
                  return (1 - u) * (1 - v) + u * v >= 0.75;
              }));
    // Alpha is the product of texture, factor and vertex colour. The texture may use the second set
    // of coordinates.
    material.alpha_cutoff = 0.5F;
    material.base_color.a = 0.4F;
    EXPECT_EQ(pattern(), std::vector<std::uint32_t>(64, 0));
    material.base_color.a = 1;
    Primitive& primitive = scene.meshes[0].primitives[0];
    primitive.colors = {{1, 1, 1, 0}, {1, 1, 1, 1}, {1, 1, 1, 1}, {1, 1, 1, 0}};
    sampler.mag_filter = 9728;
    EXPECT_EQ(pattern(), expected([](int x, int y) { return x >= 4 && y >= 4; }));
    primitive.colors.clear();
    primitive.texcoords[1] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    material.base_color_texture.texcoord = 1;
    EXPECT_EQ(pattern(), expected([](int x, int y) { return (x < 4) != (y < 4); }));
}

/// In perspective, interpolation weights are not linear in the picture: the texture's middle must
/// appear at the middle of the square.
TEST(HitRasterizer, TexturesLieOnTheSurfaceNotOnThePicture) {
    Primitive floor;
    floor.positions = {{-1.03F, -1, -1}, {1.03F, -1, -1}, {1.03F, -1, -9}, {-1.03F, -1, -9}};
    floor.texcoords[0] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    floor.indices = {0, 1, 2, 0, 2, 3};
    Scene scene = oneMesh({floor});
    scene.images = {checkered()};
    Material& material = scene.materials[0];
    material.base_color_texture.image = 0;
    material.base_color_texture.sampler.mag_filter = 9728;
    material.alpha_mode = AlphaMode::kMask;
    HitRasterizer source{PosedScene(scene)};
    View view = pinhole({0, 0, 1}, 100, 1.1);
    view.camera_to_world = glm::dmat4(1);
    const LayeredImage image = trace(source, view).image;
    std::size_t seen = 0;
    for (int y = 51; y < 100; ++y) {
        const double z = 1 / (1.1 * (2 * (y + 0.5) / 100 - 1));  // Z where the ray meets the floor
        for (int x = 0; x < 100; ++x) {
            const double across = 1.1 * (2 * (x + 0.5) / 100 - 1) * z;
            const bool there = z > 1 && z < 9 && std::abs(across) < 1.03 && (across < 0) == (z > 5);
            EXPECT_EQ(image.count(image.pixelIndex(x, y)), there ? 1U : 0U) << x << ", " << y;
            seen += there ? 1 : 0;
        }
    }
    EXPECT_GT(seen, 400U);
}

}  // namespace
}  // namespace peeler::test
