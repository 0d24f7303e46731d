// SPDX-License-Identifier: Apache-2.0
// Hits found on the CPU against what is known on paper: parity, places, what is cut and what
// passes.
#include "core/raster/hit_rasterizer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <random>

#include "core/rays/bundle.h"
#include "core/scene/elements.h"
#include "support/closed_meshes.h"
#include "support/edge_distance.h"
#include "support/numbers.h"
#include "support/one_mesh.h"
#include "support/test_support.h"
#include "support/traced_hits.h"

namespace peeler::test {
namespace {

/// A pinhole at `eye` that looks at the origin.
View pinhole(const glm::dvec3& eye, int size, double half = 0.6, double near = 0.01) {
    View view;
    view.camera_to_world = *lookAlong(eye, -eye, {0.1, 1, 0.2});
    view.width = view.height = size;
    view.crop = {0, 0, size, size};
    view.projection.half_width = view.projection.half_height = half;
    view.projection.near = near;
    return view;
}

std::size_t oddRays(const LayeredImage& image) {
    return static_cast<std::size_t>(
        std::ranges::count_if(countsOf(image), [](std::uint32_t n) { return n % 2 == 1; }));
}

TEST(HitRasterizer, ClosedMeshesHaveEvenRays) {
    const Primitive meshes[] = {icosphere(1), icosphere(4), torus(0.4, 64, 32),
                                torus(0.01, 400, 12), cube()};
    for (const Primitive& mesh : meshes) {
        const Scene scene = sceneOf({{"", {mesh}}});
        const PosedScene posed(scene);
        HitRasterizer source(posed);
        std::size_t odd = 0, hits = 0;
        for (const glm::dvec3& direction : sphereDirections(64)) {
            const TracedHits traced = trace(source, bundleOf(posed, direction, 128).view);
            odd += oddRays(traced.image);
            hits += traced.image.fragments();
            const TracedHits seen = trace(source, pinhole(-4.0 * direction, 64));
            odd += oddRays(seen.image);
            hits += seen.image.fragments();
        }
        EXPECT_EQ(odd, 0U) << mesh.indices.size() << " indices";
        EXPECT_GT(hits, 20000U);
    }
}

// What the test above cannot see if it could not fail.
TEST(HitRasterizer, AHoleIsSeen) {
    Primitive mesh = icosphere(3);
    mesh.indices.resize(mesh.indices.size() - 3);
    const Scene scene = sceneOf({{"", {mesh}}});
    const PosedScene posed(scene);
    HitRasterizer source(posed);
    std::size_t odd = 0;
    for (const glm::dvec3& direction : sphereDirections(8))
        odd += oddRays(trace(source, bundleOf(posed, direction, 128).view).image);
    EXPECT_GT(odd, 10U);
}

/// Coincident meshes: twice the hits, at the same Z to the last bit, and in the order in which they
/// are drawn, whatever corner each triangle begins with and whichever way it goes round.
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

/// Every ray against every triangle, in double precision: hits are the same but for rays that pass
/// an edge by a step of the grid or so, and Z is where the ray meets the plane.
void compareWithTriangles(const PosedScene& posed, const View& view) {
    HitRasterizer source(posed);
    const TracedHits traced = trace(source, view);
    const Bounds box = *posed.bounds();
    const double size = glm::length(box.max - box.min);
    const auto triangles =
        static_cast<std::uint32_t>(elementsOf(posed.primitives(posed.meshes()[0])[0]));
    const PixelRays rays(view);
    const glm::dmat4 camera = glm::inverse(view.camera_to_world);
    std::size_t differing = 0;
    for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
            const glm::dvec2 at = glm::dvec2(x, y) + view.sample;
            const glm::dvec3 origin = worldPosition(view, at.x, at.y, 0);
            const glm::dvec3 direction = worldPosition(view, at.x, at.y, 1) - origin;
            const std::size_t pixel = traced.image.pixelIndex(x, y);
            const std::vector<std::uint32_t> keys = traced.keys(pixel);
            for (std::uint32_t key = 1; key <= triangles; ++key) {
                WorldElement element = elementOf(posed, key);
                placeCorners(posed, element);
                const glm::dvec3 &a = element.corner[0], &b = element.corner[1],
                                 &c = element.corner[2];
                const glm::dvec3 e1 = b - a, e2 = c - a, across = glm::cross(direction, e2);
                const double determinant = glm::dot(e1, across);
                const double u = glm::dot(origin - a, across) / determinant;
                const double v = glm::dot(direction, glm::cross(origin - a, e1)) / determinant;
                const bool hit = u >= 0 && v >= 0 && u + v <= 1;
                const auto found = std::ranges::find(keys, key);
                if (hit != (found != keys.end())) {
                    ++differing;
                    glm::dvec2 corners[3];
                    for (int i = 0; i < 3; ++i)
                        corners[i] = rays.pixel(glm::dvec3(
                            camera * glm::dvec4(element.corner[static_cast<std::size_t>(i)], 1)));
                    EXPECT_LE(distanceToEdges(corners, at), 2.0 / 65536);
                }
                if (!hit || found == keys.end()) continue;
                const double t = glm::dot(e2, glm::cross(origin - a, e1)) / determinant;
                const std::size_t f =
                    traced.image.offsets[pixel] + static_cast<std::size_t>(found - keys.begin());
                EXPECT_NEAR(static_cast<double>(traced.image.z[f]), t, 1e-7 * size)
                    << x << ", " << y;
            }
        }
    }
    EXPECT_LE(differing, 2U);
    EXPECT_GT(traced.image.fragments(), 1000U);
}

TEST(HitRasterizer, HitsAreWhereRaysMeetTriangles) {
    const Scene scene = sceneOf({{"", {placed(torus(0.4, 24, 12), 3, {1, 2, 3})}}});
    const PosedScene posed(scene);
    compareWithTriangles(posed, bundleOf(posed, {0.3, -0.7, 0.2}, 60).view);
    View eye = pinhole({4, 9, 7}, 60, 0.5);
    eye.sample = {0.3, 0.6};
    compareWithTriangles(posed, eye);
}

/// A floor that reaches behind the eye and far beyond the picture, in strips: every ray that goes
/// down hits it once, the edges of strips and the cut of the near plane included.
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
                // Beyond a distance of 50 the smallest floor has ended.
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
    // A ramp: Z grows from 2 to 10 over the width of 80 rays.
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
    // The near plane itself is in, the far one is not.
    const Scene planes = oneMesh({square(0, 0, 80, 4, -4), square(0, 0, 80, 4, -7)});
    HitRasterizer both{PosedScene(planes)};
    const TracedHits at = trace(both, view, settings);
    EXPECT_EQ(at.image.fragments(), 320U);
    EXPECT_EQ(at.image.z.front(), 4.0F);
    settings.depth_clamp = true;
    EXPECT_EQ(trace(both, view, settings).image.fragments(), 640U);
    EXPECT_EQ(trace(source, view, settings).image.fragments(), 320U);
}

/// Buffer depth goes from 1 at the near to 0 at the far plane.
TEST(HitRasterizer, SlopesAreHowBufferDepthChanges) {
    Primitive plane = square(-20, -20, 40, 40, 0);
    for (glm::vec3& p : plane.positions)
        p.z = -10 + 0.25F * p.x - 0.125F * p.y;
    const Scene scene = oneMesh({plane});
    HitRasterizer source{PosedScene(scene)};
    const TracedHits parallel =
        trace(source, parallelView(16, 16, 100), hitSettings(HitMode::kSloped));
    ASSERT_EQ(parallel.image.fragments(), 256U);
    const auto slopes = parallel.image.color.as<float>();
    for (std::size_t f = 0; f < 256; ++f) {
        // Z = 10 − x/4 + y/8, y up; depth = (100 − Z)/100.
        EXPECT_NEAR(static_cast<double>(slopes[2 * f]), 0.25 / 100, 1e-9);
        EXPECT_NEAR(static_cast<double>(slopes[2 * f + 1]), -0.125 / 100, 1e-9);
    }
    View eye = parallelView(16, 16);
    eye.projection = {true, 0.5, 0.5, 0.5, 50};
    const TracedHits seen = trace(source, eye, hitSettings(HitMode::kSloped));
    const double n = 0.5, far = 50;
    const auto depth = [&](std::size_t f) {
        return (n * far / static_cast<double>(seen.image.z[f]) - n) / (far - n);
    };
    ASSERT_EQ(seen.image.fragments(), 256U);
    const auto changes = seen.image.color.as<float>();
    EXPECT_NEAR(static_cast<double>(changes[2 * 100]), depth(101) - depth(100), 1e-7);
    EXPECT_NEAR(static_cast<double>(changes[2 * 100 + 1]), depth(84) - depth(100), 1e-7);
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
    image.rgba[4 + 3] = image.rgba[8 + 3] = 0;  // upper right and lower left
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
    EXPECT_EQ(pattern(), std::vector<std::uint32_t>(64, 1));  // OPAQUE
    material.alpha_mode = AlphaMode::kMask;
    EXPECT_EQ(pattern(), squares);
    material.alpha_mode = AlphaMode::kBlend;
    EXPECT_EQ(pattern(), squares);
    // Half a period to the right and, of a quarter of the size, wrapped as the sampler says.
    material.base_color_texture.transform[2] = {0.5F, 0, 1};
    EXPECT_EQ(pattern(), expected([](int x, int y) { return (x < 4) != (y < 4); }));
    material.base_color_texture.transform = glm::mat3(1);
    material.base_color_texture.transform[0][0] = 2;
    material.base_color_texture.transform[1][1] = 2;
    EXPECT_EQ(pattern(), expected([](int x, int y) { return (x % 4 < 2) == (y % 4 < 2); }));
    sampler.wrap_s = sampler.wrap_t = 33648;  // mirrored
    EXPECT_EQ(pattern(),
              expected([](int x, int y) { return (x < 2 || x >= 6) == (y < 2 || y >= 6); }));
    sampler.wrap_s = sampler.wrap_t = 33071;  // clamped
    EXPECT_EQ(pattern(), expected([](int x, int y) { return (x < 2) == (y < 2); }));
    // Between texels alpha is their mean; at the middle of the picture 1/2.
    material.base_color_texture.transform = glm::mat3(1);
    material.alpha_mode = AlphaMode::kMask;
    sampler.mag_filter = 9729;
    material.alpha_cutoff = 0.5F;
    // (1 − u)(1 − v) + uv >= 1/2 is (u − 1/2)(v − 1/2) >= 0.
    EXPECT_EQ(pattern(), squares);
    material.alpha_cutoff = 0.75F;
    EXPECT_EQ(pattern(), expected([](int x, int y) {
                  const auto share = [](int i) {
                      return std::clamp((i + 0.5) / 4 - 0.5, 0.0, 1.0);
                  };
                  const double u = share(x), v = share(y);
                  return (1 - u) * (1 - v) + u * v >= 0.75;
              }));
    // Factor, vertex colours and a second set of coordinates.
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

/// Of a pinhole weights are not linear on the picture: the texture's middle is seen where the
/// middle of the square is.
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
        const double z = 1 / (1.1 * (2 * (y + 0.5) / 100 - 1));  // where the ray meets the floor
        for (int x = 0; x < 100; ++x) {
            const double across = 1.1 * (2 * (x + 0.5) / 100 - 1) * z;
            const bool there = z > 1 && z < 9 && std::abs(across) < 1.03 && (across < 0) == (z > 5);
            EXPECT_EQ(image.count(image.pixelIndex(x, y)), there ? 1U : 0U) << x << ", " << y;
            seen += there ? 1 : 0;
        }
    }
    EXPECT_GT(seen, 400U);
}

TEST(HitRasterizer, TrianglesBeyondNumbers) {
    constexpr float kFar = 1e30F;
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    Primitive primitive;
    const auto add = [&](glm::vec3 a, glm::vec3 b, glm::vec3 c) {
        primitive.positions.insert(primitive.positions.end(), {a, b, c});
    };
    add({-kFar, kFar, -1}, {kFar, kFar, -1}, {0, -kFar, -1});   // 1: all of the picture
    add({kNan, 0, -2}, {8, 0, -2}, {0, -8, -2});                // 2: none
    add({0, 0, -3}, {8, -8, -3}, {4, -4, -3});                  // 3: no area
    add({-1, 1, kNan}, {20, 1, -2}, {-1, -20, -2});             // 4: none
    add({-1, 1, -kFloatInfinity}, {20, 1, -2}, {-1, -20, -2});  // 5: none
    add({kFar, 1, -5}, {-1, 1, -5}, {-1, -kFar, -5});           // 6: all of the picture
    add({-kFar, -2, -6}, {kFar, -2, -6}, {4, -6, -6});          // 7: from y = 2 on
    add({2, -2, -7}, {2, -2, -7}, {2, -2, -7});                 // 8: a point
    const Scene scene = oneMesh({primitive});
    HitRasterizer source{PosedScene(scene)};
    const TracedHits traced = trace(source, parallelView(8, 8));
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x)
            EXPECT_EQ(traced.keys(traced.image.pixelIndex(x, y)),
                      (y >= 2 && y < 6 ? std::vector<std::uint32_t>{1, 6, 7}
                                       : std::vector<std::uint32_t>{1, 6}))
                << x << ", " << y;
    // Of a pinhole at (4, −4, 4), before which the first and the sixth go on without an end.
    View eye = parallelView(8, 8);
    eye.camera_to_world[3] = {4, -4, 4, 1};
    eye.projection = {true, 0.5, 0.5, 0.1, kInfinity};
    const TracedHits seen = trace(source, eye);
    for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 8; ++x) {
            const double down = 4 + 10 * ((y + 0.5) / 8 - 0.5);  // at Z = 10, where the seventh is
            std::vector<std::uint32_t> expected = {1, 6};
            if (down >= 2 && down < 6) expected.push_back(7);
            EXPECT_EQ(seen.keys(seen.image.pixelIndex(x, y)), expected) << x << ", " << y;
        }
    }
}

/// Rays have no beginning unless the near plane is one: hits behind it come first.
TEST(HitRasterizer, HitsBehindTheStartComeFirst) {
    const Scene scene =
        oneMesh({square(0, 0, 4, 4, -3), square(0, 0, 4, 4, 5), square(0, 0, 4, 4, 0),
                 square(0, 0, 4, 4, 2), square(0, 0, 4, 4, -0.0F), square(0, 0, 4, 4, -7)});
    HitRasterizer source{PosedScene(scene)};
    const LayeredImage image = trace(source, parallelView(4, 4)).image;
    EXPECT_EQ(std::vector<float>(image.z.begin(), image.z.begin() + image.count(0)),
              (std::vector<float>{-5, -2, 0, 0, 3, 7}));
    EXPECT_FALSE(std::signbit(image.z[2]) || std::signbit(image.z[3]));
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

/// Keys are those of the draw list, whatever topology, instance and primitive they come from, and
/// lines and points are not hit.
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