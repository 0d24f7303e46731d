// SPDX-License-Identifier: Apache-2.0
// Tests captures against analytic answers.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include <peeler/composite.h>
#include <peeler/error.h>
#include "core/capture/method.h"
#include "support/capture.h"
#include "support/method_names.h"

namespace peeler::test {
namespace {

class Capture : public testing::TestWithParam<std::string> {
  protected:
    CaptureSettings settings() const {
        CaptureSettings s;
        s.method = GetParam();
        return s;
    }
};

INSTANTIATE_TEST_SUITE_P(Methods, Capture, testing::ValuesIn(methodNames(true)),
                         [](const auto& row) {
                             std::string name(row.param);
                             for (char& c : name)
                                 if (c == '-') c = '_';
                             return name;
                         });

TEST_P(Capture, QuadsGiveTheirLayersDepthsAndColours) {
    SceneBuilder builder;
    constexpr int kQuads = 9;
    std::vector<glm::vec4> colors;
    std::vector<float> depths;
    // The quads are added from far to near, so that draw order is the reverse of depth order.
    for (int i = kQuads - 1; i >= 0; --i) {
        const float t = static_cast<float>(i) / kQuads;
        const float z = 0.7F + 3.3F * t * t;
        const glm::vec4 rgba(0.9F - 0.5F * t, 0.2F + 0.7F * t, t, 0.15F + 0.8F * t);
        builder.rectangle(10, 10, -z, builder.material(rgba));
        colors.insert(colors.begin(), rgba);
        depths.insert(depths.begin(), z);
    }
    const auto result = capture(builder.scene(), testView(67, 41), settings());
    ASSERT_EQ(result.plan.layers.size(), kQuads);
    EXPECT_EQ(result.plan.fragments_counted, 67U * 41U * kQuads);
    EXPECT_TRUE(result.plan.complete());
    const LayeredImage& image = result.image;
    for (std::size_t p = 0; p < image.window.pixels(); ++p) {
        ASSERT_EQ(image.count(p), kQuads);
        glm::dvec4 closed_form(0);
        for (std::size_t k = 0; k < kQuads; ++k) {
            const std::size_t f = image.offsets[p] + k;
            EXPECT_NEAR(image.z[f], depths[k], 1e-6 * depths[k]);
            const glm::vec4 premultiplied(glm::vec3(colors[k]) * colors[k].a, colors[k].a);
            for (int c = 0; c < 4; ++c)
                EXPECT_NEAR(color(image, f)[c], premultiplied[c], premultiplied[c] / 2048 + 1e-7);
            closed_form += (1 - closed_form.a) * glm::dvec4(premultiplied);
        }
        if (p % 97) continue;
        CompositeImage flat;
        compositeOver(image, {}, flat);
        for (int c = 0; c < 4; ++c)
            EXPECT_NEAR(flat.rgba[p][static_cast<std::size_t>(c)], closed_form[c], 1e-3);
    }
}

TEST_P(Capture, TiltedPlaneHasTheDepthOfItsPlane) {
    SceneBuilder builder;
    const auto at = [](float x, float y) { return glm::vec3(x, y, -3 + 0.8F * x - 0.3F * y); };
    builder.quad(at(-2, -2), at(2, -2), at(2, 2), at(-2, 2), builder.material({1, 1, 1, 0.5F}));
    const View view = testView(128, 96);
    const auto result = capture(builder.scene(), view, settings());
    // GPUs snap vertices to a grid of 1/256 pixel, with an error of up to half a grid step along
    // each axis. The error of 1/z is (0.8 + 0.3) / 3 times half a step in units of the image plane.
    const double step = 2 * view.projection.half_width / view.width / 512;
    const double snapped = sharedContext().device().software ? 0 : 1.1 / 3 * step;
    std::size_t covered = 0;
    for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
            const std::size_t p = result.image.pixelIndex(x, y);
            if (result.image.count(p) == 0) continue;
            ASSERT_EQ(result.image.count(p), 1U);
            ++covered;
            const double u = (x + 0.5) / view.width * 2 - 1, v = 1 - (y + 0.5) / view.height * 2;
            const double dx = u * view.projection.half_width, dy = v * view.projection.half_height;
            const double z = 3 / (1 + 0.8 * dx - 0.3 * dy);
            EXPECT_NEAR(result.image.z[result.image.offsets[p]], z, 1e-6 * z + snapped * z * z);
        }
    }
    EXPECT_GT(covered, 5000U);
}

TEST_P(Capture, CoincidentQuadsAreLayersInDrawOrder) {
    SceneBuilder builder;
    const glm::vec4 colors[] = {{0, 1, 0, 0.5F}, {1, 0, 0, 0.5F}, {0, 0, 1, 0.5F}};
    for (const glm::vec4& each : colors)
        builder.rectangle(1, 1, -2, builder.material(each));
    const auto result = capture(builder.scene(), testView(32, 32), settings());
    ASSERT_EQ(result.plan.layers.size(), 3U);
    const LayeredImage& image = result.image;
    const std::size_t f = image.offsets[image.pixelIndex(16, 16)];
    EXPECT_EQ(image.z[f], image.z[f + 1]);
    EXPECT_EQ(image.z[f], image.z[f + 2]);
    for (std::size_t k = 0; k < 3; ++k)
        EXPECT_EQ(color(image, f + k), 0.5F * glm::vec4(glm::vec3(colors[k]), 1)) << k;
}

TEST_P(Capture, WhatIsBehindTheCameraOrBeyondTheFarPlaneIsNoFragment) {
    SceneBuilder builder;
    const int grey = builder.material({0.5F, 0.5F, 0.5F, 1});
    builder.rectangle(9, 9, 1, grey);       // behind the camera
    builder.rectangle(9, 9, -0.05F, grey);  // in front of the near plane
    builder.rectangle(9, 9, -3, grey);
    builder.rectangle(9, 9, -50, grey);  // beyond the far plane
    View view = testView(16, 16);
    view.projection.far = 40;
    const auto result = capture(builder.scene(), view, settings());
    EXPECT_EQ(result.plan.layers.size(), 1U);
    EXPECT_NEAR(result.image.z[0], 3, 3e-6);
}

TEST_P(Capture, OrthographicDepthIsDistanceAlongTheAxis) {
    SceneBuilder builder;
    const int grey = builder.material({0.5F, 0.5F, 0.5F, 1});
    builder.rectangle(3, 3, -3, grey);
    builder.rectangle(3, 3, -7.25F, grey);
    View view = testView(20, 10);
    view.projection.perspective = false;
    view.projection.half_width = 2;
    view.projection.half_height = 1;
    view.projection.near = -1;
    view.projection.far = 10;
    const auto result = capture(builder.scene(), view, settings());
    ASSERT_EQ(result.plan.layers.size(), 2U);
    EXPECT_EQ(result.plan.fragments_counted, 400U);
    EXPECT_NEAR(result.image.z[0], 3, 3e-6);
    EXPECT_NEAR(result.image.z[1], 7.25, 7e-6);
}

TEST_P(Capture, TransparentMeansAlphaAboveZeroAndMaskTheCutoff) {
    SceneBuilder builder;
    builder.rectangle(9, 9, -1, builder.material({1, 1, 1, 0}));
    const int masked = builder.material({1, 1, 1, 0.4F}, AlphaMode::kMask);
    builder.rectangle(9, 9, -2, masked);
    builder.scene().materials[static_cast<std::size_t>(masked)].alpha_cutoff = 0.5F;
    const int kept = builder.material({1, 1, 1, 0.5F}, AlphaMode::kMask);
    builder.rectangle(9, 9, -3, kept);
    builder.rectangle(9, 9, -4, builder.material({1, 1, 1, 1e-3F}));
    const auto result = capture(builder.scene(), testView(8, 8), settings());
    ASSERT_EQ(result.plan.layers.size(), 2U);
    EXPECT_EQ(color(result.image, 0).a, 1);  // a masked fragment that passes the cutoff is opaque
    EXPECT_NEAR(color(result.image, 1).a, 1e-3, 1e-6);
}

TEST_P(Capture, VertexColourAlphaIsTestedPerFragment) {
    SceneBuilder builder;
    builder.rectangle(1, 1, -2, builder.material({1, 1, 1, 1}, AlphaMode::kMask));
    auto& primitive = builder.scene().meshes[0].primitives[0];
    for (const auto& p : primitive.positions)
        primitive.colors.push_back({1, 1, 1, p.x > 0 ? 1 : 0});
    // Alpha runs from 0 at the left edge to 1 at the right: the cutoff 0.5 keeps the right half.
    const auto result = capture(builder.scene(), testView(64, 64), settings());
    EXPECT_EQ(result.plan.fragments_counted, 64U * 32U);
    EXPECT_EQ(result.plan.layers[0].data_window, (Window{32, 0, 64, 64}));
}

TEST_P(Capture, SurfacesVisibleStopsAtTheNearestOpaqueOne) {
    SceneBuilder builder;
    const int glass = builder.material({0.2F, 0.4F, 0.6F, 0.5F});
    const int wall = builder.material({0.5F, 0.5F, 0.5F, 1}, AlphaMode::kOpaque);
    builder.rectangle(9, 9, -1, glass);
    // Coincides with the wall and is drawn before it, so it is visible.
    builder.rectangle(9, 9, -2, glass);
    builder.rectangle(9, 9, -2, wall);
    // Coincides with the wall and is drawn after it, so it is hidden.
    builder.rectangle(9, 9, -2, glass);
    builder.rectangle(9, 9, -3, wall);
    builder.rectangle(9, 9, -4, glass);
    CaptureSettings s = settings();
    s.surfaces = Surfaces::kVisible;
    EXPECT_EQ(capture(builder.scene(), testView(8, 8), s).plan.layers.size(), 3U);
    s.surfaces = Surfaces::kTransparent;
    EXPECT_EQ(capture(builder.scene(), testView(8, 8), s).plan.layers.size(), 2U);
    s.surfaces = Surfaces::kAll;
    EXPECT_EQ(capture(builder.scene(), testView(8, 8), s).plan.layers.size(), 6U);
}

TEST_P(Capture, GlassAloneHidesNothing) {
    SceneBuilder builder;
    const int glass = builder.material({0.2F, 0.4F, 0.6F, 0.5F});
    builder.rectangle(0.9F, 0.7F, -2, glass);
    builder.triangles({{-1.13F, -0.9F, -1}, {0.7F, -0.31F, -4}, {0.2F, 0.95F, -3}}, glass);
    CaptureSettings s = settings();
    const Captured all = capture(builder.scene(), testView(32, 24), s);
    for (const Surfaces surfaces : {Surfaces::kVisible, Surfaces::kTransparent}) {
        s.surfaces = surfaces;
        const Captured found = capture(builder.scene(), testView(32, 24), s);
        EXPECT_EQ(difference(found.image, all.image), "");
    }
}

TEST_P(Capture, FacesFollowTheMaterialOrTheOption) {
    SceneBuilder builder;
    const int single = builder.material({1, 1, 1, 1}, AlphaMode::kBlend, false);
    builder.rectangle(9, 9, -1, single);  // faces the camera
    // faces away from the camera
    builder.quad({-9, -9, -2}, {-9, 9, -2}, {9, 9, -2}, {9, -9, -2}, single);
    const glm::dmat4 mirror(glm::dvec4(-1, 0, 0, 0), glm::dvec4(0, 1, 0, 0), glm::dvec4(0, 0, 1, 0),
                            glm::dvec4(0, 0, -2, 1));
    // The negative scale flips the winding, but the instance still faces the camera.
    builder.instance(0, mirror);
    const std::pair<Faces, std::uint64_t> expected[] = {
        {Faces::kGltf, 2}, {Faces::kFront, 2}, {Faces::kBack, 1}, {Faces::kBoth, 3}};
    for (const auto& [faces, layers] : expected) {
        CaptureSettings s = settings();
        s.faces = faces;
        EXPECT_EQ(capture(builder.scene(), testView(8, 8), s).plan.layers.size(), layers);
    }
}

TEST_P(Capture, LayerLimitKeepsTheNearestAndCountsTheRest) {
    SceneBuilder builder;
    for (int i = 0; i < 6; ++i)
        builder.rectangle(9, 9, -6.0F + static_cast<float>(i), builder.material({1, 1, 1, 0.5F}));
    CaptureSettings s = settings();
    s.max_layers = 4;
    const auto result = capture(builder.scene(), testView(10, 10), s);
    EXPECT_EQ(result.plan.layers.size(), 4U);
    EXPECT_EQ(result.plan.fragments_counted, 600U);
    EXPECT_EQ(result.plan.fragments_stored, 400U);
    EXPECT_FALSE(result.plan.complete());
    EXPECT_EQ(result.image.fragments(), 400U);
    EXPECT_NEAR(result.image.z[0], 1, 1e-6);
    EXPECT_NEAR(result.image.z[3], 4, 4e-6);
}

TEST_P(Capture, TwoHundredLayersSurvive) {
    SceneBuilder builder;
    const int pane = builder.material({0.3F, 0.6F, 0.9F, 0.1F});
    for (int i = 0; i < 200; ++i)
        builder.rectangle(0.9F, 0.9F, -2 - 0.001F * static_cast<float>(i), pane);
    const auto result = capture(builder.scene(), testView(40, 40), settings());
    ASSERT_EQ(result.plan.layers.size(), 200U);
    const LayeredImage& image = result.image;
    for (std::size_t p = 0; p < image.window.pixels(); ++p)
        for (std::uint32_t f = image.offsets[p]; f + 1 < image.offsets[p + 1]; ++f)
            EXPECT_LT(image.z[f], image.z[f + 1]);
    const std::map<std::string_view, int> published = {{"a-buffer", 1},   {"front-to-back", 200},
                                                       {"two-pass", 400}, {"back-to-front", 200},
                                                       {"dual", 101},     {"dual-max", 101}};
    EXPECT_EQ(result.report.passes, published.at(GetParam()));
}

TEST_P(Capture, AnEmptySceneHasNoLayers) {
    const SceneBuilder builder;
    const auto result = capture(builder.scene(), testView(8, 8), settings());
    EXPECT_TRUE(result.plan.layers.empty());
    EXPECT_EQ(result.image.offsets.size(), 65U);
    EXPECT_EQ(result.image.fragments(), 0U);
}

TEST_P(Capture, AnUnknownMethodIsAUsageError) {
    CaptureSettings s;
    s.method = "guess";
    try {
        capture(SceneBuilder().scene(), testView(8, 8), s);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUsage);
    }
}

}  // namespace
}  // namespace peeler::test
