// SPDX-License-Identifier: Apache-2.0
// Light that passes through a surface (KHR_materials_transmission, KHR_materials_volume), as a layer can hold it.
//
// A layer has one alpha, so it cannot filter what is behind it colour by colour. What passes is the transmission times
// the mean of the tint (base colour, times what a volume leaves of white light); that share is taken off alpha and off the
// diffuse light. So white glass of transmission 1 has alpha 0, and coloured glass veils what is behind it with its
// colour. Reflections stay at full strength. There is no refraction.
#include "surface.glsl"

#ifdef TEXTURED
layout(binding = PEELER_TRANSMISSION_UNIT) uniform sampler2D transmission_texture;
layout(binding = PEELER_THICKNESS_UNIT) uniform sampler2D thickness_texture;
#endif

flat in float mesh_scale;

/// Light that a volume leaves of white light (Beer & Lambert). Its thickness is in mesh space.
vec3 attenuation(Gradients g) {
    float thickness = material.transmission.y * TEXEL(thickness_texture, PEELER_THICKNESS_UNIT).g * mesh_scale;
    vec3 left = max(material.attenuation.rgb, 1e-6);  // pow(0, 0) is undefined
    return pow(left, vec3(thickness * material.transmission.z));
}

/// Tints the base colour by the volume, and returns the share of light that passes; metals let none through.
float passingLight(inout vec3 base, Gradients g) {
    float metallic = 0.0;
#ifndef SPECULAR_GLOSSINESS
    metallic = material_factors.x * TEXEL(metallic_roughness_texture, PEELER_METALLIC_ROUGHNESS_UNIT).b;
#endif
    if (material.transmission.z > 0.0) base *= attenuation(g);
    vec3 tint = clamp(base, 0.0, 1.0);
    float share = material.transmission.x * TEXEL(transmission_texture, PEELER_TRANSMISSION_UNIT).r;
    return clamp(share * (1.0 - metallic) * (tint.r + tint.g + tint.b) / 3.0, 0.0, 1.0);
}
