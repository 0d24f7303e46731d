// SPDX-License-Identifier: Apache-2.0
// Tests midpoint shadow maps in scenes with analytic shadows.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include <peeler/error.h>
#include <peeler/view.h>
#include "core/capture/method.h"
#include "core/image/composite.h"
#include "support/capture.h"
#include "support/lights.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

CaptureSettings withShadows(int size) {
    CaptureSettings s;
    s.color_type = PixelType::kFloat;
    s.shadows = true;
    s.shadow_size = size;
    return s;
}

/// Renders of one view with shadows, without shadows, and without light. A fragment with shadows
/// must have the colour without shadows (lit), the colour without light (in shadow), or a colour in
/// between.
struct Exposures {
    LayeredImage shadowed, lit, dark;

    Exposures(Scene scene, const View& view, int size) {
        CaptureSettings s = withShadows(size);
        shadowed = capture(scene, view, s).image;
        s.shadows = false;
        lit = capture(scene, view, s).image;
        for (Light& source : scene.lights)
            source.intensity = 0;
        dark = capture(scene, view, s).image;
    }

    bool isLit(std::size_t f) const { return color(shadowed, f) == color(lit, f); }
    bool isDark(std::size_t f) const { return color(shadowed, f) == color(dark, f); }
    bool tells(std::size_t f) const { return color(lit, f) != color(dark, f); }

    /// Returns the position of fragment f of pixel (x, y), in the camera space of the test view.
    glm::dvec3 point(const View& view, int x, int y, std::size_t f) const {
        const double z = static_cast<double>(shadowed.z[f]);
        return {z * view.projection.half_width * ((x + 0.5) / view.width * 2 - 1),
                z * view.projection.half_height * (1 - (y + 0.5) / view.height * 2), -z};
    }
};

/// Calls visit(fragment, point) for every fragment.
void forEach(const Exposures& seen, const View& view,
             const std::function<void(std::size_t, const glm::dvec3&)>& visit) {
    for (int y = 0; y < view.height; ++y)
        for (int x = 0; x < view.width; ++x) {
            const std::size_t p = seen.lit.pixelIndex(x, y);
            for (std::size_t f = seen.lit.offsets[p]; f < seen.lit.offsets[p + 1]; ++f)
                visit(f, seen.point(view, x, y, f));
        }
}

/// Returns a wall of half extents (4, 4) at z = −4, and a square of half extent 0.3 in front of it,
/// at `z`.
SceneBuilder wallAndSquare(float z, AlphaMode mode, float alpha = 1) {
    SceneBuilder builder;
    const int white = builder.lit(builder.material({1, 1, 1, 1}, AlphaMode::kOpaque));
    builder.rectangle(4, 4, -4, white);
    builder.rectangle(0.3F, 0.3F, z, builder.lit(builder.material({1, 1, 1, alpha}, mode)));
    return builder;
}

/// Expects the wall to be in shadow inside the rectangle and lit outside; within `tolerance` of the
/// rectangle's edge, either is allowed. The square itself must be lit.
void expectShadow(const Scene& scene, int size, const glm::dvec2& low, const glm::dvec2& high,
                  double tolerance) {
    const View view = testView(255, 255);
    const Exposures seen(scene, view, size);
    std::size_t lit = 0, dark = 0, wrong = 0, edge = 0;
    forEach(seen, view, [&](std::size_t f, const glm::dvec3& at) {
        ASSERT_TRUE(seen.tells(f));
        if (at.z > -3.9) {
            wrong += seen.isLit(f) ? 0 : 1;
            return;
        }
        const glm::dvec2 outside = glm::max(low - glm::dvec2(at), glm::dvec2(at) - high);
        const double distance = std::max(outside.x, outside.y);
        if (std::abs(distance) < tolerance) {
            ++edge;
        } else if (distance > 0) {
            ++lit;
            wrong += seen.isLit(f) ? 0 : 1;
        } else {
            ++dark;
            wrong += seen.isDark(f) ? 0 : 1;
        }
    });
    EXPECT_EQ(wrong, 0U);
    EXPECT_GT(lit, 10000U);
    EXPECT_GT(dark, 500U);
    EXPECT_LT(edge, 1000U) << "the tolerance hides the test";
}

TEST(Shadows, OfADirectionalLightLieWhereTheRaysEnd) {
    SceneBuilder builder = wallAndSquare(-3, AlphaMode::kOpaque);
    // From the square to the wall, the light's rays shift by (0.5, −0.25).
    builder.light(lightOf(LightType::kDirectional, 2),
                  *lookAlong({7, 8, 9}, {0.5, -0.25, -1}, {0, 1, 0}));
    // A texel of the map covers 8 · 1.01 / 512 of the wall, or slightly more at an angle.
    expectShadow(builder.scene(), 512, {0.2, -0.55}, {0.8, 0.05}, 0.025);
}

TEST(Shadows, OfASpotLightLieWhereTheRaysEnd) {
    SceneBuilder builder = wallAndSquare(-2, AlphaMode::kOpaque);
    Light spot = lightOf(LightType::kSpot, 50);
    spot.inner_cone = 0.9;  // lights the whole picture fully
    spot.outer_cone = 1;
    // The light at (0.3, 0.2, 0) casts a shadow of twice the square's size.
    builder.light(spot, *lookAlong({0.3, 0.2, 0}, {0, 0, -1}, {1, 2, 0}));
    // A texel of the map covers 2 · 4 · tan(1) · 1.01 / 1024 of the wall, and is rotated relative
    // to the wall.
    expectShadow(builder.scene(), 1024, {-0.9, -0.8}, {0.3, 0.4}, 0.025);
}

TEST(Shadows, AreCastThroughTheHolesOfMasksAndByBothFaces) {
    SceneBuilder builder = wallAndSquare(-3, AlphaMode::kMask);
    Material& leaf = builder.scene().materials[builder.scene().meshes[1].primitives[0].material];
    leaf.double_sided = true;
    Primitive& square = builder.scene().meshes[1].primitives[0];
    // Alpha is interpolated from 0 at the left edge to 1 at the right. With the cutoff 0.5, the
    // half with x > 0 remains.
    for (const glm::vec3& p : square.positions)
        square.colors.push_back({1, 1, 1, p.x > 0 ? 1 : 0});
    builder.light(lightOf(LightType::kDirectional, 2),
                  *lookAlong({0, 0, 0}, {0.5, 0, -1}, {0, 1, 0}));
    expectShadow(builder.scene(), 512, {0.5, -0.3}, {0.8, 0.3}, 0.025);
    // Turns the front toward the wall.
    std::reverse(square.positions.begin(), square.positions.end());
    std::reverse(square.colors.begin(), square.colors.end());
    leaf.double_sided = false;
    const View view = testView(64, 64);
    const Exposures seen(builder.scene(), view, 512);
    std::size_t dark = 0;
    forEach(seen, view, [&](std::size_t f, const glm::dvec3&) { dark += seen.isDark(f) ? 1 : 0; });
    EXPECT_GT(dark, 20U);
}

TEST(Shadows, AreNotCastByGlassNorByPointLights) {
    SceneBuilder glass = wallAndSquare(-3, AlphaMode::kBlend, 0.5F);
    glass.light(lightOf(LightType::kDirectional, 2),
                *lookAlong({0, 0, 0}, {0.5, 0, -1}, {0, 1, 0}));
    SceneBuilder lamp = wallAndSquare(-3, AlphaMode::kOpaque);
    lamp.light(lightOf(LightType::kPoint, 2), glm::dmat4(1));
    const View view = testView(64, 64);
    for (const SceneBuilder& builder : {glass, lamp}) {
        const Exposures seen(builder.scene(), view, 256);
        EXPECT_EQ(difference(seen.shadowed, seen.lit), "");
    }
}

TEST(Shadows, GlassReceivesThem) {
    SceneBuilder builder = wallAndSquare(-3, AlphaMode::kOpaque);
    builder.rectangle(4, 4, -3.75F, builder.lit(builder.material({1, 1, 1, 0.5F})));
    builder.light(lightOf(LightType::kDirectional, 2), glm::dmat4(1));
    const View view = testView(63, 63);
    const Exposures seen(builder.scene(), view, 512);
    const std::size_t f = seen.lit.offsets[seen.lit.pixelIndex(31, 31)];
    EXPECT_TRUE(seen.isLit(f) && !seen.isDark(f));
    EXPECT_TRUE(seen.isDark(f + 1) && !seen.isLit(f + 1)) << "the pane behind the square";
    EXPECT_TRUE(seen.isDark(f + 2)) << "the wall";
}

TEST(Shadows, SurfacesThatCoincideAreLit) {
    SceneBuilder builder = wallAndSquare(-3, AlphaMode::kOpaque);
    const int white = builder.scene().meshes[0].primitives[0].material;
    builder.rectangle(4, 4, -4, white);
    // A second square coincides with the first but has the other diagonal, so the depths of the two
    // squares differ by rounding.
    builder.quad({0.3, -0.3, -3}, {0.3, 0.3, -3}, {-0.3, 0.3, -3}, {-0.3, -0.3, -3}, white);
    builder.light(lightOf(LightType::kDirectional, 2),
                  *lookAlong({7, 8, 9}, {0.5, -0.25, -1}, {0, 1, 0}));
    expectShadow(builder.scene(), 512, {0.2, -0.55}, {0.8, 0.05}, 0.025);
}

/// Returns a closed sphere around (0, 0, −3) with exact normals.
SceneBuilder sphere() {
    constexpr int kRound = 160, kRows = 80;
    std::vector<glm::vec3> positions, normals;
    const auto at = [](int i, int j) {
        const double a = 2 * std::numbers::pi * i / kRound, b = std::numbers::pi * j / kRows;
        return glm::vec3(std::sin(b) * std::cos(a), std::cos(b), -std::sin(b) * std::sin(a));
    };
    for (int i = 0; i < kRound; ++i)
        for (int j = 0; j < kRows; ++j)
            for (const auto& [di, dj] : {std::pair{0, 0}, {0, 1}, {1, 1}, {0, 0}, {1, 1}, {1, 0}})
                normals.push_back(at(i + di, j + dj));
    for (const glm::vec3& n : normals)
        positions.push_back(n + glm::vec3(0, 0, -3));
    SceneBuilder builder;
    builder.triangles(positions, builder.lit(builder.material({1, 1, 1, 1}, AlphaMode::kOpaque)));
    builder.scene().meshes[0].primitives[0].normals = normals;
    return builder;
}

TEST(Shadows, AreFreeOfAcneWithoutABias) {
    const View view = testView(255, 255);
    for (const glm::dvec3& forward : {glm::dvec3(-1, -1, -1), glm::dvec3(1, -0.2, -0.1)}) {
        SceneBuilder builder = sphere();
        builder.light(lightOf(LightType::kDirectional, 2),
                      *lookAlong({0, 0, 0}, forward, {0, 1, 0}));
        const Exposures seen(builder.scene(), view, 2048);
        std::size_t facing = 0, away = 0, wrong = 0;
        forEach(seen, view, [&](std::size_t f, const glm::dvec3& p) {
            // The nearest fragment is lit if it faces the light, and in shadow if it faces away.
            const double cosine = -glm::dot(p - glm::dvec3(0, 0, -3), glm::normalize(forward));
            if (cosine > 0.05) {
                ++facing;
                wrong += seen.isLit(f) ? 0 : 1;
            } else if (cosine < -0.05) {
                ++away;
                wrong += seen.isDark(f) ? 0 : 1;
            }
        });
        EXPECT_EQ(wrong, 0U);
        EXPECT_GT(facing, 10000U);
        EXPECT_GT(away, 10000U);
    }
}

TEST(Shadows, TheBuiltInLightCastsThem) {
    SceneBuilder builder = wallAndSquare(-3, AlphaMode::kOpaque);
    const View view = testView(128, 128);
    CaptureSettings s = withShadows(512);
    const auto shadowed = capture(builder.scene(), view, s).image;
    s.shadows = false;
    const auto lit = capture(builder.scene(), view, s).image;
    // From the square at z = −3 to the wall, the key light's rays shift by (0.918, −1.606).
    std::size_t dark = 0, wrong = 0;
    for (int y = 0; y < view.height; ++y)
        for (int x = 0; x < view.width; ++x) {
            const std::size_t f = lit.offsets[lit.pixelIndex(x, y) + 1] - 1;
            const glm::dvec2 at(2 * ((x + 0.5) / 64 - 1), 2 * (1 - (y + 0.5) / 64));
            const glm::dvec2 off = glm::abs(at - glm::dvec2(0.918, -1.606));
            const double distance = std::max(off.x, off.y) - 0.3;
            if (std::abs(distance) < 0.05) continue;
            dark += distance < 0 ? 1 : 0;
            // A GPU's compiler may round differently in a shader with shadows; hence the tolerance.
            const bool seen = color(shadowed, f).g > 0.999F * color(lit, f).g;
            wrong += seen == (distance > 0) ? 0 : 1;
        }
    EXPECT_EQ(wrong, 0U);
    EXPECT_GT(dark, 100U);
}

/// Returns opaque, masked and transparent squares at random places under three lights.
Scene crowdOfSquares() {
    SceneBuilder builder = wallAndSquare(-3, AlphaMode::kOpaque);
    for (int i = 0; i < 30; ++i) {
        const double t = i;
        const auto mode = static_cast<AlphaMode>(i % 3);
        const int m = builder.lit(builder.material({0.8F, 0.6F, 0.4F, 0.7F}, mode));
        const glm::dvec3 at(std::sin(t), std::cos(2 * t), -3 + 0.6 * std::sin(3 * t));
        const auto place = *lookAlong(at, {std::sin(5 * t), 0.3, -1}, {0.2, 1, 0});
        builder.quad({-0.3, -0.3, 0}, {0.3, -0.3, 0}, {0.3, 0.3, 0}, {-0.3, 0.3, 0}, m, place);
    }
    Light spot = lightOf(LightType::kSpot, 20);
    spot.outer_cone = 0.6;
    builder.light(spot, *lookAlong({0.5, 1, 0}, {0, -0.2, -1}, {0, 1, 0}));
    builder.light(lightOf(LightType::kPoint, 5), *lookAlong({0, 0, -1}, {0, 0, -1}, {0, 1, 0}));
    builder.light(lightOf(LightType::kDirectional, 1),
                  *lookAlong({0, 0, 0}, {1, -1, -1}, {0, 1, 0}));
    return builder.scene();
}

TEST(Shadows, AreTheSameWithEveryMethodAndBand) {
    const Scene scene = crowdOfSquares();
    const View view = testView(160, 120);
    CaptureSettings s = withShadows(300);
    s.color_type = PixelType::kHalf;
    const auto reference = capture(scene, view, s);
    s.shadows = false;
    EXPECT_NE(difference(reference.image, capture(scene, view, s).image), "");
    s.shadows = true;
    for (const auto& method : peelMethods()) {
        if (!method.exact()) continue;
        s.method = method.name;
        EXPECT_EQ(difference(reference.image, capture(scene, view, s).image), "") << method.name;
    }
    s.band_bytes = 1 << 18;
    const auto cut = capture(scene, view, s);
    EXPECT_GT(cut.bands.size(), 2U);
    EXPECT_EQ(difference(reference.image, cut.image), "");
}

TEST(Shadows, AreTheSameInComposites) {
    const Scene scene = crowdOfSquares();
    const View view = testView(160, 120);
    CaptureSettings s = withShadows(300);
    const LayeredImage layers = capture(scene, view, s).image;
    s.composite = true;
    const auto worst = [&](const CompositeImage& expected) {
        CompositeImage seen;
        compositeOver(capture(scene, view, s).image, {}, seen);
        float most = 0;
        for (std::size_t p = 0; p < seen.rgba.size(); ++p)
            for (std::size_t c = 0; c < 4; ++c)
                most = std::max(most, std::abs(seen.rgba[p][c] - expected.rgba[p][c]));
        return most;
    };
    CompositeImage all, with_tail, average;
    compositeOver(layers, {}, all);
    compositeNearest(layers, 1, Tail::kBlend, with_tail);
    compositeWeightedAverage(layers, {}, average);
    for (const auto& method : peelMethods()) {
        if (!method.exact()) continue;
        s.method = method.name;
        EXPECT_LT(worst(all), 1e-4F) << method.name;
        s.max_layers = 1;
        s.tail = Tail::kBlend;
        EXPECT_LT(worst(with_tail), 1e-4F) << method.name;
        s.max_layers = 0;
        s.tail = Tail::kDrop;
    }
    s.method = "weighted-average";
    EXPECT_LT(worst(average), 1e-4F);
}

TEST(Shadows, AreTheSameOnBothBackends) {
    if (!sharedContext().device().software) GTEST_SKIP() << "a GPU rounds as it likes";
    const std::string other = testBackend() == "egl" ? "osmesa" : "egl";
    const Scene scene = crowdOfSquares();
    const View view = testView(160, 120);
    const auto here = capture(scene, view, withShadows(300));
    LayeredImage there;
    inOwnThread([&] {
        const auto context = gl::createContext({.backend = other});
        there = capture(scene, view, withShadows(300), *context).image;
    });
    EXPECT_EQ(difference(here.image, there), "");
}

TEST(Shadows, MapsServeEveryViewOfTheScene) {
    const Scene scene = crowdOfSquares();
    const PosedScene shown(scene, 0);
    GlRenderer renderer(sharedContext(), shown);
    View view = testView(64, 48);
    for (const int size : {200, 200, 100}) {
        view.camera_to_world[3].x += 0.25;
        CollectSink collect;
        renderer.capture(renderer.plan(view, withShadows(size)), collect);
        EXPECT_EQ(difference(collect.image, capture(scene, view, withShadows(size)).image), "");
    }
}

TEST(Shadows, MapsAreMadeAnewForAnotherClipVolume) {
    const Scene scene = crowdOfSquares();
    const PosedScene shown(scene, 0);
    GlRenderer renderer(sharedContext(), shown);
    const View view = testView(64, 48);
    CaptureSettings s = withShadows(200);
    for (const double offset : {-9.0, -3.2, -2.8}) {
        s.clip.half_spaces = {{{0, 0, -1}, -offset}};
        s.clip.keep_inside = false;
        CollectSink collect;
        renderer.capture(renderer.plan(view, s), collect);
        EXPECT_EQ(difference(collect.image, capture(scene, view, s).image), "") << offset;
    }
}

TEST(Shadows, TooLargeAMapIsAUsageError) {
    const Scene scene = crowdOfSquares();
    try {
        capture(scene, testView(8, 8), withShadows(1 << 20));
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
        EXPECT_EQ(error.where(), "`shadow_size` 1048576");
    }
}

TEST(Shadows, OfNothingAreNone) {
    SceneBuilder builder;
    EXPECT_EQ(capture(builder.scene(), testView(8, 8), withShadows(64)).image.fragments(), 0U);
    builder.rectangle(1, 1, -2, builder.lit(builder.material({1, 1, 1, 0.5F})));
    EXPECT_EQ(capture(builder.scene(), testView(8, 8), withShadows(64)).image.fragments(), 64U);
}

}  // namespace
}  // namespace peeler::test
