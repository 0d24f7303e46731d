// SPDX-License-Identifier: Apache-2.0
// Environment lighting. Directions are in world space.
//
// With ENVIRONMENT, the light comes from an image prefiltered by core/shading/environment_maps. Otherwise it is built
// in: a pale floor, a bright horizon, a blue-grey dome and one large soft box around the key light, fixed in world
// space (+Y up).

#if defined(ENVIRONMENT) || defined(SHEEN)
/// The table is indexed by view cosine and roughness. It holds scale and bias of F0 (GGX), and the
/// albedo of sheen.
layout(binding = PEELER_ALBEDO_UNIT) uniform sampler2D albedo_table;

/// Returns the table's texture coordinates for these values. Values of 0 and 1 are at the centres
/// of the outermost texels.
vec2 tablePlace(float n_dot_v, float roughness) {
    vec2 size = vec2(textureSize(albedo_table, 0));
    return (vec2(n_dot_v, roughness) * (size - 1.0) + 0.5) / size;
}

vec3 tabledAlbedo(float n_dot_v, float roughness) {
    return textureLod(albedo_table, tablePlace(n_dot_v, roughness), 0.0).rgb;
}
#endif

#ifdef ENVIRONMENT
layout(binding = PEELER_ENVIRONMENT_UNIT) uniform samplerCube environment;
layout(binding = PEELER_IRRADIANCE_UNIT) uniform samplerCube environment_irradiance;

/// Returns the radiance from `direction`, averaged by a lobe of this roughness.
vec3 environmentRadiance(vec3 direction, float roughness) {
    // The inverse of levelRoughness() in core/shading/environment_maps.h.
    float level = roughness * (1.4 - 0.4 * roughness) * float(textureQueryLevels(environment) - 1);
    return textureLod(environment, direction, level).rgb;
}

/// Returns irradiance / pi on a surface with this normal.
vec3 environmentDiffuse(vec3 normal) { return textureLod(environment_irradiance, normal, 0.0).rgb; }

/// The lookups in prefiltered light for the F0 term (xy) and the F90 term (zw), from lobeTable() in
/// core/shading/albedo_table.h. The first number of each is the direction, as a position between
/// the normal and the mirrored view. The second number is the roughness of the level, divided by
/// the surface's roughness.
layout(binding = PEELER_LOBE_UNIT) uniform sampler2D lobe_table;

vec4 tabledLobe(float n_dot_v, float roughness) {
    return textureLod(lobe_table, tablePlace(n_dot_v, roughness), 0.0);
}

/// Returns the directional albedo of GGX as scale and bias of F0 (Karis, "Real Shading in Unreal Engine 4", 2013).
vec2 environmentBrdf(float roughness, float n_dot_v) { return tabledAlbedo(n_dot_v, roughness).xy; }

#else
const vec3 kFloor = vec3(0.26, 0.25, 0.24);
const vec3 kHorizon = vec3(0.62, 0.63, 0.65);
const vec3 kZenith = vec3(0.38, 0.44, 0.54);
const vec3 kSoftBox = vec3(1.9, 1.85, 1.75);

vec3 environmentRadiance(vec3 direction, float roughness) {
    float blur = mix(0.08, 1.0, roughness);
    vec3 above = mix(kHorizon, kZenith, smoothstep(0.0, 1.0, max(direction.y, 0.0)));
    vec3 radiance = mix(kFloor, above, smoothstep(-blur, blur, direction.y));
    float box = dot(direction, kKeyDirection);
    float edge = mix(0.86, 0.55, roughness), width = mix(0.02, 0.45, roughness);
    return radiance + kSoftBox * smoothstep(edge - width, edge + width, box) * mix(1.0, 0.35, roughness);
}

vec3 environmentDiffuse(vec3 normal) {
    float up = 0.5 + 0.5 * normal.y;
    vec3 dome = mix(kFloor, mix(kHorizon, kZenith, 0.45), smoothstep(0.0, 1.0, up));
    return dome + 0.12 * kSoftBox * max(0.0, 0.3 + 0.7 * dot(normal, kKeyDirection));
}

/// Approximates the directional albedo of GGX by the fit of Karis, "Physically Based Shading on Mobile", 2014.
vec2 environmentBrdf(float roughness, float n_dot_v) {
    const vec4 c0 = vec4(-1.0, -0.0275, -0.572, 0.022), c1 = vec4(1.0, 0.0425, 1.04, -0.04);
    vec4 r = roughness * c0 + c1;
    float a004 = min(r.x * r.x, exp2(-9.28 * n_dot_v)) * r.x + r.y;
    return vec2(-1.04, 1.04) * a004 + r.zw;
}
#endif
