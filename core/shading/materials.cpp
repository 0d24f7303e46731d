// SPDX-License-Identifier: Apache-2.0
#include "core/shading/materials.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <peeler/error.h>
#include "core/base/color.h"
#include "core/base/parallel.h"
#include "core/scene/material.h"

namespace peeler {
namespace {

static_assert(kMaterialTextures == PEELER_MATERIAL_UNITS);

constexpr MaterialFeature kFeatures[] = {
    // Changes alpha, because metals transmit no light: with this feature, a transmissive material
    // counts as non-metallic, whatever its metallic factor and texture are.
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
    {"TINTED_GLASS", isTintedGlass, true},
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
    // The texture units for other uses: shadow maps (1), environment, irradiance, albedo and lobe
    // tables (4), and the previous layer and opaque bound of peel_layer.frag (4).
    constexpr int kOthers = 9;
    int used = 0;
    for (const MaterialTexture& texture : texturesOf(material))
        used += *texture.ref ? 1 : 0;
    if (used + kOthers <= units || used <= 5) return;
    throw Error(ErrorKind::kDevice,
                "a material uses " + std::to_string(used) + " textures, but the GL device takes " +
                    std::to_string(units) + " in a shader, including " + std::to_string(kOthers) +
                    " reserved ones",
                material.name,
                "render on another device (see " + Parameter::kListDevices + "), or use " +
                    Parameter::kBackend + " osmesa");
}

namespace {

struct Tables {
    std::array<float, 256> decode{};
    // Encoded byte for each linear value, in steps of 1/4096.
    std::array<std::uint8_t, 4097> encode{};
};

Tables makeTables(bool srgb) {
    Tables tables;
    for (std::size_t i = 0; i < tables.decode.size(); ++i) {
        const float v = static_cast<float>(i) / 255;
        tables.decode[i] = srgb ? linearFromSrgb(v) : v;
    }
    for (std::size_t i = 0; i < tables.encode.size(); ++i) {
        const float v = static_cast<float>(i) / 4096;
        tables.encode[i] =
            static_cast<std::uint8_t>(std::lround(255 * (srgb ? srgbFromLinear(v) : v)));
    }
    return tables;
}

const Tables& tables(bool srgb) {
    static const Tables srgb_tables = makeTables(true), linear_tables = makeTables(false);
    return srgb ? srgb_tables : linear_tables;
}

// Adding 0.5 and truncating rounds; std::lround would take longer than the rest of a level.
constexpr float kHalf = 0.5F;

/// Up to three source texels of one destination texel, with weights that add up to 1.
struct Taps {
    std::array<int, 3> at{};
    std::array<float, 3> weight{};
};

std::vector<Taps> taps(int source, int destination) {
    std::vector<Taps> all(static_cast<std::size_t>(destination));
    const double scale = static_cast<double>(source) / destination;
    for (int i = 0; i < destination; ++i) {
        const double begin = i * scale, end = (i + 1) * scale;
        for (int t = 0; t < 3; ++t) {
            const int texel = static_cast<int>(begin) + t;
            const double overlap = std::min(end, texel + 1.0) - std::max(begin, double(texel));
            all[static_cast<std::size_t>(i)].at[static_cast<std::size_t>(t)] =
                std::min(texel, source - 1);
            all[static_cast<std::size_t>(i)].weight[static_cast<std::size_t>(t)] =
                static_cast<float>(std::max(0.0, overlap) / scale);
        }
    }
    return all;
}

/// halved() of an image with even sides: each texel is the mean of four.
void halveEvenly(const Image& image, bool srgb, Image& out) {
    const Tables& color = tables(srgb);
    const Tables& plain = tables(false);
    const auto width = static_cast<std::size_t>(out.width), line = 8 * width;
    parallelFor(static_cast<std::size_t>(out.height), [&](std::size_t y) {
        const std::uint8_t* upper = image.rgba.data() + 2 * y * line;
        const std::uint8_t* lower = upper + line;
        std::uint8_t* to = out.rgba.data() + y * width * 4;
        const std::uint8_t* const end = to + width * 4;
        const auto average = [&](const Tables& table, std::size_t c) {
            const float sum = table.decode[upper[c]] + table.decode[upper[c + 4]] +
                              table.decode[lower[c]] + table.decode[lower[c + 4]];
            to[c] = table.encode[static_cast<std::uint32_t>(sum * 1024 + kHalf)];
        };
        for (; to != end; to += 4, upper += 8, lower += 8) {
            for (std::size_t c = 0; c < 3; ++c)
                average(color, c);
            average(plain, 3);
        }
    });
}

}  // namespace

int mipmapLevels(int width, int height) {
    int levels = 1;
    while ((std::max(width, height) >> levels) > 0)
        ++levels;
    return levels;
}

Image halved(const Image& image, bool srgb) {
    Image out;
    out.width = std::max(1, image.width / 2);
    out.height = std::max(1, image.height / 2);
    out.rgba.resize(static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height) * 4);
    if (image.width % 2 == 0 && image.height % 2 == 0) {
        halveEvenly(image, srgb, out);
        return out;
    }
    const auto columns = taps(image.width, out.width), rows = taps(image.height, out.height);
    const Tables& color = tables(srgb);
    const Tables& plain = tables(false);
    parallelFor(rows.size(), [&](std::size_t y) {
        std::uint8_t* to = out.rgba.data() + y * static_cast<std::size_t>(out.width) * 4;
        for (const Taps& column : columns) {
            std::array<float, 4> sum{};
            for (std::size_t j = 0; j < 3; ++j) {
                if (rows[y].weight[j] == 0) continue;
                const std::uint8_t* row =
                    image.rgba.data() + static_cast<std::size_t>(rows[y].at[j]) *
                                            static_cast<std::size_t>(image.width) * 4;
                for (std::size_t i = 0; i < 3; ++i) {
                    const float weight = rows[y].weight[j] * column.weight[i];
                    if (weight == 0) continue;
                    const std::uint8_t* texel = row + static_cast<std::size_t>(column.at[i]) * 4;
                    for (std::size_t c = 0; c < 3; ++c)
                        sum[c] += weight * color.decode[texel[c]];
                    sum[3] += weight * plain.decode[texel[3]];
                }
            }
            for (std::size_t c = 0; c < 4; ++c) {
                const auto step = static_cast<std::size_t>(std::min(1.0F, sum[c]) * 4096 + kHalf);
                *to++ = (c < 3 ? color : plain).encode[step];
            }
        }
    });
    return out;
}

}  // namespace peeler
