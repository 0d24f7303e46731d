// SPDX-License-Identifier: Apache-2.0
#include "core/shading/material_record.h"

#include <cmath>

#include "core/base/error.h"

namespace peeler {
namespace {

static_assert(kMaterialTextures == PEELER_MATERIAL_UNITS);

constexpr MaterialFeature kFeatures[] = {
    // Without metalness it lets light through whatever its colour.
    {"SPECULAR_GLOSSINESS", [](const Material& m) { return m.specular_glossiness.has_value(); },
     true},
    {"SPECULAR",
     [](const Material& m) {
         const Specular& s = m.specular;
         return !m.specular_glossiness && (m.ior != 1.5F || s.factor != 1 ||
                                           s.color != glm::vec3(1) || s.texture || s.color_texture);
     }},
    {"CLEARCOAT", [](const Material& m) { return m.clearcoat.factor > 0; }},
    {"SHEEN", [](const Material& m) { return m.sheen.color != glm::vec3(0); }},
    {"ANISOTROPY", [](const Material& m) { return m.anisotropy.strength > 0; }},
    {"IRIDESCENCE", [](const Material& m) { return m.iridescence.factor > 0; }},
    {"TRANSMISSION", isTransmissive, true},
};

}  // namespace

std::span<const MaterialFeature> materialFeatures() {
    return kFeatures;
}

shader::MaterialRecord materialRecord(const Material& source) {
    Material m = source;
    shader::MaterialRecord r{};
    r.base_color = m.base_color;
    r.emissive = glm::vec4(m.emissive, m.alpha_cutoff);
    r.factors = {m.metallic, m.roughness, m.normal_scale, m.occlusion_strength};
    r.specular = glm::vec4(m.specular.color, m.specular.factor);
    if (m.specular_glossiness)
        r.specular = glm::vec4(m.specular_glossiness->specular, m.specular_glossiness->glossiness);
    r.clearcoat = {m.clearcoat.factor, m.clearcoat.roughness, m.clearcoat.normal_scale, 0};
    r.sheen = glm::vec4(m.sheen.color, m.sheen.roughness);
    r.anisotropy = {m.anisotropy.strength, std::cos(m.anisotropy.rotation),
                    std::sin(m.anisotropy.rotation), 0};
    r.iridescence = {m.iridescence.factor, m.iridescence.ior, m.iridescence.thickness_min,
                     m.iridescence.thickness_max};
    if (!m.iridescence.thickness_texture) r.iridescence.z = m.iridescence.thickness_max;
    const Transmission& t = m.transmission;
    r.transmission = {
        t.factor, t.thickness,
        t.thickness > 0 && t.attenuation_distance > 0 ? 1 / t.attenuation_distance : 0,
        dielectricF0(m.ior)};
    r.attenuation = glm::vec4(t.attenuation_color, 0);

    std::uint32_t flags = m.unlit ? PEELER_UNLIT : 0U;
    if (m.alpha_mode == AlphaMode::kMask) flags |= PEELER_ALPHA_MASK;
    if (m.alpha_mode == AlphaMode::kBlend) flags |= PEELER_ALPHA_BLEND;
    const auto textures = texturesOf(m);
    for (std::size_t unit = 0; unit < textures.size(); ++unit) {
        const TextureRef& ref = *textures[unit].ref;
        if (!ref) continue;
        flags |= PEELER_FIRST_TEXTURE_BIT << unit;
        const glm::mat3 rows = glm::transpose(ref.transform);
        if (ref.transform != glm::mat3(1)) r.flags.y |= 1U << unit;
        if (ref.texcoord != 0) r.flags.z |= 1U << unit;
        r.texture_transform[2 * unit] = glm::vec4(rows[0], 0);
        r.texture_transform[2 * unit + 1] = glm::vec4(rows[1], 0);
    }
    r.flags.x = flags;
    return r;
}

void checkTextureUnits(Material material, int units) {
    // Shadow maps, an environment with its irradiance and table, and what peel_layer.frag reads
    // besides with an opaque bound.
    constexpr int kOthers = 8;
    int used = 0;
    for (const MaterialTexture& texture : texturesOf(material))
        used += *texture.ref ? 1 : 0;
    if (used + kOthers <= units || used <= 5) return;
    throw Error(ErrorKind::kDevice,
                "a material uses " + std::to_string(used) + " textures, and the GL device takes " +
                    std::to_string(units) + " in a shader, of which " + std::to_string(kOthers) +
                    " are needed otherwise",
                material.name, "render on another device (peeler devices), or --backend osmesa");
}

}  // namespace peeler
