// SPDX-License-Identifier: Apache-2.0
// Tests KHR_gaussian_splatting.
#include <gtest/gtest.h>

#include "formats/splats/splat_files.h"

namespace peeler::test {
namespace {

const Splats& splatsIn(const Scene& scene) {
    return *scene.meshes.at(0).primitives.at(0).splats;
}

GltfBuilder oneSplat(int degree = 0) {
    return splatGltf({knownSplat()}, degree);
}

TEST(GltfSplats, EveryComponentTypeIsRead) {
    GltfBuilder builder = oneSplat();
    Json& attributes = builder.attributes();
    const Json normalized = {{"normalized", true}};
    Splat splat = knownSplat();
    splat.rotation = {0, 0, 0, 1};
    const auto set = [&](const std::string& name, int accessor) {
        attributes[splatName(name)] = accessor;
    };
    const auto expect = [&] { expectSplat(load(builder), 0, splat, 0, {}); };

    set("ROTATION", builder.addAccessor<std::int8_t>({0, 0, 0, 127}, "VEC4", normalized));
    expect();
    set("ROTATION", builder.addAccessor<std::int16_t>({0, 0, -32767, 0}, "VEC4", normalized));
    splat.rotation = {0, 0, -1, 0};
    expect();
    set("SCALE", builder.addAccessor<std::uint8_t>({1, 2, 255, 0}, "VEC3", {{"count", 1}}));
    splat.scale = {1, 2, 255};
    expect();
    set("SCALE", builder.addAccessor<std::uint16_t>({1, 2, 65535, 0}, "VEC3", {{"count", 1}}));
    splat.scale = {1, 2, 65535};
    expect();
    set("SCALE", builder.addAccessor<std::uint8_t>({51, 102, 255, 0}, "VEC3",
                                                   {{"count", 1}, {"normalized", true}}));
    splat.scale = {0.2, 0.4, 1};
    expect();
    set("SCALE", builder.addAccessor<std::uint16_t>({13107, 26214, 65535, 0}, "VEC3",
                                                    {{"count", 1}, {"normalized", true}}));
    expect();
    set("OPACITY", builder.addAccessor<std::uint8_t>({51}, "SCALAR", normalized));
    splat.opacity = 0.2;
    expect();
    set("OPACITY", builder.addAccessor<std::uint16_t>({65535}, "SCALAR", normalized));
    splat.opacity = 1;
    expect();
}

TEST(GltfSplats, ColoursMayBeLinear) {
    GltfBuilder builder = oneSplat();
    splatExtension(builder)["colorSpace"] = "lin_rec709_display";
    splatExtension(builder)["projection"] = "perspective";
    splatExtension(builder)["sortingMethod"] = "cameraDistance";
    const Scene scene = load(builder);
    EXPECT_TRUE(splatsIn(scene).linear);
    EXPECT_EQ(splatsIn(scene).dilation, 0);
    EXPECT_TRUE(splatsIn(scene).by_distance);
    EXPECT_TRUE(scene.warnings.empty());
}

TEST(GltfSplats, MaterialAndFallbackColourAreIgnored) {
    GltfBuilder builder = oneSplat();
    builder.gltf["materials"] = {{{"name", "m"}}};
    builder.primitive()["material"] = 0;
    builder.attributes()["COLOR_0"] = builder.addAccessor<float>({1, 0, 0}, "VEC3");
    const Scene scene = load(builder);
    EXPECT_TRUE(scene.warnings.empty());
    EXPECT_EQ(scene.meshes[0].primitives[0].material, 1);
    EXPECT_TRUE(scene.meshes[0].primitives[0].colors.empty());
}

TEST(GltfSplats, IndicesChooseSplats) {
    GltfBuilder builder = splatGltf({knownSplat(), knownSplat(1), knownSplat(2)}, 1);
    builder.primitive()["indices"] = builder.addAccessor<std::uint16_t>({2, 1}, "SCALAR");
    const Scene scene = load(builder);
    ASSERT_EQ(splatsIn(scene).size(), 2U);
    EXPECT_TRUE(scene.meshes[0].primitives[0].indices.empty());
    expectSplat(scene, 0, knownSplat(2), 1, {});
    expectSplat(scene, 1, knownSplat(1), 1, {});
}

TEST(GltfSplats, QuaternionsOfOtherLengthsAreNormalised) {
    GltfBuilder builder = oneSplat();
    builder.attributes()[splatName("ROTATION")] = builder.addAccessor<float>({0, 0, 3, 4}, "VEC4");
    const Scene scene = load(builder);
    EXPECT_TRUE(warned(scene, "not of unit length"));
    EXPECT_EQ(splatsIn(scene).rotations[0], glm::vec4(0, 0, 0.6F, 0.8F));
}

TEST(GltfSplats, WhatIsNotSupportedIsNamed) {
    const std::string extension = "/meshes/0/primitives/0/extensions/KHR_gaussian_splatting";
    const std::string attributes = "/meshes/0/primitives/0/attributes";
    const auto place = [&](const char* name) { return attributes + '/' + splatName(name); };
    const struct {
        void (*change)(GltfBuilder&);
        std::string where, words;
    } rows[] = {
        {[](auto& b) { splatExtension(b)["kernel"] = "customShape"; }, extension + "/kernel",
         "kernel \"customShape\" is not supported"},
        {[](auto& b) { splatExtension(b)["colorSpace"] = "aces"; }, extension + "/colorSpace",
         "colorSpace \"aces\""},
        {[](auto& b) { splatExtension(b)["projection"] = "fisheye"; }, extension + "/projection",
         "projection \"fisheye\""},
        {[](auto& b) { splatExtension(b)["sortingMethod"] = "none"; }, extension + "/sortingMethod",
         "sortingMethod \"none\""},
        {[](auto& b) { splatExtension(b).erase("kernel"); }, extension, "\"kernel\" is missing"},
        {[](auto& b) { splatExtension(b)["kernel"] = 1; }, extension + "/kernel", "string"},
        {[](auto& b) {
             splatExtension(b)["extensions"]["KHR_gaussian_splatting_compression_spz"] = {
                 {"bufferView", 0}};
         },
         extension + "/extensions/KHR_gaussian_splatting_compression_spz", "is not supported"},
        {[](auto& b) { b.primitive()["mode"] = 4; }, "/meshes/0/primitives/0/mode", "points"},
        {[](auto& b) { b.attributes().erase(splatName("SCALE")); }, attributes, ":SCALE"},
        {[](auto& b) { b.attributes().erase(splatName("OPACITY")); }, attributes, ":OPACITY"},
        {[](auto& b) { b.attributes().erase(splatName("SH_DEGREE_0_COEF_0")); }, attributes,
         "SH_DEGREE_0_COEF_0"},
        {[](auto& b) { b.attributes().erase(splatName("SH_DEGREE_1_COEF_1")); }, attributes,
         "SH_DEGREE_1_COEF_1"},
        {[](auto& b) {
             b.attributes()[splatName("SCALE")] = b.template addAccessor<float>({1, -1, 1}, "VEC3");
         },
         place("SCALE"), "negative scale"},
        {[](auto& b) {
             b.attributes()[splatName("SCALE")] =
                 b.template addAccessor<float>({1, INFINITY, 1}, "VEC3");
         },
         place("SCALE"), "not finite"},
        {[](auto& b) {
             b.attributes()[splatName("OPACITY")] = b.template addAccessor<float>({1.5}, "SCALAR");
         },
         place("OPACITY"), "outside 0 to 1"},
        {[](auto& b) {
             b.attributes()[splatName("ROTATION")] =
                 b.template addAccessor<float>({0, 0, 0, 0}, "VEC4");
         },
         place("ROTATION"), "rotation of zeros"},
        {[](auto& b) {
             b.attributes()[splatName("SH_DEGREE_1_COEF_2")] =
                 b.template addAccessor<float>({0, 0, NAN}, "VEC3");
         },
         place("SH_DEGREE_1_COEF_2"), "not finite"},
        {[](auto& b) {
             b.attributes()[splatName("OPACITY")] = b.template addAccessor<float>({1, 1}, "SCALAR");
         },
         place("OPACITY"), "POSITION has 1"},
        {[](auto& b) {
             b.attributes()[splatName("OPACITY")] =
                 b.template addAccessor<std::uint32_t>({1}, "SCALAR");
         },
         place("OPACITY"), "does not allow"},
    };
    for (const auto& row : rows) {
        GltfBuilder builder = oneSplat(2);
        row.change(builder);
        const Error error = errorOf(builder);
        EXPECT_EQ(error.kind(), ErrorKind::kInput) << row.words;
        EXPECT_EQ(error.where(), row.where) << row.words;
        EXPECT_TRUE(contains(error.what(), row.words)) << error.what();
    }
}

TEST(GltfSplats, AttributesWithoutTheExtensionAreLeftOut) {
    GltfBuilder builder = oneSplat();
    builder.primitive().erase("extensions");
    const Scene scene = load(builder);
    EXPECT_FALSE(scene.meshes[0].primitives[0].splats);
    EXPECT_TRUE(warned(scene, "SCALE is not allowed there"));
}

TEST(GltfSplats, MorphTargetsAreLeftOut) {
    GltfBuilder builder = oneSplat();
    builder.primitive()["targets"] = {{{"POSITION", builder.attributes()["POSITION"]}}};
    const Scene scene = load(builder);
    EXPECT_TRUE(warned(scene, "morph targets of the splats"));
    checkScene(scene);
}

}  // namespace
}  // namespace peeler::test
