// SPDX-License-Identifier: Apache-2.0
// Tests clip volumes: half-spaces against the positions of fragments, and meshes against analytic
// answers and Embree.
#include <peeler/clip.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "core/capture/method.h"
#include "support/capture.h"
#include "support/embree_oracle.h"
#include "support/hard_scenes.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

/// Returns the point at the centre of pixel (x, y) with this depth, in the space of testView().
glm::dvec3 pointAt(const View& view, int x, int y, double z) {
    const double u = (x + 0.5) / view.width * 2 - 1, v = 1 - (y + 0.5) / view.height * 2;
    return {u * view.projection.half_width * z, v * view.projection.half_height * z, -z};
}

/// Calls f(pixel, fragment, point) for every fragment.
template <class F>
void forEachPoint(const LayeredImage& image, const View& view, F&& f) {
    for (int y = image.window.y0; y < image.window.y1; ++y) {
        for (int x = image.window.x0; x < image.window.x1; ++x) {
            const std::size_t pixel = image.pixelIndex(x, y);
            for (std::uint32_t i = image.offsets[pixel]; i < image.offsets[pixel + 1]; ++i)
                f(pixel, i, pointAt(view, x, y, static_cast<double>(image.z[i])));
        }
    }
}

/// Adds a node with a closed ball of triangles, counter-clockwise as seen from outside.
int addBall(SceneBuilder& builder, const glm::dvec3& centre, double radius, int steps) {
    std::vector<glm::vec3> corners;
    const auto point = [&](int i, int j) {
        const double polar = std::numbers::pi * i / steps,
                     around = std::numbers::pi * (j % (2 * steps)) / steps;
        const double ring = i == 0 || i == steps ? 0 : std::sin(polar);
        return glm::vec3(centre + radius * glm::dvec3(ring * std::cos(around), std::cos(polar),
                                                      -ring * std::sin(around)));
    };
    for (int i = 0; i < steps; ++i) {
        for (int j = 0; j < 2 * steps; ++j) {
            const glm::vec3 a = point(i, j), b = point(i + 1, j), c = point(i + 1, j + 1),
                            d = point(i, j + 1);
            if (i + 1 < steps) corners.insert(corners.end(), {a, b, c});
            if (i > 0) corners.insert(corners.end(), {a, c, d});
        }
    }
    return builder.triangles(corners, builder.material({1, 1, 1, 1}, AlphaMode::kOpaque, false));
}

TEST(Clip, HalfSpacesKeepWhatLiesInThem) {
    const View view = testView(160, 120);
    for (const auto& [name, scene] : hardScenes()) {
        CaptureSettings settings;
        settings.clip.addBox({0.9, 0.7, -3.2}, {-0.5, -0.6, -1.0});
        settings.clip.half_spaces.push_back({glm::normalize(glm::dvec3(1, 2, 1)), -1.5});
        const auto inside_all = [&](const glm::dvec3& p, double slack) {
            return std::all_of(
                settings.clip.half_spaces.begin(), settings.clip.half_spaces.end(),
                [&](const auto& half) { return glm::dot(half.normal, p) >= half.offset - slack; });
        };
        constexpr double kRounding = 1e-5;
        const auto all = capture(scene, view), kept = capture(scene, view, settings);
        settings.clip.keep_inside = false;
        const auto rest = capture(scene, view, settings);
        EXPECT_GT(kept.image.fragments(), 0U) << name;
        EXPECT_GT(rest.image.fragments(), 0U) << name;
        EXPECT_EQ(kept.image.fragments() + rest.image.fragments(), all.image.fragments()) << name;
        forEachPoint(kept.image, view, [&](std::size_t, std::uint32_t, const glm::dvec3& p) {
            ASSERT_TRUE(inside_all(p, kRounding)) << name;
        });
        forEachPoint(rest.image, view, [&](std::size_t, std::uint32_t, const glm::dvec3& p) {
            ASSERT_FALSE(inside_all(p, -kRounding)) << name;
        });
    }
}

/// Returns settings that keep the inside of a node's mesh or, if `inside` is false, the outside.
CaptureSettings clippedBy(int node, bool inside = true) {
    CaptureSettings settings;
    settings.clip.nodes = {node};
    settings.clip.keep_inside = inside;
    return settings;
}

TEST(Clip, MethodsBandsAndSurfacesAgreeUnderAMesh) {
    const int scale = exhaustive() ? 2 : 1;
    const View view = testView(80 * scale, 60 * scale);
    for (auto& [name, hard] : hardScenes()) {
        SceneBuilder builder;
        builder.scene() = hard;
        for (std::size_t i = 0; i < builder.scene().materials.size(); i += 4)
            builder.scene().materials[i].alpha_mode = AlphaMode::kOpaque;
        const int ball = addBall(builder, {0.2, 0.1, -3}, 1.2, 24);
        for (const Surfaces surfaces : {Surfaces::kAll, Surfaces::kVisible}) {
            for (const bool inside : {true, false}) {
                CaptureSettings settings = clippedBy(ball, inside);
                settings.surfaces = surfaces;
                const auto reference = capture(builder.scene(), view, settings);
                EXPECT_GT(reference.image.fragments(), 0U);
                for (const auto& method : peelMethods()) {
                    if (!method.exact()) continue;
                    settings.method = method.name;
                    settings.band_bytes = (1U << 18) * static_cast<unsigned>(scale * scale);
                    const auto other = capture(builder.scene(), view, settings);
                    EXPECT_GT(other.bands.size(), 1U);
                    EXPECT_EQ(difference(reference.image, other.image), "")
                        << name << ", " << method.name;
                }
            }
        }
    }
}

TEST(Clip, InsideAndOutsideOfAMeshAreEverythingButTheMesh) {
    for (auto& [name, hard] : hardScenes()) {
        SceneBuilder builder;
        builder.scene() = hard;
        const int ball = addBall(builder, {0, 0, -3}, 1, 24);
        const auto count = [&](bool inside) {
            return capture(builder.scene(), testView(160, 120), clippedBy(ball, inside))
                .image.fragments();
        };
        EXPECT_EQ(count(true) + count(false), capture(hard, testView(160, 120)).image.fragments())
            << name;
    }
}

TEST(Clip, WorksWithTheCameraInsideTheMesh) {
    SceneBuilder builder;
    for (const float z : {-0.5F, -1.5F, -2.5F, -3.5F})
        builder.rectangle(9, 9, z, builder.material({1, 1, 1, 0.5F}));
    const int ball = addBall(builder, {0, 0, 0}, 2, 48);  // the ball's centre is the camera
    const auto result = capture(builder.scene(), testView(40, 30), clippedBy(ball));
    const std::size_t middle = result.image.pixelIndex(20, 15);
    ASSERT_EQ(result.image.count(middle), 2U);
    EXPECT_FLOAT_EQ(result.image.z[result.image.offsets[middle]], 0.5F);
    EXPECT_FLOAT_EQ(result.image.z[result.image.offsets[middle] + 1], 1.5F);
}

TEST(Clip, WorksWithAMeshThatTheFarPlaneCuts) {
    SceneBuilder builder;
    for (const float z : {-1.0F, -2.5F, -3.5F})
        builder.rectangle(9, 9, z, builder.material({1, 1, 1, 0.5F}));
    const int ball = addBall(builder, {0, 0, -4}, 2, 48);
    View view = testView(40, 30);
    view.projection.far = 4;
    const auto result = capture(builder.scene(), view, clippedBy(ball));
    EXPECT_EQ(result.image.count(result.image.pixelIndex(20, 15)), 2U);
}

TEST(Clip, TheSurfacesOfAMeshCountAmongABandsBytes) {
    SceneBuilder builder;
    builder.rectangle(9, 9, -3, builder.material({1, 1, 1, 0.5F}));
    std::vector<glm::vec3> walls;
    constexpr std::size_t kWalls = 201;
    for (std::size_t i = 0; i < kWalls; ++i) {
        const float z = -2 - 0.01F * static_cast<float>(i);
        for (const glm::vec2 corner : {glm::vec2(-99, -99), glm::vec2(99, -99), glm::vec2(0, 99)})
            walls.emplace_back(corner, z);
    }
    const int mesh = builder.triangles(walls, builder.material({1, 1, 1, 1}));
    for (const char* method : {"a-buffer", "dual"}) {
        for (const bool composite : {false, true}) {
            CaptureSettings settings = clippedBy(mesh);
            settings.method = method;
            settings.composite = composite;
            const auto whole = capture(builder.scene(), testView(160, 120), settings);
            EXPECT_EQ(whole.image.fragments(), 160U * 120U);
            settings.band_bytes = 1 << 20;
            const auto cut = capture(builder.scene(), testView(160, 120), settings);
            EXPECT_EQ(difference(whole.image, cut.image), "");
            for (const Window& band : cut.bands)
                EXPECT_LT(band.pixels() * kWalls * sizeof(float), settings.band_bytes);
        }
    }
}

/// Embree gives the depths along −Z at which a ray enters and leaves the ball.
TEST(Clip, ABallKeepsAsManyLayersAsEmbreeFindsHitsInside) {
    auto scenes = hardScenes();
    SceneBuilder builder;
    builder.scene() = scenes[0].scene;
    for (Material& material : builder.scene().materials)
        material.double_sided = true;
    SceneBuilder only_ball;
    addBall(only_ball, {0.1, -0.1, -4}, 1.1, 40);
    const int ball = addBall(builder, {0.1, -0.1, -4}, 1.1, 40);

    const TriangleSoup scene_soup = soupOf(scenes[0].scene), ball_soup = soupOf(only_ball.scene());
    AllHits scene_hits(scene_soup), ball_hits(ball_soup);
    const View view = testView(320, 240);
    CaptureSettings settings = clippedBy(ball);
    settings.faces = Faces::kBoth;
    const auto result = capture(builder.scene(), view, settings);
    std::size_t inside_pixels = 0, wrong = 0;
    for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
            const glm::dvec3 direction = pointAt(view, x, y, 1);
            const auto boundary = ball_hits({0, 0, 0}, direction, false);
            std::uint32_t inside = 0;
            for (const float t : scene_hits({0, 0, 0}, direction, false)) {
                if (!(t >= 0.1F)) continue;  // the hit is in front of the near plane
                const auto behind = std::count_if(boundary.begin(), boundary.end(),
                                                  [&](float b) { return b >= t; });
                inside += behind % 2 == 1 ? 1 : 0;
            }
            inside_pixels += inside > 0 ? 1 : 0;
            wrong += result.image.count(result.image.pixelIndex(x, y)) == inside ? 0 : 1;
        }
    }
    std::printf("%zu pixels with layers inside the ball, %zu differ\n", inside_pixels, wrong);
    EXPECT_GT(inside_pixels, 10000U);
    // GL and Embree may differ if a ray passes within 1/256 pixel of a triangle's edge.
    EXPECT_LT(wrong, inside_pixels / 200);
}

}  // namespace
}  // namespace peeler::test
