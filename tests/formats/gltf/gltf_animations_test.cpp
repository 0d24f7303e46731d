// SPDX-License-Identifier: Apache-2.0
// Tests animations in glTF files: samplers, channels, and invalid animations.
#include "formats/gltf/gltf_parts.h"

#include <gtest/gtest.h>

#include "formats/gltf/gltf_builder.h"

namespace peeler::test {
namespace {

/// Returns a triangle whose node moves from (0, 0, 0) to (1, 2, 3) in two seconds.
GltfBuilder movingTriangle() {
    GltfBuilder builder = triangle();
    const int times = builder.addAccessor<float>({0.5F, 2.5F}, "SCALAR");
    const int places = builder.addAccessor<float>({0, 0, 0, 1, 2, 3}, "VEC3");
    builder.gltf["animations"] = {
        {{"name", "go"},
         {"samplers", {{{"input", times}, {"output", places}}}},
         {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}}}};
    return builder;
}

Json& sampler(GltfBuilder& builder) {
    return builder.gltf["animations"][0]["samplers"][0];
}
Json& channel(GltfBuilder& builder) {
    return builder.gltf["animations"][0]["channels"][0];
}

TEST(GltfAnimations, AreReadAsTheyAre) {
    const Scene scene = load(movingTriangle());
    ASSERT_EQ(scene.animations.size(), 1U);
    const Animation& animation = scene.animations[0];
    EXPECT_EQ(animation.name, "go");
    ASSERT_EQ(animation.channels.size(), 1U);
    EXPECT_EQ(animation.channels[0].node, 0);
    EXPECT_EQ(animation.channels[0].property, AnimatedProperty::kTranslation);
    const Keyframes& keys = animation.keyframes.at(0);
    EXPECT_EQ(keys.interpolation, Interpolation::kLinear);
    EXPECT_EQ(keys.times, (std::vector<float>{0.5F, 2.5F}));
    EXPECT_EQ(keys.values, (std::vector<float>{0, 0, 0, 1, 2, 3}));
    EXPECT_TRUE(scene.warnings.empty());
}

TEST(GltfAnimations, TakeNormalizedIntegersForRotations) {
    GltfBuilder builder = movingTriangle();
    sampler(builder)["output"] = builder.addAccessor<std::int16_t>(
        {0, 0, 0, 32767, 0, -32767, -32768, 0}, "VEC4", {{"normalized", true}});
    channel(builder)["target"]["path"] = "rotation";
    const Scene scene = load(builder);
    EXPECT_EQ(scene.animations[0].keyframes[0].values,
              (std::vector<float>{0, 0, 0, 1, 0, -1, -1, 0}));
}

TEST(GltfAnimations, CubicSplinesHaveThreeValuesAKey) {
    GltfBuilder builder = movingTriangle();
    sampler(builder)["interpolation"] = "CUBICSPLINE";
    const Error error = errorOf(builder);
    EXPECT_EQ(error.where(), "/animations/0/samplers/0/output");
    sampler(builder)["output"] = builder.addAccessor<float>(std::vector<float>(18, 1), "VEC3");
    EXPECT_EQ(load(builder).animations[0].keyframes[0].values.size(), 18U);
}

TEST(GltfAnimations, WeightsAreAsManyAsMorphTargets) {
    GltfBuilder builder = movingTriangle();
    const int displacement = builder.addAccessor<float>(std::vector<float>(9, 1), "VEC3");
    builder.primitive()["targets"] = {{{"POSITION", displacement}}, {{"POSITION", displacement}}};
    builder.gltf["meshes"][0]["weights"] = {0.25, 0.5};
    channel(builder)["target"]["path"] = "weights";
    sampler(builder)["output"] = builder.addAccessor<float>({0, 1, 1, 0}, "SCALAR");
    const Scene scene = load(builder);
    EXPECT_EQ(scene.meshes[0].primitives[0].targets.size(), 2U);
    EXPECT_EQ(scene.meshes[0].weights, (std::vector<double>{0.25, 0.5}));
    EXPECT_EQ(scene.animations[0].channels[0].property, AnimatedProperty::kWeights);
    sampler(builder)["output"] = builder.addAccessor<float>({0, 1, 1}, "SCALAR");
    EXPECT_EQ(errorOf(builder).where(), "/animations/0/samplers/0/output");
}

TEST(GltfAnimations, ASamplerMayServeSeveralProperties) {
    GltfBuilder builder = movingTriangle();
    Json second = channel(builder);
    second["target"]["path"] = "scale";
    builder.gltf["animations"][0]["channels"].push_back(second);
    const Scene scene = load(builder);
    EXPECT_EQ(scene.animations[0].channels.size(), 2U);
    EXPECT_EQ(scene.animations[0].channels[1].property, AnimatedProperty::kScale);
}

TEST(GltfAnimations, LeaveOutWhatTheyCannotMove) {
    GltfBuilder builder = movingTriangle();
    // The specification requires that channels without a node are ignored.
    channel(builder)["target"].erase("node");
    EXPECT_TRUE(load(builder).animations[0].channels.empty());
    EXPECT_TRUE(load(builder).warnings.empty());

    builder = movingTriangle();
    channel(builder)["target"]["path"] = "pointer";
    EXPECT_TRUE(warned(load(builder), "\"pointer\", which is not supported"));

    builder = movingTriangle();
    builder.gltf["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1};
    const Scene fixed = load(builder);
    EXPECT_TRUE(fixed.animations[0].channels.empty());
    EXPECT_TRUE(warned(fixed, "moves a node with a matrix"));

    builder = movingTriangle();
    channel(builder)["target"]["path"] = "weights";
    EXPECT_TRUE(warned(load(builder), "without morph targets"));
}

TEST(GltfAnimations, RefuseDamage) {
    const struct {
        const char* what;
        void (*damage)(GltfBuilder&);
        const char* where;
    } rows[] = {
        {"falling times",
         [](GltfBuilder& b) {
             sampler(b)["input"] = b.addAccessor<float>({1, 0.5F}, "SCALAR");
         },
         "/animations/0/samplers/0/input"},
        {"times that are no numbers",
         [](GltfBuilder& b) {
             sampler(b)["input"] = b.addAccessor<float>({0, std::nanf("")}, "SCALAR");
         },
         "/animations/0/samplers/0/input"},
        {"values that are no numbers",
         [](GltfBuilder& b) {
             sampler(b)["output"] = b.addAccessor<float>({0, 0, 0, 0, 0, INFINITY}, "VEC3");
         },
         "/animations/0/samplers/0/output"},
        {"more times than values",
         [](GltfBuilder& b) {
             sampler(b)["input"] = b.addAccessor<float>({0, 1, 2}, "SCALAR");
         },
         "/animations/0/samplers/0/output"},
        {"integers for places",
         [](GltfBuilder& b) {
             sampler(b)["output"] = b.addAccessor<std::int8_t>({0, 0, 0, 0, 1, 2, 3, 0}, "VEC4");
         },
         "/animations/0/samplers/0/output"},
        {"a sampler that is not there", [](GltfBuilder& b) { channel(b)["sampler"] = 1; },
         "/animations/0/channels/0/sampler"},
        {"a node that is not there", [](GltfBuilder& b) { channel(b)["target"]["node"] = 1; },
         "/animations/0/channels/0/target/node"},
        {"an interpolation that is none",
         [](GltfBuilder& b) { sampler(b)["interpolation"] = "SMOOTH"; },
         "/animations/0/samplers/0/interpolation"},
        {"no channels", [](GltfBuilder& b) { b.gltf["animations"][0].erase("channels"); },
         "/animations/0"},
    };
    for (const auto& row : rows) {
        GltfBuilder builder = movingTriangle();
        row.damage(builder);
        const Error error = errorOf(builder);
        EXPECT_EQ(error.kind(), ErrorKind::kInput) << row.what;
        EXPECT_EQ(error.where(), row.where) << row.what;
    }
}

TEST(GltfAnimations, HaveALimit) {
    GltfOptions tight;
    tight.max_geometry_bytes = 100;  // the vertices of the triangle need 36 bytes
    GltfBuilder builder = movingTriangle();
    EXPECT_EQ(load(builder, tight).animations.size(), 1U);
    builder.gltf["animations"].push_back(builder.gltf["animations"][0]);
    builder.gltf["animations"].push_back(builder.gltf["animations"][0]);
    EXPECT_EQ(errorOf(builder, tight).where(), "/animations/2/samplers/0");
}

}  // namespace
}  // namespace peeler::test
