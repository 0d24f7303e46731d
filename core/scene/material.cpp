// SPDX-License-Identifier: Apache-2.0
#include "core/scene/material.h"

namespace peeler {

std::array<MaterialTexture, kMaterialTextures> texturesOf(Material& m) {
    MaterialTexture reflectance{&m.metallic_roughness_texture, false};
    if (m.specular_glossiness) reflectance = {&m.specular_glossiness->texture, true};
    return {{{&m.base_color_texture, true},
             reflectance,
             {&m.normal_texture, false},
             {&m.occlusion_texture, false},
             {&m.emissive_texture, true},
             {&m.specular.texture, false},
             {&m.specular.color_texture, true},
             {&m.clearcoat.texture, false},
             {&m.clearcoat.roughness_texture, false},
             {&m.clearcoat.normal_texture, false},
             {&m.sheen.color_texture, true},
             {&m.sheen.roughness_texture, false},
             {&m.anisotropy.texture, false},
             {&m.iridescence.texture, false},
             {&m.iridescence.thickness_texture, false},
             {&m.transmission.texture, false},
             {&m.transmission.thickness_texture, false}}};
}

float dielectricF0(float ior) {
    if (ior == 0) return 1;
    const float ratio = (ior - 1) / (ior + 1);
    return ratio * ratio;
}

bool isTransmissive(const Material& material) {
    return material.transmission.factor > 0;
}

bool isTintedGlass(const Material& material) {
    // A metal transmits nothing, even with a transmission factor.
    const bool metal = !material.specular_glossiness && !material.metallic_roughness_texture &&
                       material.metallic >= 1;
    if (!isTransmissive(material) || metal) return false;
    const auto isGrey = [](const glm::vec3& c) { return c.r == c.g && c.g == c.b; };
    const Transmission& t = material.transmission;
    const bool volume = t.thickness > 0 && t.attenuation_distance > 0;
    return material.base_color_texture || !isGrey(glm::vec3(material.base_color)) ||
           (volume && !isGrey(t.attenuation_color));
}

}  // namespace peeler
