// SPDX-License-Identifier: Apache-2.0
// The material at a fragment: textures, alpha, the normal. glTF 2.0 §3.9.
#include "fragment.glsl"

layout(std140, binding = PEELER_MATERIAL_BLOCK) uniform MaterialBlock { MaterialRecord material; };

#ifdef TEXTURED
layout(binding = PEELER_BASE_COLOR_UNIT) uniform sampler2D base_color_texture;
layout(binding = PEELER_METALLIC_ROUGHNESS_UNIT) uniform sampler2D metallic_roughness_texture;
layout(binding = PEELER_NORMAL_UNIT) uniform sampler2D normal_texture;
layout(binding = PEELER_OCCLUSION_UNIT) uniform sampler2D occlusion_texture;
layout(binding = PEELER_EMISSIVE_UNIT) uniform sampler2D emissive_texture;
#endif

in Surface {
    vec3 position;
    vec3 normal;
    vec4 tangent;
    vec4 texcoords;
    vec4 color;
} surface;

/// Screen-space derivatives. They are undefined after a discard or in divergent flow, so every shader
/// takes them first, and textures are sampled with explicit gradients: the same texel in every pass.
struct Gradients {
    vec4 texcoords_dx, texcoords_dy;
    vec3 position_dx, position_dy;
};

Gradients surfaceGradients() {
    return Gradients(dFdx(surface.texcoords), dFdy(surface.texcoords), dFdx(surface.position),
                     dFdy(surface.position));
}

bool hasTexture(int unit) {
    return (material.flags.x & (PEELER_FIRST_TEXTURE_BIT << uint(unit))) != 0u;
}

#ifdef TEXTURED
vec4 sampled(sampler2D map, int unit, Gradients g) {
    vec4 row0 = material.texture_transform[2 * unit];
    vec3 row1 = material.texture_transform[2 * unit + 1].xyz;
    bool second = row0.w != 0.0;
    vec2 uv = second ? surface.texcoords.zw : surface.texcoords.xy;
    vec2 dx = second ? g.texcoords_dx.zw : g.texcoords_dx.xy;
    vec2 dy = second ? g.texcoords_dy.zw : g.texcoords_dy.xy;
    precise vec2 at = vec2(dot(row0.xyz, vec3(uv, 1.0)), dot(row1, vec3(uv, 1.0)));
    precise vec2 at_dx = vec2(dot(row0.xy, dx), dot(row1.xy, dx));
    precise vec2 at_dy = vec2(dot(row0.xy, dy), dot(row1.xy, dy));
    return textureGrad(map, at, at_dx, at_dy);
}
#endif

/// Base colour, straight alpha. OPAQUE and MASK materials have alpha 1 (after the test).
vec4 baseColor(Gradients g) {
    precise vec4 color = material.base_color;
#ifdef TEXTURED
    if (hasTexture(PEELER_BASE_COLOR_UNIT))
        color *= sampled(base_color_texture, PEELER_BASE_COLOR_UNIT, g);
#endif
    if ((draw.ids.z & PEELER_HAS_COLORS) != 0u) color *= surface.color;
    return color;
}

/// The alpha test of MASK materials, and alpha exactly 0 of BLEND ones.
bool passesAlphaTest(float alpha) {
    if ((material.flags.x & PEELER_ALPHA_MASK) != 0u) return alpha >= material.emissive.w;
    if ((material.flags.x & PEELER_ALPHA_BLEND) != 0u) return alpha > 0.0;
    return true;
}

/// Alpha as it is composited.
float coverage(float alpha) {
    return (material.flags.x & PEELER_ALPHA_BLEND) != 0u ? clamp(alpha, 0.0, 1.0) : 1.0;
}

/// Unit shading normal in view space, on the side of the viewer's face: a back face has the opposite of
/// the front face's normal, bumps and all (glTF 2.0 §3.9.6).
vec3 shadingNormal(Gradients g) {
    vec3 facet = cross(g.position_dx, g.position_dy);  // toward the viewer, whatever the winding
    vec3 normal = dot(facet, facet) > 0.0 ? normalize(facet) : vec3(0.0, 0.0, 1.0);
    float side = gl_FrontFacing ? 1.0 : -1.0;
    if ((draw.ids.z & PEELER_HAS_NORMALS) != 0u && dot(surface.normal, surface.normal) > 0.0) {
        normal = side * normalize(surface.normal);
    }
#ifdef TEXTURED
    if (hasTexture(PEELER_NORMAL_UNIT)) {
        vec3 mapped = sampled(normal_texture, PEELER_NORMAL_UNIT, g).xyz * 2.0 - 1.0;
        mapped.xy *= material.factors.z;
        vec3 tangent, bitangent;
        if ((draw.ids.z & PEELER_HAS_TANGENTS) != 0u) {
            float size = dot(surface.tangent.xyz, surface.tangent.xyz);  // the node may scale it
            tangent = surface.tangent.xyz * (size > 0.0 ? side * inversesqrt(size) : 0.0);
            bitangent = side * cross(normal, tangent) * surface.tangent.w;
        } else {
            // Tangent frame from derivatives (Schüler, "Followup: Normal Mapping Without Precomputed
            // Tangents", 2013).
            bool second = material.texture_transform[2 * PEELER_NORMAL_UNIT].w != 0.0;
            vec2 dx = second ? g.texcoords_dx.zw : g.texcoords_dx.xy;
            vec2 dy = second ? g.texcoords_dy.zw : g.texcoords_dy.xy;
            vec3 across_y = cross(g.position_dy, normal), across_x = cross(normal, g.position_dx);
            tangent = across_y * dx.x + across_x * dy.x;
            // glTF's V runs down the image while its normal maps point +Y up the image.
            bitangent = -(across_y * dx.y + across_x * dy.y);
            float scale = max(dot(tangent, tangent), dot(bitangent, bitangent));
            // An interpolated normal may lean away from the viewer, and the frame turns with it.
            float facing = dot(normal, facet) < 0.0 ? -side : side;
            tangent *= scale > 0.0 ? facing * inversesqrt(scale) : 0.0;
            bitangent *= scale > 0.0 ? facing * inversesqrt(scale) : 0.0;
        }
        vec3 bent = tangent * mapped.x + bitangent * mapped.y + normal * mapped.z;
        if (dot(bent, bent) > 0.0) normal = normalize(bent);
    }
#endif
    return normal;
}
