// SPDX-License-Identifier: Apache-2.0
// Tests the channels of fragments against analytic answers and against each other.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>
#include <set>

#include <peeler/channels.h>
#include "core/capture/method.h"
#include "core/scene/posed_scene.h"
#include "support/capture.h"

namespace peeler::test {
namespace {

std::vector<Channel> allChannels() {
    std::vector<Channel> channels;
    for (const ChannelInfo& info : channelTable())
        channels.push_back(info.channel);
    return channels;
}

CaptureSettings inFloat(std::vector<Channel> channels) {
    CaptureSettings settings;
    settings.color_type = PixelType::kFloat;
    settings.channels = std::move(channels);
    return settings;
}

/// Reader of one channel of an image.
class Reader {
  public:
    Reader(const LayeredImage& image, Channel channel) {
        const std::string first(infoOf(channel).components.front());
        for (const FragmentArray& array : image.extra)
            if (array.channels.front() == first) array_ = &array;
    }
    bool found() const { return array_ != nullptr; }
    /// Returns the value of a fragment; missing components are 0.
    glm::dvec4 operator()(std::size_t fragment) const {
        glm::dvec4 value(0);
        for (std::size_t c = 0; c < array_->components(); ++c)
            value[static_cast<int>(c)] =
                static_cast<double>(array_->as<float>()[fragment * array_->components() + c]);
        return value;
    }
    std::uint32_t id(std::size_t fragment, std::size_t component) const {
        return array_->as<std::uint32_t>()[fragment * array_->components() + component];
    }

  private:
    const FragmentArray* array_ = nullptr;
};

/// Calls f(fragment, centre of its pixel) for every fragment.
template <class F>
void forEachFragment(const LayeredImage& image, F&& f) {
    for (int y = image.window.y0; y < image.window.y1; ++y) {
        for (int x = image.window.x0; x < image.window.x1; ++x) {
            const std::size_t p = image.pixelIndex(x, y);
            for (std::size_t k = image.offsets[p]; k < image.offsets[p + 1]; ++k)
                f(k, glm::dvec2(x + 0.5, y + 0.5));
        }
    }
}

double angle(const glm::dvec3& a, const glm::dvec3& b) {
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

TEST(Channels, OfASphere) {
    const glm::dvec3 center(0.2, -0.1, -3);
    const double radius = 1.1;
    SceneBuilder builder;
    builder.sphere(center, static_cast<float>(radius), builder.material({0.3F, 0.6F, 0.9F, 0.5F}));
    const auto result = capture(builder.scene(), testView(160, 120), inFloat(allChannels()));
    const LayeredImage& image = result.image;
    const Reader normal(image, Channel::kNormal), flat(image, Channel::kGeometricNormal),
        position(image, Channel::kPosition), uv(image, Channel::kUv),
        tangent(image, Channel::kTangent), distance(image, Channel::kDistance),
        facing(image, Channel::kFacing), base(image, Channel::kBaseColor);
    ASSERT_TRUE(normal.found() && flat.found() && position.found() && uv.found());
    std::size_t fronts = 0, backs = 0;
    forEachFragment(image, [&](std::size_t f, const glm::dvec2& pixel) {
        const glm::dvec3 p(position(f));
        const glm::dvec3 out = (p - center) / radius;
        // Positions lie on the facets of the sphere, which has 24 rows of 48 columns.
        const double half_facet = std::numbers::pi / 48;
        ASSERT_LE(glm::length(out), 1 + 1e-5);
        ASSERT_GE(glm::length(out), std::cos(half_facet) * std::cos(half_facet) - 1e-5);
        // Positions lie on the pixel's ray, at the fragment's Z.
        const glm::dvec2 slope = (pixel - glm::dvec2(80, 60)) / 60.0 * 0.5;
        ASSERT_NEAR(p.x / -p.z, slope.x, 1e-5);
        ASSERT_NEAR(p.y / -p.z, -slope.y, 1e-5);
        ASSERT_NEAR(-p.z, image.z[f], 1e-5);
        ASSERT_NEAR(distance(f).x, glm::length(p), 1e-5);

        // Each vertex normal points from the centre to its vertex. Positions and normals are
        // interpolated with the same weights, so every fragment's normal points from the centre,
        // too.
        const double side = glm::dot(glm::dvec3(flat(f)), out) > 0 ? 1 : -1;
        ASSERT_LE(angle(glm::dvec3(normal(f)), side * out), 2e-4);
        ASSERT_LE(angle(glm::dvec3(flat(f)), side * out), 2.5 * half_facet);
        ASSERT_NEAR(glm::length(glm::dvec3(flat(f))), 1, 1e-6);
        ASSERT_LT(glm::dot(glm::dvec3(flat(f)), p), 0) << "toward the viewer";
        ASSERT_EQ(facing(f).x, side);
        (side > 0 ? fronts : backs) += 1;

        const glm::dvec3 n = glm::normalize(out);
        const double polar = std::acos(n.y), longitude = std::atan2(n.x, n.z);
        if (std::sin(polar) > 0.5) {
            const double u = longitude / (2 * std::numbers::pi);
            const double turn = uv(f).x - u;
            ASSERT_NEAR(turn, std::round(turn), 3e-3);
            ASSERT_NEAR(uv(f).y, polar / std::numbers::pi, 2e-3);
            // Tangents point east along the parallels, on both sides of the surface. Up in the
            // texture is toward the north pole.
            const glm::dvec3 east(std::cos(longitude), 0, -std::sin(longitude));
            ASSERT_LE(angle(glm::dvec3(tangent(f)), east), 0.02);
            const glm::dvec3 up = tangent(f).w * glm::cross(side * n, glm::dvec3(tangent(f)));
            ASSERT_GT(up.y, 0);
        }
        ASSERT_LE(glm::distance(glm::dvec3(base(f)), glm::dvec3(0.3, 0.6, 0.9)), 1e-6);
    });
    EXPECT_GT(fronts, 4000U);
    EXPECT_GT(backs, 4000U);
}

TEST(Channels, BarycentricWeightsGiveThePosition) {
    SceneBuilder builder;
    const std::vector<glm::vec3> corners = {
        {-1.2F, -0.9F, -2}, {1.3F, -0.5F, -4}, {0.1F, 1.1F, -2.5F}};
    builder.triangles(corners, builder.material({1, 1, 1, 0.5F}));
    const auto result = capture(builder.scene(), testView(97, 83),
                                inFloat({Channel::kPosition, Channel::kBarycentric}));
    const Reader position(result.image, Channel::kPosition),
        weights(result.image, Channel::kBarycentric);
    ASSERT_GT(result.image.fragments(), 500U);
    for (std::size_t f = 0; f < result.image.fragments(); ++f) {
        const double u = weights(f).x, v = weights(f).y;
        ASSERT_TRUE(u >= 0 && v >= 0 && u + v <= 1 + 1e-7);
        const glm::dvec3 p = (1 - u - v) * glm::dvec3(corners[0]) + u * glm::dvec3(corners[1]) +
                             v * glm::dvec3(corners[2]);
        // The rasteriser snaps vertices to 1/256 pixel, which tilts the triangle's plane a little;
        // hence the tolerance.
        ASSERT_LE(glm::distance(p, glm::dvec3(position(f))), 1e-3);
    }
}

TEST(Channels, MotionOfAMovingQuad) {
    SceneBuilder builder;
    const int node = builder.rectangle(0.6F, 0.5F, -2, builder.material({1, 1, 1, 0.5F}));
    builder.rectangle(2, 2, -5, builder.material({1, 1, 1, 0.5F}));
    const Scene now = builder.scene();
    Scene later = now;
    const glm::dvec3 step(0.11, -0.07, -0.5);
    later.nodes[static_cast<std::size_t>(node)].local = glm::translate(glm::dmat4(1), step);
    const View view = testView(80, 60);
    for (const bool moving_camera : {false, true}) {
        View next_view = view;
        const glm::dvec3 camera_step(0.05, 0.02, 0.1);
        if (moving_camera) next_view.camera_to_world = glm::translate(glm::dmat4(1), camera_step);
        GlRenderer renderer(sharedContext(), PosedScene(now, 0));
        renderer.setNextFrame({PosedScene(later, 0), next_view});
        const auto result =
            capture(renderer, view, inFloat({Channel::kPosition, Channel::kMotion, Channel::kId}));
        const Reader position(result.image, Channel::kPosition),
            motion(result.image, Channel::kMotion), id(result.image, Channel::kId);
        std::size_t moved = 0;
        forEachFragment(result.image, [&](std::size_t f, const glm::dvec2& pixel) {
            glm::dvec3 p(position(f));
            const bool moves = id.id(f, 0) == static_cast<std::uint32_t>(node) + 1;
            if (moves) p += step;
            if (moving_camera) p -= camera_step;
            const glm::dvec2 expected(40 + p.x / -p.z / 0.5 * 30, 30 - p.y / -p.z / 0.5 * 30);
            ASSERT_NEAR(motion(f).x, expected.x - pixel.x, 2e-3);
            ASSERT_NEAR(motion(f).y, expected.y - pixel.y, 2e-3);
            if (!moves && !moving_camera) {
                ASSERT_EQ(motion(f), glm::dvec4(0));
            }
            moved += moves ? 1 : 0;
        });
        EXPECT_GT(moved, 300U);
    }
}

TEST(Channels, NothingMovesWithoutANextFrame) {
    SceneBuilder builder;
    builder.rectangle(1, 1, -2, builder.material({1, 1, 1, 0.5F}));
    const auto result = capture(builder.scene(), testView(16, 12), inFloat({Channel::kMotion}));
    const Reader motion(result.image, Channel::kMotion);
    ASSERT_GT(result.image.fragments(), 0U);
    for (std::size_t f = 0; f < result.image.fragments(); ++f)
        ASSERT_EQ(motion(f), glm::dvec4(0));
}

/// Returns a scene with two nodes. The first node has two instances, and its mesh has two
/// primitives with different materials.
Scene named() {
    SceneBuilder builder;
    const int red = builder.material({1, 0, 0, 0.5F}), blue = builder.material({0, 0, 1, 0.5F});
    builder.quad({-1, -1, 0}, {0, -1, 0}, {0, 1, 0}, {-1, 1, 0}, red);
    builder.quad({0, -1, 0}, {1, -1, 0}, {1, 1, 0}, {0, 1, 0}, blue);
    Scene& scene = builder.scene();
    scene.meshes[0].primitives.push_back(scene.meshes[1].primitives[0]);
    scene.nodes[0].instances = {glm::translate(glm::dmat4(1), {-1.2, 0, -4}),
                                glm::translate(glm::dmat4(1), {1.2, 0, -4})};
    scene.nodes[1].local = glm::translate(glm::dmat4(1), {0, 0, -3});
    return scene;
}

TEST(Channels, IdsNameNodeMaterialTriangleAndInstance) {
    const Scene scene = named();
    const auto result =
        capture(scene, testView(120, 60), inFloat({Channel::kPosition, Channel::kId}));
    const Reader position(result.image, Channel::kPosition), id(result.image, Channel::kId);
    std::set<std::uint32_t> instances, triangles;
    for (std::size_t f = 0; f < result.image.fragments(); ++f) {
        const glm::dvec3 p(position(f));
        const bool first = p.z < -3.5;
        ASSERT_EQ(id.id(f, 0), first ? 1U : 2U);
        const double center = first ? (p.x < 0 ? -1.2 : 1.2) : 0;
        const bool left = p.x < center;
        ASSERT_EQ(id.id(f, 3), first && p.x > 0 ? 2U : 1U);
        if (std::abs(p.x - center) < 0.01) continue;
        const Primitive& side = scene.meshes[left ? 0 : 1].primitives[0];
        ASSERT_EQ(id.id(f, 1), static_cast<std::uint32_t>(side.material) + 1);
        // In a quad a, b, c, d, triangle 1 (a, b, c) lies below the diagonal, and triangle 2 (a, c,
        // d) above. The triangles of the second primitive are 3 and 4.
        const double x = left ? p.x - center + 1 : p.x - center;
        if (std::abs((p.y + 1) / 2 - x) < 0.01) continue;
        const std::uint32_t in_quad = (p.y + 1) / 2 < x ? 1U : 2U;
        ASSERT_EQ(id.id(f, 2), in_quad + (first && !left ? 2U : 0U));
        triangles.insert(id.id(f, 2));
        instances.insert(id.id(f, 3));
    }
    EXPECT_EQ(instances, (std::set<std::uint32_t>{1, 2}));
    EXPECT_EQ(triangles, (std::set<std::uint32_t>{1, 2, 3, 4}));
}

TEST(Channels, StripsAndFansFaceAsTheyAreDrawn) {
    for (const Topology topology : {Topology::kTriangleStrip, Topology::kTriangleFan}) {
        SceneBuilder builder;
        const int material = builder.material({1, 1, 1, 0.5F});
        builder.triangles({{-1, -1, -3}, {1, -1, -3}, {-1, 1, -3}, {1, 1, -3}}, material);
        Primitive& p = builder.scene().meshes[0].primitives[0];
        p.topology = topology;
        if (topology == Topology::kTriangleFan) p.indices = {0, 1, 3, 2};
        for (const Faces faces : {Faces::kFront, Faces::kBack}) {
            CaptureSettings settings = inFloat(
                {Channel::kPosition, Channel::kFacing, Channel::kBarycentric, Channel::kId});
            settings.faces = faces;
            const auto result = capture(builder.scene(), testView(40, 40), settings);
            const Reader facing(result.image, Channel::kFacing);
            EXPECT_EQ(result.image.fragments() > 0, faces == Faces::kFront);
            for (std::size_t f = 0; f < result.image.fragments(); ++f)
                ASSERT_EQ(facing(f).x, 1);
        }
    }
}

TEST(Channels, MirroredInstancesKeepTheirFronts) {
    SceneBuilder builder;
    builder.sphere({0, 0, 0}, 1, builder.material({1, 1, 1, 0.5F}));
    builder.scene().nodes[0].local =
        glm::scale(glm::translate(glm::dmat4(1), {0, 0, -4}), glm::dvec3(-1, 1, 1));
    const auto result = capture(builder.scene(), testView(60, 60),
                                inFloat({Channel::kNormal, Channel::kFacing, Channel::kPosition}));
    const Reader normal(result.image, Channel::kNormal), facing(result.image, Channel::kFacing),
        position(result.image, Channel::kPosition);
    ASSERT_GT(result.image.fragments(), 500U);
    for (std::size_t f = 0; f < result.image.fragments(); ++f) {
        const glm::dvec3 out = glm::dvec3(position(f)) - glm::dvec3(0, 0, -4);
        const double toward = -glm::dot(out, glm::normalize(glm::dvec3(position(f))));
        // At the silhouette, the facets differ from the sphere.
        if (std::abs(toward) < 0.1) continue;
        ASSERT_EQ(facing(f).x, toward > 0 ? 1 : -1) << "fragment " << f;
        ASSERT_GT(glm::dot(glm::dvec3(normal(f)), facing(f).x * out), 0.9);
    }
}

TEST(Channels, LinesAndPointsFaceTheCamera) {
    SceneBuilder builder;
    const int material = builder.material({1, 1, 1, 0.5F});
    builder.triangles({{-1, -0.5F, -3}, {1, 0.7F, -4}}, material);
    builder.scene().meshes[0].primitives[0].topology = Topology::kLines;
    const auto result = capture(builder.scene(), testView(80, 60),
                                inFloat({Channel::kGeometricNormal, Channel::kPosition,
                                         Channel::kFacing, Channel::kBarycentric}));
    const Reader normal(result.image, Channel::kGeometricNormal),
        position(result.image, Channel::kPosition), weights(result.image, Channel::kBarycentric);
    ASSERT_GT(result.image.fragments(), 10U);
    for (std::size_t f = 0; f < result.image.fragments(); ++f) {
        const glm::dvec3 p(position(f));
        ASSERT_LE(angle(glm::dvec3(normal(f)), -p), 1e-5);
        const glm::dvec3 on_line =
            glm::mix(glm::dvec3(-1, -0.5, -3), glm::dvec3(1, 0.7, -4), weights(f).x);
        ASSERT_LE(glm::distance(on_line, p), 0.05);
        ASSERT_EQ(weights(f).y, 0);
    }
}

TEST(Channels, MaterialsSpeakForThemselvesWhateverTheLight) {
    SceneBuilder builder;
    const int index = builder.lit(builder.material({0.2F, 0.4F, 0.8F, 0.5F}));
    Material& material = builder.scene().materials[static_cast<std::size_t>(index)];
    material.metallic = 0.25F;
    material.roughness = 0.75F;
    material.emissive = {0.5F, 2, 0.125F};
    builder.rectangle(5, 5, -2, index);
    for (const Shading shading : {Shading::kPbr, Shading::kUnlit}) {
        CaptureSettings settings =
            inFloat({Channel::kBaseColor, Channel::kEmissive, Channel::kRoughnessMetallic});
        settings.shading = shading;
        const auto result = capture(builder.scene(), testView(16, 16), settings);
        const Reader base(result.image, Channel::kBaseColor),
            emissive(result.image, Channel::kEmissive),
            rough(result.image, Channel::kRoughnessMetallic);
        ASSERT_EQ(result.image.fragments(), 256U);
        for (std::size_t f = 0; f < 256; ++f) {
            ASSERT_LE(glm::distance(base(f), glm::dvec4(0.2, 0.4, 0.8, 0)), 1e-6);
            ASSERT_EQ(emissive(f), glm::dvec4(0.5, 2, 0.125, 0));
            ASSERT_EQ(rough(f), glm::dvec4(0.75, 0.25, 0, 0));
        }
    }
}

/// Returns a scene that is hard for channels: instances, strips, coincident surfaces.
Scene mixed() {
    Scene scene = named();
    SceneBuilder builder;
    const int lit = builder.lit(builder.material({0.7F, 0.5F, 0.2F, 0.6F}));
    builder.sphere({0, 0, -3.2F}, 0.8F, lit);
    builder.sphere({0, 0, -3.2F}, 0.8F, lit);
    scene.materials.insert(scene.materials.begin() + 2, builder.scene().materials[0]);
    for (const Mesh& mesh : builder.scene().meshes) {
        Node node;
        node.mesh = static_cast<int>(scene.meshes.size());
        scene.scenes[0].roots.push_back(static_cast<int>(scene.nodes.size()));
        scene.nodes.push_back(node);
        scene.meshes.push_back(mesh);
        scene.meshes.back().primitives[0].material = 2;
    }
    return scene;
}

TEST(Channels, AreTheSameWhateverTheMethod) {
    const Scene scene = mixed();
    const View view = testView(120, 90);
    for (const Surfaces surfaces : {Surfaces::kAll, Surfaces::kVisible}) {
        CaptureSettings settings;
        settings.channels = allChannels();
        settings.surfaces = surfaces;
        const auto expected = capture(scene, view, settings);
        ASSERT_EQ(expected.image.extra.size(), allChannels().size());
        for (const MethodInfo& method : peelMethods()) {
            if (!method.exact()) continue;
            settings.method = method.name;
            const auto found = capture(scene, view, settings);
            EXPECT_EQ(difference(found.image, expected.image), "") << method.name;
        }
    }
}

TEST(Channels, OfFewLayersAreThoseOfAll) {
    const Scene scene = mixed();
    CaptureSettings settings;
    settings.channels = allChannels();
    LayeredImage all = capture(scene, testView(120, 90), settings).image;
    settings.max_layers = 2;
    for (const char* method : {"a-buffer", "front-to-back", "dual"}) {
        settings.method = method;
        const LayeredImage few = capture(scene, testView(120, 90), settings).image;
        std::size_t compared = 0;
        for (std::size_t p = 0; p < few.window.pixels(); ++p) {
            for (std::uint32_t k = 0; k < few.count(p); ++k) {
                for (std::size_t i = 0; i < few.extra.size(); ++i) {
                    const std::size_t stride = few.extra[i].stride();
                    ASSERT_EQ(std::memcmp(few.extra[i].data.data() + (few.offsets[p] + k) * stride,
                                          all.extra[i].data.data() + (all.offsets[p] + k) * stride,
                                          stride),
                              0);
                    ++compared;
                }
            }
        }
        EXPECT_GT(compared, 10000U);
    }
}

TEST(Channels, DoNotDependOnBandsOrCrops) {
    const Scene scene = mixed();
    CaptureSettings settings;
    settings.channels = allChannels();
    const View view = testView(120, 90);
    const auto whole = capture(scene, view, settings);
    ASSERT_EQ(whole.bands.size(), 1U);
    settings.band_bytes = 200'000;
    const auto banded = capture(scene, view, settings);
    ASSERT_GT(banded.bands.size(), 3U);
    EXPECT_EQ(difference(banded.image, whole.image), "");
}

TEST(Channels, OfMergedSamplesAreThoseOfTheNearestSample) {
    SceneBuilder builder;
    // The quad is tilted, so that every sample has a different Z.
    builder.quad({-1, -1, -2}, {1, -1, -2.5F}, {1, 1, -2.7F}, {-1, 1, -2.2F},
                 builder.material({1, 1, 1, 0.5F}));
    CaptureSettings settings = inFloat({Channel::kPosition, Channel::kId});
    settings.samples = 4;
    const auto result = capture(builder.scene(), testView(60, 60), settings);
    const Reader position(result.image, Channel::kPosition), id(result.image, Channel::kId);
    ASSERT_GT(result.image.fragments(), 500U);
    for (std::size_t f = 0; f < result.image.fragments(); ++f) {
        ASSERT_NEAR(-position(f).z, result.image.z[f], 1e-6);
        ASSERT_EQ(id.id(f, 0), 1U);
    }
}

}  // namespace
}  // namespace peeler::test
