// SPDX-License-Identifier: Apache-2.0
// Tests that instanced draws equal individual draws, and that a renderer moved to another time
// equals a new renderer, bit for bit.
#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "core/capture/method.h"
#include "core/scene/posed_scene.h"
#include "support/capture.h"
#include "support/test_support.h"

namespace peeler::test {
namespace {

glm::dmat4 somewhere(std::mt19937& random) {
    std::uniform_real_distribution<double> unit(-1, 1);
    glm::dmat4 place = glm::translate(
        glm::dmat4(1), glm::dvec3(unit(random), 0.7 * unit(random), -3 + unit(random)));
    place = glm::rotate(place, 3 * unit(random), glm::dvec3(0.3, 1, 0.2));
    return glm::scale(place, glm::dvec3(0.3, 0.25, 0.35));
}

/// Returns 40 instances of a transparent quad, and a rectangle that cuts through them. Two
/// instances coincide, and one is mirrored. With `several`, the mesh also has an alpha-tested quad.
Scene crowdOfInstances(unsigned seed, bool several) {
    SceneBuilder builder;
    const int glass = builder.lit(builder.material({0.2F, 0.5F, 0.9F, 0.4F}));
    const int grid = builder.lit(builder.material({0.9F, 0.4F, 0.2F, 1}, AlphaMode::kMask));
    builder.quad({-1, -1, 0}, {1, -1, 0.3F}, {1, 1, 0}, {-1, 1, -0.3F}, glass);
    builder.quad({0, -1, -1}, {0, -1, 1}, {0, 1, 1}, {0, 1, -1}, grid);
    builder.rectangle(1.5F, 0.9F, -3, glass);
    Scene& scene = builder.scene();
    // The glass has a volume, because its thickness depends on the scale of the instance.
    Transmission& volume = scene.materials[static_cast<std::size_t>(glass)].transmission;
    volume.factor = 0.6F;
    volume.thickness = 0.8F;
    volume.attenuation_distance = 0.3F;
    volume.attenuation_color = {0.9F, 0.5F, 0.3F};
    // With `several`, the second mesh's primitive is added to the first mesh. Its vertex alphas
    // define the cutout.
    Primitive second = scene.meshes[1].primitives[0];
    second.colors = {{1, 1, 1, 1}, {1, 1, 1, 0}, {1, 1, 1, 1},
                     {1, 1, 1, 0}, {1, 1, 1, 1}, {1, 1, 1, 1}};
    second.colors.resize(second.positions.size(), glm::vec4(1));
    if (several) scene.meshes[0].primitives.push_back(second);
    scene.nodes[1].mesh = -1;
    std::mt19937 random(seed);
    std::vector<glm::dmat4> places;
    for (int i = 0; i < 40; ++i)
        places.push_back(somewhere(random));
    places[7] = places[3];
    places[20] = glm::scale(places[20], glm::dvec3(-1, 1, 1));
    scene.nodes[0].instances = places;
    return scene;
}

/// Returns the scene with each instance replaced by a node in the same place.
Scene expanded(Scene scene) {
    const std::vector<glm::dmat4> places = *scene.nodes[0].instances;
    scene.nodes[0].instances.reset();
    scene.nodes[0].mesh = -1;
    for (const glm::dmat4& place : places) {
        scene.nodes[0].children.push_back(static_cast<int>(scene.nodes.size()));
        Node& node = scene.nodes.emplace_back();
        node.local = place;
        node.mesh = 0;
    }
    return scene;
}

void expectTheSame(const Scene& together) {
    const Scene apart = expanded(together);
    const View view = exhaustive() ? testView(160, 120) : testView(80, 60);
    for (const MethodInfo& method : peelMethods()) {
        if (!method.exact()) continue;
        for (const Surfaces surfaces : {Surfaces::kAll, Surfaces::kVisible}) {
            CaptureSettings settings;
            settings.method = method.name;
            settings.surfaces = surfaces;
            const Captured one = capture(together, view, settings);
            const Captured other = capture(apart, view, settings);
            EXPECT_GT(one.image.fragments(), exhaustive() ? 2000U : 500U);
            EXPECT_EQ(difference(one.image, other.image), "") << method.name;
        }
    }
    CaptureSettings smooth;
    smooth.samples = 4;  // merges the samples of each surface
    EXPECT_EQ(difference(capture(together, view, smooth).image, capture(apart, view, smooth).image),
              "");
    smooth.samples = 1;
    smooth.shadows = true;
    EXPECT_EQ(difference(capture(together, view, smooth).image, capture(apart, view, smooth).image),
              "");
}

TEST(Instancing, IsTheExpandedSceneBitForBit) {
    const unsigned seed = 20240607;
    SCOPED_TRACE(seed);
    expectTheSame(crowdOfInstances(seed, false));
    expectTheSame(crowdOfInstances(seed, true));
}

/// A mesh of two overlapping rectangles in one plane, in three places of that plane. All fragments
/// of a pixel coincide: the second primitive of one instance may coincide with the first primitive
/// of others.
TEST(Instancing, KeepsTheOrderOfCoincidentPrimitives) {
    for (const AlphaMode mode : {AlphaMode::kBlend, AlphaMode::kOpaque}) {
        SceneBuilder builder;
        const int red = builder.material({0.9F, 0.1F, 0.1F, 0.5F}, mode);
        const int blue = builder.material({0.1F, 0.2F, 0.9F, 0.5F}, mode);
        builder.quad({-0.5F, -0.4F, 0}, {0.5F, -0.4F, 0}, {0.5F, 0.4F, 0}, {-0.5F, 0.4F, 0}, red);
        builder.quad({0, -0.3F, 0}, {1, -0.3F, 0}, {1, 0.5F, 0}, {0, 0.5F, 0}, blue);
        Scene& scene = builder.scene();
        scene.meshes[0].primitives.push_back(scene.meshes[1].primitives[0]);
        scene.nodes[1].mesh = -1;
        std::vector<glm::dmat4> places;
        for (const double x : {0.0, 0.5, -0.75})
            places.push_back(glm::translate(glm::dmat4(1), glm::dvec3(x, 0, -3)));
        scene.nodes[0].instances = places;
        expectTheSame(scene);
        CaptureSettings unsorted;
        unsorted.method = "unsorted";
        unsorted.composite = true;
        EXPECT_EQ(difference(capture(scene, testView(60, 40), unsorted).image,
                             capture(expanded(scene), testView(60, 40), unsorted).image),
                  "");
    }
}

/// Returns a moving cloth: a morph target, a skin, a moving node and a moving light.
Scene moving() {
    SceneBuilder builder;
    const int cloth = builder.lit(builder.material({0.8F, 0.7F, 0.3F, 0.6F}));
    builder.rectangle(1, 0.7F, -3, cloth);
    builder.rectangle(0.5F, 0.9F, -2.5F, cloth);
    builder.rectangle(0.9F, 0.4F, -2.8F, cloth);
    Light lamp;
    lamp.intensity = 3;
    builder.light(lamp, glm::dmat4(1));
    Scene& scene = builder.scene();
    Primitive& morphed = scene.meshes[0].primitives[0];
    morphed.targets.resize(1);
    for (std::size_t i = 0; i < morphed.positions.size(); ++i)
        morphed.targets[0].positions.emplace_back(0, 0.3F, 0.1F * static_cast<float>(i));
    Primitive& skinned = scene.meshes[1].primitives[0];
    JointSet set;
    set.joints.assign(skinned.positions.size(), {0, 0, 0, 0});
    set.weights.assign(skinned.positions.size(), {1, 0, 0, 0});
    skinned.joint_sets = {set};
    scene.skins.emplace_back().joints = {2};
    scene.skins[0].inverse_bind = {glm::dmat4(1)};
    scene.nodes[1].skin = 0;
    for (Node& node : scene.nodes)
        node.trs.emplace();
    Animation& animation = scene.animations.emplace_back();
    animation.keyframes = {{Interpolation::kLinear, {0, 1}, {0, 1}},
                           {Interpolation::kLinear, {0, 1}, {0, 0, 0, 0.2F, 0.1F, 0.3F}},
                           {Interpolation::kLinear, {0, 1}, {0, 0, 0, 1, 0.5F, 0, 0, 0.86F}}};
    animation.channels = {{0, 0, AnimatedProperty::kWeights},
                          {1, 2, AnimatedProperty::kTranslation},
                          {2, 3, AnimatedProperty::kRotation}};
    return scene;
}

TEST(Sequence, EveryFrameIsWhatItIsAlone) {
    const Scene scene = moving();
    const View view = testView(120, 90);
    const int playing[] = {0};
    const auto at = [&](double time) { return PosedScene(scene, 0, poseAt(scene, playing, time)); };
    for (const bool shadows : {false, true}) {
        CaptureSettings settings;
        settings.shadows = shadows;
        GlRenderer sequence(sharedContext(), at(0.9));
        LayeredImage last;
        for (const double time : {0.0, 0.5, 1.0, 0.5}) {
            sequence.setPose(at(time));
            const Captured frame = capture(sequence, view, settings);
            GlRenderer alone(sharedContext(), at(time));
            EXPECT_EQ(difference(frame.image, capture(alone, view, settings).image), "") << time;
            EXPECT_NE(difference(frame.image, last), "") << time;
            last = frame.image;
        }
    }
}

TEST(Sequence, ChangesWhereOnlyALightMoves) {
    Scene scene = moving();
    for (int i = 0; i < 2; ++i)
        scene.nodes[static_cast<std::size_t>(i)].mesh = -1;
    scene.nodes[1].skin = -1;
    scene.animations[0].channels = {{2, 3, AnimatedProperty::kRotation}};
    const int playing[] = {0};
    const auto at = [&](double time) { return PosedScene(scene, 0, poseAt(scene, playing, time)); };
    GlRenderer renderer(sharedContext(), at(0));
    const View view = testView(60, 45);
    const LayeredImage first = capture(renderer, view).image;
    renderer.setPose(at(1));
    const LayeredImage second = capture(renderer, view).image;
    EXPECT_EQ(first.z, second.z);
    EXPECT_NE(first.color.data, second.color.data);
    GlRenderer alone(sharedContext(), at(1));
    EXPECT_EQ(difference(second, capture(alone, view).image), "");
}

}  // namespace
}  // namespace peeler::test
