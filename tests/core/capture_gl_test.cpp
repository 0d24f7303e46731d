// SPDX-License-Identifier: Apache-2.0
// Captures whose answer is known on paper.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <thread>

#include "core/bands.h"
#include "core/composite.h"
#include "core/error.h"
#include "core/peel/method.h"
#include "support/capture.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

class Capture : public testing::TestWithParam<std::string_view> {
  protected:
    CaptureSettings settings() const {
        CaptureSettings s;
        s.method = GetParam();
        return s;
    }
};

std::vector<std::string_view> methodNames() {
    std::vector<std::string_view> names;
    for (const auto& method : peelMethods())
        names.push_back(method.name);
    return names;
}

INSTANTIATE_TEST_SUITE_P(Methods, Capture, testing::ValuesIn(methodNames()), [](const auto& row) {
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
    // Added far to near, so that draw order is the opposite of depth order.
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
    // z = -3 + 0.8 x - 0.3 y
    SceneBuilder builder;
    const auto at = [](float x, float y) { return glm::vec3(x, y, -3 + 0.8F * x - 0.3F * y); };
    builder.quad(at(-2, -2), at(2, -2), at(2, 2), at(-2, 2), builder.material({1, 1, 1, 0.5F}));
    const View view = testView(128, 96);
    const auto result = capture(builder.scene(), view, settings());
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
            EXPECT_NEAR(result.image.z[result.image.offsets[p]], z, 1e-6 * z);
        }
    }
    EXPECT_GT(covered, 5000U);
}

TEST_P(Capture, CoincidentQuadsAreTwoLayersInDrawOrder) {
    SceneBuilder builder;
    const int red = builder.material({1, 0, 0, 0.5F}), green = builder.material({0, 1, 0, 0.5F});
    builder.rectangle(1, 1, -2, green);
    builder.rectangle(1, 1, -2, red);
    builder.rectangle(1, 1, -2, green);
    const auto result = capture(builder.scene(), testView(32, 32), settings());
    ASSERT_EQ(result.plan.layers.size(), 3U);
    const LayeredImage& image = result.image;
    const std::size_t f = image.offsets[image.pixelIndex(16, 16)];
    EXPECT_EQ(image.z[f], image.z[f + 1]);
    EXPECT_EQ(image.z[f], image.z[f + 2]);
    EXPECT_EQ(color(image, f).g, 0.5F);
    EXPECT_EQ(color(image, f + 1).r, 0.5F);
    EXPECT_EQ(color(image, f + 2).g, 0.5F);
}

TEST_P(Capture, WhatIsBehindTheCameraOrBeyondTheFarPlaneIsNoFragment) {
    SceneBuilder builder;
    const int grey = builder.material({0.5F, 0.5F, 0.5F, 1});
    builder.rectangle(9, 9, 1, grey);       // behind
    builder.rectangle(9, 9, -0.05F, grey);  // nearer than the near plane
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
    EXPECT_EQ(color(result.image, 0).a, 1);  // a mask that passes is opaque
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
    builder.rectangle(9, 9, -2, glass);  // coincides with the wall and is drawn before it
    builder.rectangle(9, 9, -2, wall);
    builder.rectangle(9, 9, -2, glass);  // … and after it: hidden
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

TEST_P(Capture, FacesFollowTheMaterialOrTheOption) {
    SceneBuilder builder;
    const int single = builder.material({1, 1, 1, 1}, AlphaMode::kBlend, false);
    builder.rectangle(9, 9, -1, single);                                       // faces the camera
    builder.quad({-9, -9, -2}, {-9, 9, -2}, {9, 9, -2}, {9, -9, -2}, single);  // faces away
    const glm::dmat4 mirror(glm::dvec4(-1, 0, 0, 0), glm::dvec4(0, 1, 0, 0), glm::dvec4(0, 0, 1, 0),
                            glm::dvec4(0, 0, -2, 1));
    builder.instance(0, mirror);  // negative scale turns the winding, and still faces the camera
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
    EXPECT_EQ(result.report.passes, GetParam() == "front-to-back" ? 200 : 1);
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

/// Scenes that have broken peelers before.
struct HardScene {
    const char* name;
    Scene scene;
};

std::vector<HardScene> hardScenes() {
    std::vector<HardScene> scenes;
    std::mt19937 random(20011);  // the seed is fixed: a failure is repeatable
    std::uniform_real_distribution<float> unit(0, 1);
    const auto point = [&](float size, float z) {
        return glm::vec3((unit(random) - 0.5F) * size, (unit(random) - 0.5F) * size,
                         z + (unit(random) - 0.5F) * size);
    };
    const auto soup = [&](int count, float size, float z) {
        SceneBuilder builder;
        for (int i = 0; i < count; ++i) {
            const int m =
                builder.material({unit(random), unit(random), unit(random), unit(random)});
            builder.triangles({point(size, z), point(size, z), point(size, z)}, m);
        }
        return builder.scene();
    };
    scenes.push_back({"interpenetrating triangles", soup(150, 3, -4)});
    scenes.push_back({"across the near plane and behind the camera", soup(100, 6, 0)});
    {
        SceneBuilder builder;  // one mesh, drawn three times in the same place
        builder.scene() = soup(40, 2, -3);
        for (int mesh = 0; mesh < 40; ++mesh)
            for (int copy = 0; copy < 2; ++copy)
                builder.instance(mesh, glm::dmat4(1));
        scenes.push_back({"duplicated mesh", builder.scene()});
    }
    {
        SceneBuilder builder;  // slivers seen nearly edge-on
        for (int i = 0; i < 60; ++i) {
            const float y = 0.001F * static_cast<float>(i - 30);
            builder.quad({-1, y, -1}, {1, y, -1}, {1, y * 1.01F, -9}, {-1, y * 1.01F, -9},
                         builder.material({0.4F, 0.5F, 0.6F, 0.3F}));
        }
        scenes.push_back({"grazing quads", builder.scene()});
    }
    return scenes;
}

TEST(Methods, AgreeBitForBitOnHardScenes) {
    for (const auto& [name, scene] : hardScenes()) {
        const View view = testView(160, 120);
        const auto reference = capture(scene, view);
        EXPECT_GT(reference.image.fragments(), 1000U) << name;
        for (const auto& method : peelMethods()) {
            CaptureSettings s;
            s.method = method.name;
            EXPECT_EQ(difference(reference.image, capture(scene, view, s).image), "")
                << name << ", " << method.name;
        }
    }
}

TEST(Backends, AgreeBitForBitOnHardScenes) {
    if (!sharedContext().device().software) GTEST_SKIP() << "a GPU rounds as it likes";
    const std::string other = testBackend() == "egl" ? "osmesa" : "egl";
    const View view = testView(160, 120);
    for (const auto& [name, scene] : hardScenes()) {
        const auto here = capture(scene, view);
        LayeredImage there;
        // A context belongs to the thread that makes it, so the other backend's gets one of its
        // own.
        std::thread([&, &shown = scene] {
            const auto context = gl::createContext({.backend = other});
            there = capture(shown, view, {}, *context).image;
        }).join();
        EXPECT_EQ(difference(here.image, there), "") << name << " on " << other;
    }
}

TEST(Bands, DoNotChangeTheResult) {
    const auto scenes = hardScenes();
    const View view = testView(320, 240);
    const auto whole = capture(scenes[0].scene, view);
    ASSERT_EQ(whole.bands.size(), 1U);
    for (const auto& method : peelMethods()) {
        CaptureSettings small;
        small.method = method.name;
        small.band_bytes = 1 << 20;
        const auto cut = capture(scenes[0].scene, view, small);
        EXPECT_GT(cut.bands.size(), 3U);
        EXPECT_EQ(difference(whole.image, cut.image), "") << method.name;
    }
    View cropped = view;
    cropped.crop = {13, 57, 301, 199};
    const auto part = capture(scenes[0].scene, cropped);
    for (int y = cropped.crop.y0; y < cropped.crop.y1; ++y) {
        for (int x = cropped.crop.x0; x < cropped.crop.x1; ++x) {
            const std::size_t a = whole.image.pixelIndex(x, y), b = part.image.pixelIndex(x, y);
            ASSERT_EQ(whole.image.count(a), part.image.count(b));
            for (std::uint32_t k = 0; k < whole.image.count(a); ++k) {
                ASSERT_EQ(whole.image.z[whole.image.offsets[a] + k],
                          part.image.z[part.image.offsets[b] + k]);
            }
        }
    }
}

TEST(Bands, MethodsAndSurfacesAgreeAcrossRasterTiles) {
    auto scenes = hardScenes();
    Scene& scene = scenes[0].scene;
    for (std::size_t i = 0; i < scene.materials.size(); i += 3)
        scene.materials[i].alpha_mode = AlphaMode::kOpaque;
    View view = testView(4200, 150);
    view.projection.half_width = 0.5;  // all of it, stretched over two tiles
    view.crop = {3900, 10, 4200, 140};
    for (const Surfaces surfaces : {Surfaces::kAll, Surfaces::kVisible, Surfaces::kTransparent}) {
        CaptureSettings s;
        s.surfaces = surfaces;
        const auto whole = capture(scene, view, s);
        for (const auto& method : peelMethods()) {
            s.method = method.name;
            s.band_bytes = 1 << 19;
            const auto cut = capture(scene, view, s);
            EXPECT_GT(cut.bands.size(), 3U);
            EXPECT_EQ(difference(whole.image, cut.image), "") << method.name;
            s.max_layers = 2;
            const auto nearest = capture(scene, view, s);
            for (std::size_t p = 0; p < view.crop.pixels(); ++p) {
                ASSERT_EQ(nearest.image.count(p), std::min(2U, whole.image.count(p)));
                for (std::uint32_t k = 0; k < nearest.image.count(p); ++k) {
                    ASSERT_EQ(nearest.image.z[nearest.image.offsets[p] + k],
                              whole.image.z[whole.image.offsets[p] + k]);
                }
            }
            s.max_layers = 0;
        }
    }
}

/// A quad of 2x2 at z = -2 that looks at the camera, with UVs and, if asked for, normals and
/// tangents. Its normal map leans to +X, or the normals themselves do.
Scene leaningQuad(bool mapped, bool normals, bool tangents) {
    SceneBuilder builder;
    Scene& scene = builder.scene();
    const int lit = builder.material({0.8F, 0.6F, 0.4F, 1}, AlphaMode::kOpaque);
    builder.rectangle(1, 1, -2, lit);
    Material& material = scene.materials[static_cast<std::size_t>(lit)];
    material.unlit = false;
    material.metallic = 0;
    material.roughness = 0.5F;
    const glm::vec3 texel = glm::vec3(218, 150, 200) / 255.0F * 2.0F - 1.0F;
    Primitive& p = scene.meshes[0].primitives[0];
    for (const glm::vec3& position : p.positions) {
        p.texcoords[0].push_back({position.x / 2 + 0.5F, 0.5F - position.y / 2});
        if (normals) p.normals.push_back(mapped ? glm::vec3(0, 0, 1) : glm::normalize(texel));
        if (tangents) p.tangents.push_back({1, 0, 0, 1});
    }
    if (mapped) {
        scene.images.push_back({"leaning", 1, 1, {218, 150, 200, 255}});
        material.normal_texture.image = 0;
    }
    return scene;
}

TEST(Shading, NormalMapsTurnWithTheSurface) {
    // Turned around, mirrored, scaled: a normal map must look like the geometry it stands for.
    const auto scaled = [](double x, double y, double z, double back) {
        glm::dmat4 m(1);
        m[0][0] = x, m[1][1] = y, m[2][2] = z, m[3][2] = back;
        return m;
    };
    const std::pair<const char*, glm::dmat4> placements[] = {
        {"as it is", scaled(1, 1, 1, 0)},
        {"large", scaled(50, 50, 50, 48)},
        {"small", scaled(0.01, 0.01, 0.01, -0.18)},
        {"mirrored", scaled(-1, 1, 1, 0)},
        {"turned around", scaled(-1, 1, -1, -4)},
        {"turned around and mirrored", scaled(1, 1, -1, -4)}};
    for (const auto& [name, placement] : placements) {
        const auto seen = [&, &m = placement](bool mapped, bool normals, bool tangents) {
            Scene scene = leaningQuad(mapped, normals, tangents);
            scene.nodes[0].local = m;
            const auto result = capture(scene, testView(9, 9));
            const std::size_t center = result.image.pixelIndex(4, 4);
            EXPECT_EQ(result.image.count(center), 1U) << name;
            return color(result.image, result.image.offsets[center]);
        };
        const glm::vec4 expected = seen(false, true, false);
        for (const auto& [normals, tangents] :
             {std::pair{true, true}, {true, false}, {false, false}}) {
            const glm::vec4 mapped = seen(true, normals, tangents);
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(mapped[c], expected[c], 2e-3 * expected[c])
                    << name << ", normals " << normals << ", tangents " << tangents;
        }
    }
}

TEST(Shading, NoColourIsBeyondAHalf) {
    SceneBuilder builder;
    builder.rectangle(1, 1, -2, builder.material({1, 1, 1, 1}));
    auto& primitive = builder.scene().meshes[0].primitives[0];
    primitive.colors.assign(primitive.positions.size(), {1e30F, -1e30F, 0.5F, 1});
    for (const PixelType type : {PixelType::kHalf, PixelType::kFloat}) {
        CaptureSettings s;
        s.color_type = type;
        const auto result = capture(builder.scene(), testView(4, 4), s);
        EXPECT_EQ(color(result.image, 0), glm::vec4(65504, -65504, 0.5F, 1));
    }
}

TEST(Bands, LeaveRoomForWhatTheSinksHold) {
    struct LargeSink : CollectSink {
        SinkMemory memory() const override { return {0, bytes}; }
        std::uint64_t bytes = 0;
    } sink;
    SceneBuilder builder;
    builder.rectangle(1, 1, -2, builder.material({1, 1, 1, 0.5F}));
    const SceneContents shown = contents(builder.scene(), 0);
    Renderer renderer(sharedContext(), builder.scene(), shown);
    CaptureSettings s;
    s.memory = residentBytes() + (512ULL << 20);
    renderer.plan(testView(64, 64), s);
    Sink* sinks[] = {&sink};
    EXPECT_NO_THROW(renderer.capture(sinks));
    sink.bytes = 512ULL << 20;
    try {
        renderer.capture(sinks);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kMemory);
    }
}

}  // namespace
}  // namespace peeler::test
