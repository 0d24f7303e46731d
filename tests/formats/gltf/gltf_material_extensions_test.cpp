// SPDX-License-Identifier: Apache-2.0
// Tests the reading of the KHR_materials extensions and of variants.
#include <gtest/gtest.h>

#include "core/scene/material.h"
#include "formats/gltf/gltf_builder.h"
#include "formats/gltf/gltf_reader.h"
#include "formats/gltf/material_gltf.h"
#include "formats/image/png_builder.h"

namespace peeler::test {
namespace {

Material materialOf(const std::string& extensions, int images = 0) {
    const Scene scene = load(withMaterial(R"({"extensions":)" + extensions + "}", images));
    EXPECT_TRUE(scene.warnings.empty()) << scene.warnings.at(0);
    return scene.materials[0];
}

TEST(GltfMaterialExtensions, HaveTheDefaultsOfTheirSpecifications) {
    const Material m = materialOf(R"({"KHR_materials_ior":{},"KHR_materials_specular":{},
        "KHR_materials_clearcoat":{},"KHR_materials_sheen":{},"KHR_materials_anisotropy":{},
        "KHR_materials_iridescence":{"iridescenceFactor":0.5},
        "KHR_materials_transmission":{"transmissionFactor":0.5},"KHR_materials_volume":{}})");
    EXPECT_EQ(m.ior, 1.5F);
    EXPECT_EQ(m.specular.factor, 1);
    EXPECT_EQ(m.specular.color, glm::vec3(1));
    EXPECT_EQ(m.clearcoat.factor, 0);
    EXPECT_EQ(m.sheen.color, glm::vec3(0));
    EXPECT_EQ(m.anisotropy.strength, 0);
    EXPECT_EQ(m.iridescence.ior, 1.3F);
    EXPECT_EQ(m.iridescence.thickness_min, 100);
    EXPECT_EQ(m.iridescence.thickness_max, 400);
    EXPECT_EQ(m.transmission.thickness, 0);
    EXPECT_EQ(m.transmission.attenuation_distance, 0);
    EXPECT_EQ(m.transmission.attenuation_color, glm::vec3(1));
    EXPECT_FALSE(m.specular_glossiness);
}

TEST(GltfMaterialExtensions, AreReadWhole) {
    const Material m = materialOf(R"({"KHR_materials_ior":{"ior":1.33},
        "KHR_materials_specular":{"specularFactor":0.25,"specularTexture":{"index":0},
            "specularColorFactor":[0.5,1,2],"specularColorTexture":{"index":1}},
        "KHR_materials_clearcoat":{"clearcoatFactor":0.5,"clearcoatTexture":{"index":2},
            "clearcoatRoughnessFactor":0.75,"clearcoatRoughnessTexture":{"index":3},
            "clearcoatNormalTexture":{"index":4,"scale":-2}},
        "KHR_materials_sheen":{"sheenColorFactor":[0.1,0.2,0.3],"sheenColorTexture":{"index":5},
            "sheenRoughnessFactor":0.4,"sheenRoughnessTexture":{"index":6}},
        "KHR_materials_anisotropy":{"anisotropyStrength":0.6,"anisotropyRotation":-4,
            "anisotropyTexture":{"index":7}},
        "KHR_materials_iridescence":{"iridescenceFactor":0.7,"iridescenceTexture":{"index":8},
            "iridescenceIor":1.8,"iridescenceThicknessMinimum":50,
            "iridescenceThicknessMaximum":700,"iridescenceThicknessTexture":{"index":9}},
        "KHR_materials_transmission":{"transmissionFactor":0.9,"transmissionTexture":{"index":10}},
        "KHR_materials_volume":{"thicknessFactor":2.5,"thicknessTexture":{"index":11},
            "attenuationDistance":0.5,"attenuationColor":[0.3,0.2,0.1]}})",
                                  12);
    EXPECT_EQ(m.ior, 1.33F);
    EXPECT_EQ(m.specular.factor, 0.25F);
    EXPECT_EQ(m.specular.color, glm::vec3(0.5F, 1, 2));
    EXPECT_EQ(m.clearcoat.factor, 0.5F);
    EXPECT_EQ(m.clearcoat.roughness, 0.75F);
    EXPECT_EQ(m.clearcoat.normal_scale, -2);
    EXPECT_EQ(m.sheen.color, glm::vec3(0.1F, 0.2F, 0.3F));
    EXPECT_EQ(m.sheen.roughness, 0.4F);
    EXPECT_EQ(m.anisotropy.strength, 0.6F);
    EXPECT_EQ(m.anisotropy.rotation, -4);
    EXPECT_EQ(m.iridescence.factor, 0.7F);
    EXPECT_EQ(m.iridescence.ior, 1.8F);
    EXPECT_EQ(m.iridescence.thickness_min, 50);
    EXPECT_EQ(m.iridescence.thickness_max, 700);
    EXPECT_EQ(m.transmission.factor, 0.9F);
    EXPECT_EQ(m.transmission.thickness, 2.5F);
    EXPECT_EQ(m.transmission.attenuation_distance, 0.5F);
    EXPECT_EQ(m.transmission.attenuation_color, glm::vec3(0.3F, 0.2F, 0.1F));
    const TextureRef* textures[] = {&m.specular.texture,         &m.specular.color_texture,
                                    &m.clearcoat.texture,        &m.clearcoat.roughness_texture,
                                    &m.clearcoat.normal_texture, &m.sheen.color_texture,
                                    &m.sheen.roughness_texture,  &m.anisotropy.texture,
                                    &m.iridescence.texture,      &m.iridescence.thickness_texture,
                                    &m.transmission.texture,     &m.transmission.thickness_texture};
    for (int i = 0; i < 12; ++i)
        EXPECT_EQ(textures[i]->image, i);
}

TEST(GltfMaterialExtensions, TransformTheirTextures) {
    const Material m = materialOf(R"({"KHR_materials_clearcoat":{"clearcoatFactor":1,
        "clearcoatTexture":{"index":0,"texCoord":0,"extensions":{"KHR_texture_transform":
            {"offset":[0.5,0.25],"scale":[2,4],"texCoord":1}}}}})",
                                  1);
    EXPECT_EQ(m.clearcoat.texture.texcoord, 1);
    EXPECT_EQ(m.clearcoat.texture.transform * glm::vec3(1, 1, 1), glm::vec3(2.5F, 4.25F, 1));
}

TEST(GltfMaterialExtensions, ReplaceMetallicRoughnessBySpecularGlossiness) {
    GltfBuilder builder = withMaterial(R"({"alphaMode":"BLEND",
        "pbrMetallicRoughness":{"baseColorFactor":[1,0,0,1],"baseColorTexture":{"index":0}},
        "extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[0.1,0.2,0.3,0.4],
            "specularFactor":[0.5,0.6,0.7],"glossinessFactor":0.8,"diffuseTexture":{"index":1},
            "specularGlossinessTexture":{"index":2}}}})",
                                       3);
    const Scene scene = load(builder);
    const Material& m = scene.materials[0];
    EXPECT_EQ(m.base_color, glm::vec4(0.1F, 0.2F, 0.3F, 0.4F));
    ASSERT_TRUE(m.specular_glossiness);
    EXPECT_EQ(m.specular_glossiness->specular, glm::vec3(0.5F, 0.6F, 0.7F));
    EXPECT_EQ(m.specular_glossiness->glossiness, 0.8F);
    EXPECT_EQ(scene.images.at(static_cast<std::size_t>(m.base_color_texture.image)).rgba[0], 1);
    EXPECT_EQ(
        scene.images.at(static_cast<std::size_t>(m.specular_glossiness->texture.image)).rgba[0], 2);
    // No value of the metallic-roughness fallback may remain.
    const Material bare = materialOf(R"({"KHR_materials_pbrSpecularGlossiness":{}})");
    EXPECT_EQ(bare.base_color, glm::vec4(1));
    EXPECT_EQ(bare.specular_glossiness->specular, glm::vec3(1));
    EXPECT_EQ(bare.specular_glossiness->glossiness, 1);
}

TEST(GltfMaterialExtensions, OutOfRangeAreClampedWithAWarning) {
    const Scene scene = load(withMaterial(R"({"extensions":{
        "KHR_materials_clearcoat":{"clearcoatFactor":3},
        "KHR_materials_transmission":{"transmissionFactor":-1},
        "KHR_materials_sheen":{"sheenColorFactor":[0.5,2,0]}}})"));
    EXPECT_EQ(scene.materials[0].clearcoat.factor, 1);
    EXPECT_EQ(scene.materials[0].transmission.factor, 0);
    EXPECT_EQ(scene.materials[0].sheen.color, glm::vec3(0.5F, 1, 0));
    EXPECT_EQ(scene.warnings.size(), 3U);
    EXPECT_TRUE(warned(scene, "/materials/0/extensions/KHR_materials_clearcoat/clearcoatFactor"));
}

TEST(GltfMaterialExtensions, OfTheWrongTypeAreRefused) {
    const std::pair<const char*, const char*> bad[] = {
        {R"({"KHR_materials_ior":{"ior":"glass"}})",
         "/materials/0/extensions/KHR_materials_ior/ior"},
        {R"({"KHR_materials_sheen":{"sheenColorFactor":[1,2]}})",
         "/materials/0/extensions/KHR_materials_sheen/sheenColorFactor"},
        {R"({"KHR_materials_clearcoat":{"clearcoatTexture":{"index":7}}})",
         "/materials/0/extensions/KHR_materials_clearcoat/clearcoatTexture/index"},
        {R"({"KHR_materials_volume":{"attenuationDistance":0}})",
         "/materials/0/extensions/KHR_materials_volume/attenuationDistance"},
        {R"({"KHR_materials_transmission":[]})",
         "/materials/0/extensions/KHR_materials_transmission"}};
    for (const auto& [extensions, where] : bad) {
        const Error error =
            errorOf(withMaterial(R"({"extensions":)" + std::string(extensions) + "}"));
        EXPECT_EQ(error.kind(), ErrorKind::kInput);
        EXPECT_EQ(error.where(), where);
    }
}

TEST(GltfMaterialExtensions, GoUnreadOnUnlitMaterials) {
    const Material m = materialOf(R"({"KHR_materials_unlit":{},
        "KHR_materials_transmission":{"transmissionFactor":1},
        "KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[0,0,0,0]}})");
    EXPECT_TRUE(m.unlit);
    EXPECT_FALSE(isTransmissive(m));
    EXPECT_EQ(m.base_color, glm::vec4(1));
}

TEST(GltfMaterialExtensions, CanLeaveTransmissionOut) {
    GltfOptions opaque;
    opaque.transmission = false;
    const GltfBuilder builder = withMaterial(R"({"extensions":{
        "KHR_materials_transmission":{"transmissionFactor":1},
        "KHR_materials_volume":{"thicknessFactor":1}}})");
    EXPECT_FALSE(isTransmissive(load(builder, opaque).materials[0]));
    EXPECT_TRUE(isTransmissive(load(builder).materials[0]));
}

TEST(GltfMaterialExtensions, AreSupportedButForDispersion) {
    GltfBuilder builder = withMaterial("{}");
    for (const GltfExtension& extension : gltfExtensions()) {
        const std::string name = extension.name;
        if (!name.starts_with("KHR_materials_")) continue;
        EXPECT_EQ(extension.supported, name != "KHR_materials_dispersion") << name;
    }
    builder.gltf["extensionsUsed"] = {"KHR_materials_dispersion"};
    EXPECT_TRUE(warned(load(builder), "KHR_materials_dispersion is ignored"));
}

GltfBuilder withVariants() {
    GltfBuilder builder = withMaterial("{}");
    builder.gltf["materials"] = {{{"name", "own"}}, {{"name", "red"}}, {{"name", "blue"}}};
    builder.gltf["extensions"]["KHR_materials_variants"]["variants"] = {
        {{"name", "day"}}, {{"name", "night"}}, {{"name", "unused"}}};
    builder.primitive()["extensions"]["KHR_materials_variants"]["mappings"] = {
        {{"material", 1}, {"variants", {0}}}, {{"material", 2}, {"variants", {1}}}};
    return builder;
}

TEST(GltfVariants, AreOtherMaterials) {
    const Scene scene = load(withVariants());
    EXPECT_EQ(scene.variants, (std::vector<std::string>{"day", "night", "unused"}));
    EXPECT_EQ(scene.meshes[0].primitives[0].material, 0);
    for (const auto& [variant, material] : {std::pair{0U, 1}, {1U, 2}, {2U, 0}}) {
        Scene chosen = scene;
        chooseVariant(chosen, variant);
        EXPECT_EQ(chosen.meshes[0].primitives[0].material, material);
    }
}

TEST(GltfVariants, OutOfRangeAreRefused) {
    GltfBuilder builder = withVariants();
    auto& mapping = builder.primitive()["extensions"]["KHR_materials_variants"]["mappings"][0];
    mapping["variants"] = {3};
    EXPECT_EQ(errorOf(builder).where(),
              "/meshes/0/primitives/0/extensions/KHR_materials_variants/mappings/0/variants/0");
    mapping["variants"] = {0};
    mapping["material"] = 3;
    EXPECT_EQ(errorOf(builder).where(),
              "/meshes/0/primitives/0/extensions/KHR_materials_variants/mappings/0/material");
}

}  // namespace
}  // namespace peeler::test
