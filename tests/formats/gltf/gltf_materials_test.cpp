// SPDX-License-Identifier: Apache-2.0
// Tests materials, texture references, and the decoding of images.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "formats/gltf/gltf_builder.h"
#include "formats/gltf/gltf_reader.h"
#include "formats/gltf/material_gltf.h"
#include "formats/image/ktx2_builder.h"
#include "formats/image/png_builder.h"
#include "formats/image/uastc_builder.h"

namespace peeler::test {
namespace {

/// Adds images in buffer views, and one texture for each.
void addImages(GltfBuilder& builder, const std::vector<Bytes>& images) {
    for (const Bytes& bytes : images) {
        const std::size_t index = builder.gltf["images"].size();
        builder.gltf["images"].push_back(
            {{"bufferView", builder.addView(bytes)}, {"mimeType", "image/png"}});
        builder.gltf["textures"].push_back({{"source", index}});
    }
}

TEST(GltfMaterials, HaveTheDefaultsOfTheSpecification) {
    const Scene scene = load(withMaterial("{}"));
    ASSERT_EQ(scene.materials.size(), 2U);
    const Material& material = scene.materials[0];
    EXPECT_EQ(material.base_color, glm::vec4(1));
    EXPECT_EQ(material.metallic, 1);
    EXPECT_EQ(material.roughness, 1);
    EXPECT_EQ(material.emissive, glm::vec3(0));
    EXPECT_EQ(material.alpha_mode, AlphaMode::kOpaque);
    EXPECT_EQ(material.alpha_cutoff, 0.5F);
    EXPECT_FALSE(material.double_sided);
    EXPECT_FALSE(material.unlit);
    EXPECT_FALSE(material.base_color_texture);
}

TEST(GltfMaterials, EndWithTheDefaultMaterial) {
    const Scene scene = load(triangle());
    ASSERT_EQ(scene.materials.size(), 1U);
    EXPECT_EQ(scene.meshes[0].primitives[0].material, 0);
    GltfBuilder builder = withMaterial("{}");
    builder.primitive().erase("material");
    EXPECT_EQ(load(builder).meshes[0].primitives[0].material, 1);
}

TEST(GltfMaterials, AreReadWhole) {
    GltfBuilder builder = withMaterial(R"({"name":"m","alphaMode":"MASK","alphaCutoff":0.25,
        "doubleSided":true,"emissiveFactor":[0.5,0.25,1],
        "pbrMetallicRoughness":{"baseColorFactor":[0.1,0.2,0.3,0.4],"metallicFactor":0.6,
          "roughnessFactor":0.7,"baseColorTexture":{"index":0},
          "metallicRoughnessTexture":{"index":1,"texCoord":1}},
        "normalTexture":{"index":2,"scale":-2},"occlusionTexture":{"index":3,"strength":0.5},
        "emissiveTexture":{"index":4},
        "extensions":{"KHR_materials_unlit":{},
                      "KHR_materials_emissive_strength":{"emissiveStrength":8}}})");
    addImages(builder, {onePixelPng(0, 0, 0), onePixelPng(1, 0, 0), onePixelPng(2, 0, 0),
                        onePixelPng(3, 0, 0), onePixelPng(4, 0, 0)});
    builder.gltf["samplers"] = {
        {{"magFilter", 9728}, {"minFilter", 9985}, {"wrapS", 33071}, {"wrapT", 33648}}};
    builder.gltf["textures"][1]["sampler"] = 0;
    const Scene scene = load(builder);
    const Material& material = scene.materials[0];
    EXPECT_EQ(material.name, "m");
    EXPECT_EQ(material.alpha_mode, AlphaMode::kMask);
    EXPECT_EQ(material.alpha_cutoff, 0.25F);
    EXPECT_TRUE(material.double_sided);
    EXPECT_TRUE(material.unlit);
    EXPECT_EQ(material.base_color, glm::vec4(0.1F, 0.2F, 0.3F, 0.4F));
    EXPECT_EQ(material.metallic, 0.6F);
    EXPECT_EQ(material.roughness, 0.7F);
    EXPECT_EQ(material.emissive, glm::vec3(4, 2, 8));
    EXPECT_EQ(material.normal_scale, -2);
    EXPECT_EQ(material.occlusion_strength, 0.5F);
    EXPECT_EQ(material.metallic_roughness_texture.texcoord, 1);
    EXPECT_EQ(material.metallic_roughness_texture.sampler, (Sampler{9728, 9985, 33071, 33648}));
    EXPECT_EQ(material.base_color_texture.sampler, Sampler{});
    const TextureRef* textures[] = {&material.base_color_texture,
                                    &material.metallic_roughness_texture, &material.normal_texture,
                                    &material.occlusion_texture, &material.emissive_texture};
    for (std::uint8_t i = 0; i < 5; ++i) {
        ASSERT_TRUE(*textures[i]);
        EXPECT_EQ(scene.images.at(static_cast<std::size_t>(textures[i]->image)).rgba,
                  (std::vector<std::uint8_t>{i, 0, 0, 255}));
    }
    EXPECT_TRUE(scene.warnings.empty());
}

TEST(GltfMaterials, ClampFactorsOutsideTheirRange) {
    const Scene scene = load(withMaterial(
        R"({"pbrMetallicRoughness":{"baseColorFactor":[2,0,-1,7],"metallicFactor":-3}})"));
    EXPECT_EQ(scene.materials[0].base_color, glm::vec4(1, 0, 0, 1));
    EXPECT_EQ(scene.materials[0].metallic, 0);
    EXPECT_EQ(scene.warnings.size(), 1U);
}

TEST(GltfTextureTransform, IsTranslationTimesRotationTimesScale) {
    GltfBuilder builder = withMaterial(R"({"emissiveTexture":{"index":0,"texCoord":0,
        "extensions":{"KHR_texture_transform":{"offset":[0.5,0.25],"rotation":1.5707963267948966,
                                               "scale":[2,3],"texCoord":1}}}})");
    addImages(builder, {onePixelPng(0, 0, 0)});
    const TextureRef texture = load(builder).materials[0].emissive_texture;
    EXPECT_EQ(texture.texcoord, 1);
    // Scaling maps (1, 1) to (2, 3). A quarter turn, counter-clockwise on screen with v down, maps
    // +u to −v and +v to +u, which gives (3, −2). The offset gives (3.5, −1.75).
    const glm::vec3 uv = texture.transform * glm::vec3(1, 1, 1);
    EXPECT_NEAR(uv.x, 3.5, 1e-6);
    EXPECT_NEAR(uv.y, -1.75, 1e-6);
    EXPECT_EQ(uv.z, 1);
}

TEST(GltfTextures, FallBackToTheFirstCoordinatesBeyondTheSecond) {
    GltfBuilder builder = withMaterial(R"({"emissiveTexture":{"index":0,"texCoord":2}})");
    addImages(builder, {onePixelPng(0, 0, 0)});
    const Scene scene = load(builder);
    EXPECT_EQ(scene.materials[0].emissive_texture.texcoord, 0);
    EXPECT_TRUE(warned(scene, "/materials/0/emissiveTexture"));
}

TEST(GltfTextures, DecodeUsedImagesOnceAndOthersNever) {
    GltfBuilder builder = withMaterial(
        R"({"emissiveTexture":{"index":1},"pbrMetallicRoughness":{"baseColorTexture":{"index":2}}})");
    addImages(builder, {onePixelPng(9, 9, 9), onePixelPng(7, 8, 9)});
    builder.gltf["textures"].push_back({{"source", 1}});
    builder.gltf["images"][0] = {{"uri", "missing.png"}};
    const Scene scene = load(builder);
    ASSERT_EQ(scene.images.size(), 1U);
    EXPECT_EQ(scene.images[0].rgba, (std::vector<std::uint8_t>{7, 8, 9, 255}));
    EXPECT_EQ(scene.materials[0].emissive_texture.image, 0);
    EXPECT_EQ(scene.materials[0].base_color_texture.image, 0);
    EXPECT_TRUE(scene.warnings.empty());
}

TEST(GltfTextures, ComeFromFilesBesideTheScene) {
    const ScratchDir folder;
    GltfBuilder builder = withMaterial(R"({"emissiveTexture":{"index":0}})");
    builder.gltf["images"] = {{{"uri", "a%20b.png"}}};
    builder.gltf["textures"] = {{{"source", 0}}};
    writeFile(folder / "a b.png", onePixelPng(1, 2, 3));
    const Scene scene = readGltf(builder.write(folder));
    EXPECT_EQ(scene.images.at(0).rgba, (std::vector<std::uint8_t>{1, 2, 3, 255}));
    writeFile(folder / "a b.png", onePixelPng(1, 2, 4));
    EXPECT_NE(readGltf(builder.write(folder)).content_hash, scene.content_hash);
}

struct BadImage {
    const char* name;
    const char* image;  ///< JSON of /images/1
    const char* words;
};

class GltfBadImage : public testing::TestWithParam<BadImage> {};

TEST_P(GltfBadImage, IsAWarningOrUnderStrictAnError) {
    GltfBuilder builder = withMaterial(
        R"({"emissiveTexture":{"index":1},"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})");
    addImages(builder, {onePixelPng(1, 2, 3), onePixelPng(4, 5, 6)});
    builder.gltf["images"][1] = Json::parse(GetParam().image);
    const Scene scene = load(builder);
    EXPECT_FALSE(scene.materials[0].emissive_texture);
    ASSERT_TRUE(scene.materials[0].base_color_texture);
    EXPECT_EQ(scene.images.at(0).rgba[0], 1);
    EXPECT_EQ(scene.warnings.size(), 1U);
    EXPECT_TRUE(warned(scene, GetParam().words)) << scene.warnings.at(0);
    EXPECT_TRUE(warned(scene, "/images/1"));

    GltfOptions strict;
    strict.strict = true;
    const Error error = errorOf(builder, strict);
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_EQ(error.where(), "/images/1");
}

INSTANTIATE_TEST_SUITE_P(
    All, GltfBadImage,
    testing::Values(BadImage{"Missing", R"({"uri":"missing.png"})", "does not exist"},
                    BadImage{"Outside", R"({"uri":"../outside.png"})", ".."},
                    BadImage{"Nowhere", R"({"name":"x"})", "neither a uri"},
                    BadImage{"DataUri", R"({"uri":"data:image/png;base64,!"})", "base64"},
                    BadImage{"OtherFormat", R"({"uri":"data:,GIF89a"})", "neither PNG nor JPEG"},
                    BadImage{"Empty", R"({"uri":"data:,"})", "neither PNG nor JPEG"},
                    BadImage{"Truncated", R"({"uri":"data:;base64,iVBORw0KGgoAAAANSUhEUg=="})",
                             "cannot be decoded"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(GltfTextures, WithoutASourceAreLeftOut) {
    GltfBuilder builder = withMaterial(R"({"emissiveTexture":{"index":0}})");
    builder.gltf["textures"] = {{{"name", "nothing"}}};
    const Scene scene = load(builder);
    EXPECT_FALSE(scene.materials[0].emissive_texture);
    EXPECT_TRUE(warned(scene, "/textures/0"));
    GltfOptions strict;
    strict.strict = true;
    EXPECT_EQ(errorOf(builder, strict).where(), "/textures/0");
}

TEST(GltfTextures, OfFormatsThatAreNotDecodedNeedAFallback) {
    for (const std::string name : {"MSFT_texture_dds", "EXT_texture_avif"}) {
        GltfBuilder builder = withMaterial(R"({"emissiveTexture":{"index":0}})");
        addImages(builder, {onePixelPng(1, 2, 3)});
        builder.gltf["images"].push_back({{"uri", "a.other"}});
        builder.gltf["textures"][0]["extensions"][name] = {{"source", 1}};
        builder.gltf["extensionsUsed"] = {name};
        const Scene scene = load(builder);
        EXPECT_TRUE(scene.materials[0].emissive_texture);
        EXPECT_TRUE(warned(scene, name));
        builder.gltf["textures"][0].erase("source");
        const Error error = errorOf(builder);
        EXPECT_EQ(error.where(), "/textures/0/extensions/" + name);
        EXPECT_NE(std::string(error.what()).find(name), std::string::npos);
        EXPECT_NE(error.hint().find("fallback"), std::string::npos);
        GltfOptions options;
        options.ignored_extensions = {name};
        const Scene without = load(builder, options);
        EXPECT_FALSE(without.materials[0].emissive_texture);
        EXPECT_TRUE(warned(without, "its only image needs " + name));
        // If the texture is not used, the file is accepted.
        builder.gltf["materials"][0].erase("emissiveTexture");
        EXPECT_NO_THROW(load(builder));
    }
}

TEST(GltfTextures, PreferTheImagesOfExtensions) {
    for (const char* name : {"EXT_texture_webp", "KHR_texture_basisu"}) {
        GltfBuilder builder = withMaterial(R"({"emissiveTexture":{"index":0}})");
        // The bytes determine an image's format, so PNGs can replace both kinds of image here.
        addImages(builder, {onePixelPng(1, 2, 3), onePixelPng(4, 5, 6)});
        builder.gltf["textures"][0]["extensions"][name] = {{"source", 1}};
        builder.gltf["extensionsUsed"] = {name};
        builder.gltf["extensionsRequired"] = {name};
        const Scene scene = load(builder);
        ASSERT_EQ(scene.images.size(), 1U);
        EXPECT_EQ(scene.images[0].rgba, (Bytes{4, 5, 6, 255}));
        EXPECT_EQ(scene.images[0].codec, "PNG");
        EXPECT_TRUE(scene.warnings.empty());
    }
}

TEST(GltfTextures, MayBeKtx2) {
    GltfBuilder builder = withMaterial(R"({"emissiveTexture":{"index":0}})");
    const Ktx2File file = uastcFile(4, 4, solidUastcBlock(7, 8, 9, 10));
    addImages(builder, {file.bytes()});
    builder.gltf["textures"][0] = {{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}};
    const Scene scene = load(builder);
    ASSERT_EQ(scene.images.size(), 1U);
    EXPECT_EQ(scene.images[0].codec, "KTX2, UASTC");
    EXPECT_EQ(scene.images[0].rgba.size(), 64U);
    EXPECT_EQ(scene.images[0].rgba[1], 8);
    EXPECT_TRUE(scene.warnings.empty());

    // A damaged image is ignored, with the reason in a warning; with `strict` it is an error. A
    // fallback is used if there is one.
    Ktx2File damaged = file;
    damaged.model = 160;
    GltfBuilder other = withMaterial(R"({"emissiveTexture":{"index":0}})");
    addImages(other, {damaged.bytes()});
    EXPECT_FALSE(load(other).materials[0].emissive_texture);
    EXPECT_TRUE(warned(load(other), "colour model 160"));
    EXPECT_TRUE(warned(load(other), "byte 12"));
    GltfOptions strict;
    strict.strict = true;
    EXPECT_EQ(errorOf(other, strict).where(), "/images/0");
    addImages(other, {onePixelPng(1, 2, 3)});
    other.gltf["textures"][0] = {{"source", 1},
                                 {"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}};
    EXPECT_EQ(load(other).images.at(0).rgba, (Bytes{1, 2, 3, 255}));
    EXPECT_TRUE(warned(load(other), "The fallback image is used because the image /images/0"));
}

TEST(GltfTextures, OfKtx2AreWarnedOfWhatContradictsTheScene) {
    GltfBuilder builder = withMaterial(
        R"({"emissiveTexture":{"index":0},"normalTexture":{"index":1},"occlusionTexture":{"index":2}})");
    Ktx2File linear = uastcFile(4, 4, solidUastcBlock(7, 8, 9, 10));
    linear.transfer = 1;
    Ktx2File silent = linear;
    silent.transfer = 0;
    silent.metadata = {{"KTXorientation", "ru"}};
    const Ktx2File srgb = uastcFile(4, 4, solidUastcBlock(1, 1, 1, 1));
    addImages(builder, {linear.bytes(), srgb.bytes(), silent.bytes()});
    const Scene scene = load(builder);
    EXPECT_EQ(scene.images.size(), 3U);
    EXPECT_EQ(scene.warnings.size(), 3U);
    EXPECT_TRUE(warned(scene,
                       "The image /images/0 is marked as linear, but is read as sRGB, as its use "
                       "in a material requires."));
    EXPECT_TRUE(warned(scene,
                       "The image /images/1 is marked as sRGB, but is read as linear, as its use "
                       "in a material requires."));
    EXPECT_TRUE(warned(scene, "The image /images/2: its orientation (KTXorientation)"));
}

TEST(GltfTextures, FallBackWhereTheWebpImageIsMissing) {
    GltfBuilder builder = withMaterial(
        R"({"emissiveTexture":{"index":0},"normalTexture":{"index":0},"occlusionTexture":{"index":1}})");
    addImages(builder, {onePixelPng(1, 2, 3), onePixelPng(4, 5, 6)});
    builder.gltf["images"].push_back({{"uri", "missing.webp"}});
    builder.gltf["textures"][0]["extensions"]["EXT_texture_webp"] = {{"source", 2}};
    const Scene scene = load(builder);
    const auto shown = [&](const TextureRef& texture) {
        return scene.images.at(static_cast<std::size_t>(texture.image)).rgba;
    };
    EXPECT_EQ(shown(scene.materials[0].emissive_texture), (Bytes{1, 2, 3, 255}));
    EXPECT_EQ(shown(scene.materials[0].normal_texture), (Bytes{1, 2, 3, 255}));
    EXPECT_EQ(shown(scene.materials[0].occlusion_texture), (Bytes{4, 5, 6, 255}));
    EXPECT_EQ(scene.images.size(), 2U);
    EXPECT_TRUE(warned(scene, "The fallback image is used because the image /images/2"));
    GltfOptions strict;
    strict.strict = true;
    EXPECT_EQ(errorOf(builder, strict).where(), "/images/2");
    // If the fallback is missing too, the texture is ignored, as without any extension.
    builder.gltf["images"][0] = {{"uri", "missing.png"}};
    EXPECT_FALSE(load(builder).materials[0].emissive_texture);
}

TEST(GltfTextures, KeepWithinTheirLimits) {
    GltfBuilder builder = withMaterial(R"({"emissiveTexture":{"index":0}})");
    addImages(builder, {png(3, 2, PngColor::kGrey, 8, {0, 1, 2, 3, 4, 5})});
    GltfOptions options;
    options.strict = true;
    options.max_image_dimension = 3;
    options.max_image_bytes = 24;
    EXPECT_NO_THROW(load(builder, options));
    options.max_image_bytes = 23;
    EXPECT_EQ(errorOf(builder, options).where(), "/images/0");
    options.max_image_bytes = 24;
    options.max_image_dimension = 2;
    EXPECT_EQ(errorOf(builder, options).where(), "/images/0");
}

}  // namespace
}  // namespace peeler::test
