// SPDX-License-Identifier: Apache-2.0
// Tests the fields of a material that reach the shaders.
#include "core/shading/materials.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include <peeler/error.h>
#include "core/scene/material.h"

namespace peeler::test {
namespace {

std::string featuresOf(const Material& material) {
    std::string names;
    for (const MaterialFeature& feature : materialFeatures())
        if (feature.used(material))
            names += std::string(names.empty() ? "" : " ") + feature.definition;
    return names;
}

TEST(MaterialRecord, NeedsNoMoreThanTheMaterialUses) {
    Material m;
    EXPECT_EQ(featuresOf(m), "");
    m.clearcoat.factor = 0.1F;
    EXPECT_EQ(featuresOf(m), "CLEARCOAT");
    m.ior = 1.4F;
    EXPECT_EQ(featuresOf(m), "SPECULAR CLEARCOAT");
    m.specular_glossiness.emplace();
    EXPECT_EQ(featuresOf(m), "SPECULAR_GLOSSINESS CLEARCOAT");
    Material all;
    all.specular.color.r = 0.5F;
    all.sheen.color.b = 0.1F;
    all.anisotropy.strength = all.iridescence.factor = all.transmission.factor = 1;
    EXPECT_EQ(featuresOf(all), "SPECULAR SHEEN ANISOTROPY IRIDESCENCE TRANSMISSION");
}

TEST(MaterialRecord, HasTheReflectanceOfTheIndexOfRefraction) {
    EXPECT_FLOAT_EQ(dielectricF0(1.5F), 0.04F);
    EXPECT_FLOAT_EQ(dielectricF0(1), 0);
    EXPECT_EQ(dielectricF0(0), 1);
}

TEST(MaterialRecord, KnowsEveryTextureOnce) {
    Material m;
    m.specular_glossiness.emplace();
    std::vector<TextureRef*> seen;
    for (const MaterialTexture& texture : texturesOf(m)) {
        EXPECT_EQ(std::count(seen.begin(), seen.end(), texture.ref), 0);
        seen.push_back(texture.ref);
        texture.ref->image = 3;
    }
    EXPECT_EQ(m.base_color_texture.image, 3);
    EXPECT_EQ(m.specular_glossiness->texture.image, 3);
    // Specular-glossiness replaces metallic-roughness.
    EXPECT_EQ(m.metallic_roughness_texture.image, -1);
    const shader::MaterialRecord record = materialRecord(m);
    for (unsigned unit = 0; unit < PEELER_MATERIAL_UNITS; ++unit)
        EXPECT_TRUE(record.flags.x & (PEELER_FIRST_TEXTURE_BIT << unit)) << unit;
}

TEST(MaterialRecord, RefusesMoreTexturesThanTheDeviceTakes) {
    Material m;
    EXPECT_NO_THROW(checkTextureUnits(m, 16));
    for (const MaterialTexture& texture : texturesOf(m))
        texture.ref->image = 0;
    EXPECT_NO_THROW(checkTextureUnits(m, 32));
    try {
        checkTextureUnits(m, 16);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kDevice);
    }
}

}  // namespace
}  // namespace peeler::test
