// SPDX-License-Identifier: Apache-2.0
// Light transmitted by a surface (KHR_materials_transmission, KHR_materials_volume), in a form that a layer can hold.
//
// The transmitted light is the transmission times the tint. The tint is the base colour times the volume's
// transmittance for white light. With TINTED, a layer has an opacity per channel, 1 minus the transmitted fraction, so
// coloured glass filters the light from behind. The transmitted share of light is not reflected diffusely, even if the
// glass absorbs it.
//
// Without TINTED, or for grey glass, a layer has a single alpha and does not filter per channel. The transmitted
// fraction is then the transmission times the mean tint, and reduces alpha and the diffuse light. So white glass of
// transmission 1 has alpha 0, and coloured glass veils the surfaces behind it with its colour.
//
// Reflections keep their full strength. There is no refraction.
#include "surface.glsl"

#ifdef TEXTURED
layout(binding = PEELER_TRANSMISSION_UNIT) uniform sampler2D transmission_texture;
layout(binding = PEELER_THICKNESS_UNIT) uniform sampler2D thickness_texture;
#endif

#ifdef TRACED
float mesh_scale = 1.0;  // set by shade_hits.comp
#else
layout(location = PEELER_MESH_SCALE) flat in float mesh_scale;
#endif

/// Returns the volume's transmittance for white light (Beer-Lambert law). The volume's thickness is in mesh space.
vec3 attenuation(Gradients g) {
    float thickness = material.transmission.y * TEXEL(thickness_texture, PEELER_THICKNESS_UNIT).g * mesh_scale;
    vec3 left = max(material.attenuation.rgb, 1e-6);  // pow(0, 0) is undefined
    return pow(left, vec3(thickness * material.transmission.z));
}

/// Whether the surface has different opacities per channel.
bool isTintedGlass() {
#if defined(TINTED) && defined(TINTED_GLASS)
    return true;
#elif defined(TINTED)
    return (DRAW_FLAGS & PEELER_HAS_COLORS) != 0u;
#else
    return false;
#endif
}

/// Returns the metalness. Metals transmit no light.
float metalness(Gradients g) {
#ifdef SPECULAR_GLOSSINESS
    return 0.0;
#else
    return material_factors.x * TEXEL(metallic_roughness_texture, PEELER_METALLIC_ROUGHNESS_UNIT).b;
#endif
}

/// Returns the transmitted fraction of light before tinting.
float transmittedShare(Gradients g) {
    return material.transmission.x * TEXEL(transmission_texture, PEELER_TRANSMISSION_UNIT).r;
}

/// Returns, for each channel, the fraction of light from behind that passes. `share` is the
/// transmitted fraction before tinting.
vec3 passingColors(vec3 base, float share, Gradients g) {
    if (material.transmission.z > 0.0) base *= attenuation(g);
    return clamp(share * (1.0 - metalness(g)) * clamp(base, 0.0, 1.0), 0.0, 1.0);
}

/// Multiplies the base colour by the volume's tint, and returns the transmitted fraction of light.
float passingLight(inout vec3 base, Gradients g) {
    if (material.transmission.z > 0.0) base *= attenuation(g);
    vec3 tint = clamp(base, 0.0, 1.0);
    return clamp(transmittedShare(g) * (1.0 - metalness(g)) * (tint.r + tint.g + tint.b) / 3.0, 0.0, 1.0);
}
