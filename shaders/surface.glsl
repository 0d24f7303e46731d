// SPDX-License-Identifier: Apache-2.0
// The material at a fragment: its textures, base colour and alpha (glTF 2.0 §3.9).
#include "fragment.glsl"

layout(std140, binding = PEELER_MATERIAL_BLOCK) uniform MaterialBlock { MaterialRecord material; };

#ifdef TEXTURED
layout(binding = PEELER_BASE_COLOR_UNIT) uniform sampler2D base_color_texture;
layout(binding = PEELER_METALLIC_ROUGHNESS_UNIT) uniform sampler2D metallic_roughness_texture;
layout(binding = PEELER_NORMAL_UNIT) uniform sampler2D normal_texture;
layout(binding = PEELER_OCCLUSION_UNIT) uniform sampler2D occlusion_texture;
layout(binding = PEELER_EMISSIVE_UNIT) uniform sampler2D emissive_texture;
#endif

#ifdef TRACED
struct Surface
#else
layout(location = PEELER_SURFACE) in Surface
#endif
{
    vec3 position;
    vec3 normal;
    vec4 tangent;
    vec4 texcoords;
    vec4 color;
#ifdef TRACED
} surface = Surface(vec3(0.0), vec3(0.0), vec4(0.0), vec4(0.0), vec4(0.0));  // set by shade_hits.comp
bool on_front = true;
vec3 toward_eye = vec3(0.0);
#ifdef SEVERAL_SAMPLES  // textures are filtered at each sample that shows the surface
vec2 sample_offset[4] = vec2[4](vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0));  // from the hit, in pixels, y up
float sample_weight[4] = float[4](0.25, 0.25, 0.25, 0.25);
#endif
#define world_from_view mat3(frame.world_from_view)
#define material_color material.base_color
#define material_emissive material.emissive
#define material_factors material.factors
#else
} surface;
layout(location = PEELER_WORLD_FROM_VIEW) flat in mat3 world_from_view;
layout(location = PEELER_MATERIAL_COLOR) flat in vec4 material_color;
layout(location = PEELER_MATERIAL_EMISSIVE) flat in vec4 material_emissive;
layout(location = PEELER_MATERIAL_FACTORS) flat in vec4 material_factors;
#define on_front gl_FrontFacing
#endif

/// Screen-space derivatives. They are undefined after a discard or in divergent control flow, so
/// every shader computes them first. The shader samples textures with these explicit gradients, so
/// that every pass reads the same texels.
struct Gradients {
    vec4 texcoords_dx, texcoords_dy;
    vec3 position_dx, position_dy;
};

#ifndef TRACED
Gradients surfaceGradients() {
    return Gradients(dFdx(surface.texcoords), dFdy(surface.texcoords), dFdx(surface.position),
                     dFdy(surface.position));
}
#endif

// Draw and material flags are compiled into the variant instead of being read from the records.
// llvmpipe would run both sides of a branch on a record's flags.
bool hasTexture(int unit) {
    return (MATERIAL_FLAGS & (PEELER_FIRST_TEXTURE_BIT << uint(unit))) != 0u;
}

bool hasTransform(int unit) { return (TRANSFORMED_TEXTURES & (1u << uint(unit))) != 0u; }
bool hasSecondUv(int unit) { return (SECOND_UV_TEXTURES & (1u << uint(unit))) != 0u; }

/// Samples a texture of the material. Gives ones if there is no texture.
#ifdef TEXTURED
#define TEXEL(map, unit) (hasTexture(unit) ? sampled(map, unit, g) : vec4(1.0))
#else
#define TEXEL(map, unit) vec4(1.0)
#endif

/// Transforms a UV slope to the texture's own coordinates, by the linear part of KHR_texture_transform.
vec2 transformedSlope(int unit, vec2 slope) {
    precise vec2 own = vec2(dot(material.texture_transform[2 * unit].xy, slope),
                            dot(material.texture_transform[2 * unit + 1].xy, slope));
    return own;
}

#ifdef TEXTURED
/// Returns the texture at an offset from the fragment, in pixels, y up.
vec4 sampledAt(sampler2D map, int unit, vec2 offset, Gradients g) {
    vec2 uv = hasSecondUv(unit) ? surface.texcoords.zw : surface.texcoords.xy;
    vec2 dx = hasSecondUv(unit) ? g.texcoords_dx.zw : g.texcoords_dx.xy;
    vec2 dy = hasSecondUv(unit) ? g.texcoords_dy.zw : g.texcoords_dy.xy;
#ifdef SEVERAL_SAMPLES
    uv += offset.x * dx + offset.y * dy;
#endif
    if (!hasTransform(unit)) return textureGrad(map, uv, dx, dy);
    vec3 row0 = material.texture_transform[2 * unit].xyz, row1 = material.texture_transform[2 * unit + 1].xyz;
    precise vec2 at = vec2(dot(row0, vec3(uv, 1.0)), dot(row1, vec3(uv, 1.0)));
    return textureGrad(map, at, transformedSlope(unit, dx), transformedSlope(unit, dy));
}

vec4 sampled(sampler2D map, int unit, Gradients g) {
#ifdef SEVERAL_SAMPLES
    vec4 mean = vec4(0.0);
    for (int i = 0; i < 4; ++i) mean += sample_weight[i] * sampledAt(map, unit, sample_offset[i], g);
    return mean;
#else
    return sampledAt(map, unit, vec2(0.0), g);
#endif
}
#endif

/// Returns the base colour with straight alpha. For OPAQUE and MASK materials, the alpha serves only the alpha test;
/// their coverage() is 1.
vec4 baseColor(Gradients g) {
    precise vec4 color = material_color;
#ifdef TEXTURED
    if (hasTexture(PEELER_BASE_COLOR_UNIT))
        color *= sampled(base_color_texture, PEELER_BASE_COLOR_UNIT, g);
#endif
    if ((DRAW_FLAGS & PEELER_HAS_COLORS) != 0u) color *= surface.color;
    return color;
}

vec3 emissiveColor(Gradients g) { return material_emissive.rgb * TEXEL(emissive_texture, PEELER_EMISSIVE_UNIT).rgb; }

/// Returns roughness and metallic, both 0 to 1.
vec2 roughnessMetallic(Gradients g) {
    vec4 texel = TEXEL(metallic_roughness_texture, PEELER_METALLIC_ROUGHNESS_UNIT);
#ifdef SPECULAR_GLOSSINESS
    return vec2(clamp(1.0 - material.specular.a * texel.a, 0.0, 1.0), 0.0);
#else
    return clamp(vec2(material_factors.y * texel.g, material_factors.x * texel.b), 0.0, 1.0);
#endif
}

/// Whether a fragment passes the alpha test: alpha at or above the cutoff for MASK materials, above 0 for BLEND
/// materials.
bool passesAlphaTest(float alpha) {
    if ((MATERIAL_FLAGS & PEELER_ALPHA_MASK) != 0u) return alpha >= material_emissive.w;
    if ((MATERIAL_FLAGS & PEELER_ALPHA_BLEND) != 0u) return alpha > 0.0;
    return true;
}

/// Returns the alpha for compositing: 1 for OPAQUE and MASK materials.
float coverage(float alpha) {
    return (MATERIAL_FLAGS & PEELER_ALPHA_BLEND) != 0u ? clamp(alpha, 0.0, 1.0) : 1.0;
}
