// SPDX-License-Identifier: Apache-2.0
// Material parameters: glTF 2.0 §3.9 and the KHR_materials extensions. Factors are linear.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>

#pragma GCC visibility push(default)

namespace peeler::inline v0 {

enum class AlphaMode : std::uint8_t { kOpaque, kMask, kBlend };

/// A texture sampler with the enum values of OpenGL and glTF: 9729 = GL_LINEAR, 10497 = GL_REPEAT.
struct Sampler {
    int mag_filter = 9729;
    int min_filter = 9987;
    int wrap_s = 10497;
    int wrap_t = 10497;
    bool operator==(const Sampler&) const = default;
};

/// A material's reference to a texture. uv' = transform · (u, v, 1) (KHR_texture_transform).
struct TextureRef {
    int image = -1;  ///< index into Scene::images, −1 = none
    Sampler sampler;
    int texcoord = 0;
    glm::mat3 transform{1};

    explicit operator bool() const { return image >= 0; }
};

/// KHR_materials_specular: strength and tint of dielectric reflection.
struct Specular {
    float factor = 1;
    TextureRef texture;  ///< linear; A channel
    glm::vec3 color{1};
    TextureRef color_texture;  ///< sRGB
};

/// KHR_materials_clearcoat: a thin varnish of index of refraction 1.5.
struct Clearcoat {
    float factor = 0, roughness = 0;
    TextureRef texture;            ///< linear; R channel
    TextureRef roughness_texture;  ///< linear; G channel
    TextureRef normal_texture;     ///< linear; without it, clearcoat uses the geometric normal
    float normal_scale = 1;
};

/// KHR_materials_sheen: the back-scattering of fibres.
struct Sheen {
    glm::vec3 color{0};
    float roughness = 0;
    TextureRef color_texture;      ///< sRGB
    TextureRef roughness_texture;  ///< linear; A channel
};

/// KHR_materials_anisotropy: highlights stretched along a direction.
struct Anisotropy {
    float strength = 0;
    float rotation = 0;  ///< radians, from the tangent toward the bitangent
    TextureRef texture;  ///< linear; RG = direction from −1 to 1, B = strength
};

/// KHR_materials_iridescence: a thin film.
struct Iridescence {
    float factor = 0, ior = 1.3F;
    float thickness_min = 100, thickness_max = 400;  ///< nanometres
    TextureRef texture;                              ///< linear; R channel
    TextureRef thickness_texture;                    ///< linear; G channel, from min to max
};

/// KHR_materials_transmission and KHR_materials_volume: transmitted light and its attenuation.
struct Transmission {
    float factor = 0;
    TextureRef texture;  ///< linear; R channel
    /// The thickness of the volume behind the surface, in mesh space; 0 = thin-walled.
    float thickness = 0;
    TextureRef thickness_texture;    ///< linear; G channel
    float attenuation_distance = 0;  ///< world units; 0 = infinite
    glm::vec3 attenuation_color{1};  ///< the colour of white light after `attenuation_distance`
};

/// KHR_materials_pbrSpecularGlossiness, which replaces metallic-roughness. The diffuse colour, its
/// alpha and its texture are in base_color and base_color_texture.
struct SpecularGlossiness {
    glm::vec3 specular{1};
    float glossiness = 1;
    TextureRef texture;  ///< RGB = specular, sRGB; A = glossiness, linear
};

/// A metallic-roughness material (glTF 2.0 §3.9). Extensions have no effect at their defaults.
struct Material {
    std::string name;
    glm::vec4 base_color{1};
    TextureRef base_color_texture;  ///< sRGB, alpha linear
    float metallic = 1, roughness = 1;
    TextureRef metallic_roughness_texture;  ///< linear; G = roughness, B = metallic
    TextureRef normal_texture;              ///< linear
    float normal_scale = 1;
    TextureRef occlusion_texture;  ///< linear; R channel
    float occlusion_strength = 1;
    TextureRef emissive_texture;  ///< sRGB
    glm::vec3 emissive{0};
    AlphaMode alpha_mode = AlphaMode::kOpaque;
    float alpha_cutoff = 0.5F;
    bool double_sided = false;
    bool unlit = false;

    float ior = 1.5F;  ///< KHR_materials_ior; 0 = infinite
    Specular specular;
    Clearcoat clearcoat;
    Sheen sheen;
    Anisotropy anisotropy;
    Iridescence iridescence;
    Transmission transmission;
    std::optional<SpecularGlossiness> specular_glossiness;
};

}  // namespace peeler::inline v0

#pragma GCC visibility pop
