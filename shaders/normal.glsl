// SPDX-License-Identifier: Apache-2.0
// Normals at a fragment, in view space, on the viewer's side. The normal of a back face is the
// opposite of the front face's normal, after normal mapping (glTF 2.0 §3.9.6).
#include "surface.glsl"

#if defined(CLEARCOAT) && defined(TEXTURED)
layout(binding = PEELER_CLEARCOAT_NORMAL_UNIT) uniform sampler2D clearcoat_normal_texture;
#endif

/// Returns the facet's normal on the viewer's side, for either winding order of the triangle. The
/// result is not normalised.
vec3 facetNormal(Gradients g) { return cross(g.position_dx, g.position_dy); }

/// Returns the normal without a normal map.
vec3 geometricNormal(Gradients g) {
    vec3 facet = facetNormal(g);
    if ((DRAW_FLAGS & PEELER_HAS_NORMALS) != 0u && dot(surface.normal, surface.normal) > 0.0)
        return (on_front ? 1.0 : -1.0) * normalize(surface.normal);
    return dot(facet, facet) > 0.0 ? normalize(facet) : vec3(0.0, 0.0, 1.0);
}

#if defined(TEXTURED) || defined(ANISOTROPY) || defined(CHANNEL_TANGENT)
/// Returns the directions of U and V (V up the image) in the plane perpendicular to `normal`; 0 if
/// texture coordinates do not define them. If the mesh has no tangents, the coordinates of the
/// texture `unit` define the directions, after KHR_texture_transform, since glTF 2.0 §3.7.2.1
/// requires "the texture coordinates associated with the normal texture". If the mesh has tangents,
/// they are used unchanged, since no specification transforms them. In both cases, Khronos' sample
/// renderer (getNormalInfo) and three.js (getTangentFrame) do the same.
void tangentFrame(vec3 normal, int unit, Gradients g, out vec3 tangent, out vec3 bitangent) {
    float side = on_front ? 1.0 : -1.0;
    if ((DRAW_FLAGS & PEELER_HAS_TANGENTS) != 0u) {
        float size = dot(surface.tangent.xyz, surface.tangent.xyz);  // the node may scale the tangent
        tangent = surface.tangent.xyz * (size > 0.0 ? side * inversesqrt(size) : 0.0);
        bitangent = side * cross(normal, tangent) * surface.tangent.w;
        return;
    }
    // Computes the directions from screen-space derivatives (Schüler, "Followup: Normal Mapping Without Precomputed
    // Tangents", 2013).
    bool second = hasSecondUv(unit);
    vec2 dx = second ? g.texcoords_dx.zw : g.texcoords_dx.xy;
    vec2 dy = second ? g.texcoords_dy.zw : g.texcoords_dy.xy;
    if (hasTransform(unit)) dx = transformedSlope(unit, dx), dy = transformedSlope(unit, dy);
    vec3 across_y = cross(g.position_dy, normal), across_x = cross(normal, g.position_dx);
    tangent = across_y * dx.x + across_x * dy.x;
    // In glTF, V runs down the image, but the Y axis of normal maps points up the image.
    bitangent = -(across_y * dx.y + across_x * dy.y);
    float scale = max(dot(tangent, tangent), dot(bitangent, bitangent));
    // If the interpolated normal points away from the viewer, flip the tangent frame.
    float facing = dot(normal, facetNormal(g)) < 0.0 ? -side : side;
    tangent *= scale > 0.0 ? facing * inversesqrt(scale) : 0.0;
    bitangent *= scale > 0.0 ? facing * inversesqrt(scale) : 0.0;
}
#endif

#ifdef TEXTURED
vec3 mappedNormal(vec3 normal, sampler2D map, int unit, float scale, Gradients g) {
    vec3 mapped = sampledAt(map, unit, vec2(0.0), g).xyz * 2.0 - 1.0;
    mapped.xy *= scale;
    vec3 tangent, bitangent;
    tangentFrame(normal, unit, g, tangent, bitangent);
    vec3 bent = tangent * mapped.x + bitangent * mapped.y + normal * mapped.z;
    return dot(bent, bent) > 0.0 ? normalize(bent) : normal;
}
#endif

/// Returns the unit shading normal.
vec3 shadingNormal(Gradients g) {
    vec3 normal = geometricNormal(g);
#ifdef TEXTURED
    if (hasTexture(PEELER_NORMAL_UNIT))
        normal = mappedNormal(normal, normal_texture, PEELER_NORMAL_UNIT, material_factors.z, g);
#endif
    return normal;
}

#ifdef CLEARCOAT
/// Returns the clearcoat's normal, without the normal map of the surface below the clearcoat.
vec3 clearcoatNormal(Gradients g) {
    vec3 normal = geometricNormal(g);
#ifdef TEXTURED
    if (hasTexture(PEELER_CLEARCOAT_NORMAL_UNIT)) {
        normal = mappedNormal(normal, clearcoat_normal_texture, PEELER_CLEARCOAT_NORMAL_UNIT, material.clearcoat.z, g);
    }
#endif
    return normal;
}
#endif
