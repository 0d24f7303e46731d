// SPDX-License-Identifier: Apache-2.0
// Light that passes through a surface (KHR_materials_transmission, KHR_materials_volume), as a layer can hold it.
//
// What passes is the transmission times the tint: the base colour, times what a volume leaves of white light. With TINTED
// a layer has an opacity a channel, 1 less what passes there, and coloured glass filters what is behind it; the light that
// is transmitted, whatever becomes of it, is not diffused.
//
// With one alpha a layer cannot filter colour by colour, and grey glass need not: what passes is the transmission times
// the mean of the tint; that share is taken off alpha and off the diffuse light. So white glass of transmission 1 has
// alpha 0, and coloured glass veils what is behind it with its colour.
//
// Reflections stay at full strength. There is no refraction.
#include "surface.glsl"

#ifdef TEXTURED
layout(binding = PEELER_TRANSMISSION_UNIT) uniform sampler2D transmission_texture;
layout(binding = PEELER_THICKNESS_UNIT) uniform sampler2D thickness_texture;
#endif

layout(location = PEELER_MESH_SCALE) flat in float mesh_scale;

/// Light that a volume leaves of white light (Beer & Lambert). Its thickness is in mesh space.
vec3 attenuation(Gradients g) {
    float thickness = material.transmission.y * TEXEL(thickness_texture, PEELER_THICKNESS_UNIT).g * mesh_scale;
    vec3 left = max(material.attenuation.rgb, 1e-6);  // pow(0, 0) is undefined
    return pow(left, vec3(thickness * material.transmission.z));
}

/// Whether the surface's opacity is its own in every channel.
bool isTintedGlass() {
#if defined(TINTED) && defined(TINTED_GLASS)
    return true;
#elif defined(TINTED)
    return (DRAW_FLAGS & PEELER_HAS_COLORS) != 0u;
#else
    return false;
#endif
}

/// Metals let no light through.
float metalness(Gradients g) {
#ifdef SPECULAR_GLOSSINESS
    return 0.0;
#else
    return material_factors.x * TEXEL(metallic_roughness_texture, PEELER_METALLIC_ROUGHNESS_UNIT).b;
#endif
}

/// The share of light that is transmitted, before it is tinted.
float transmittedShare(Gradients g) {
    return material.transmission.x * TEXEL(transmission_texture, PEELER_TRANSMISSION_UNIT).r;
}

/// Of light from behind, what passes of each channel where `share` is transmitted.
vec3 passingColors(vec3 base, float share, Gradients g) {
    if (material.transmission.z > 0.0) base *= attenuation(g);
    return clamp(share * (1.0 - metalness(g)) * clamp(base, 0.0, 1.0), 0.0, 1.0);
}

/// Tints the base colour by the volume, and returns the share of light that passes.
float passingLight(inout vec3 base, Gradients g) {
    if (material.transmission.z > 0.0) base *= attenuation(g);
    vec3 tint = clamp(base, 0.0, 1.0);
    return clamp(transmittedShare(g) * (1.0 - metalness(g)) * (tint.r + tint.g + tint.b) / 3.0, 0.0, 1.0);
}
