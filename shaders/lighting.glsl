// SPDX-License-Identifier: Apache-2.0
// The lights and the metallic-roughness BRDF (glTF 2.0, appendix B).
//
// Without lights in the scene:
//
// One key light (directional, warm white, from above, left and in front of a viewer who looks along -Z) and a soft
// environment: a studio with a pale floor, a bright horizon, a blue-grey dome and one large soft box around
// the key light. Both are fixed in world space (+Y up). A white diffuse surface that faces the
// key light comes out at about 1.
//
// With PUNCTUAL the scene has lights of its own, in photometric units: 1 lux on a white diffuse surface gives a radiance
// of 1 / pi. The key light is off then, and the environment dimmed to what fills shadows.
#include "surface.glsl"
#if defined(PUNCTUAL) || defined(SHADOWED)
#include "lights.glsl"
#endif
#ifdef SHADOWED
#include "shadows.glsl"
#endif

const float kPi = 3.14159265358979;
const vec3 kKeyDirection = PEELER_KEY_DIRECTION;
const vec3 kKeyRadiance = vec3(2.15, 2.05, 1.90);                   // irradiance at normal incidence
const vec3 kFloor = vec3(0.26, 0.25, 0.24);
const vec3 kHorizon = vec3(0.62, 0.63, 0.65);
const vec3 kZenith = vec3(0.38, 0.44, 0.54);
const vec3 kSoftBox = vec3(1.9, 1.85, 1.75);
const float kFill = 0.1;  // the environment's share beside punctual lights

/// Radiance of the environment from `direction` (world), blurred as a lobe of this roughness would.
vec3 environmentRadiance(vec3 direction, float roughness) {
    float blur = mix(0.08, 1.0, roughness);
    vec3 above = mix(kHorizon, kZenith, smoothstep(0.0, 1.0, max(direction.y, 0.0)));
    vec3 radiance = mix(kFloor, above, smoothstep(-blur, blur, direction.y));
    float box = dot(direction, kKeyDirection);
    float edge = mix(0.86, 0.55, roughness), width = mix(0.02, 0.45, roughness);
    return radiance + kSoftBox * smoothstep(edge - width, edge + width, box) * mix(1.0, 0.35, roughness);
}

/// Irradiance / pi of the same environment on a surface with this normal (world).
vec3 environmentDiffuse(vec3 normal) {
    float up = 0.5 + 0.5 * normal.y;
    vec3 dome = mix(kFloor, mix(kHorizon, kZenith, 0.45), smoothstep(0.0, 1.0, up));
    return dome + 0.12 * kSoftBox * max(0.0, 0.3 + 0.7 * dot(normal, kKeyDirection));
}

/// Directional albedo of GGX, split into scale and bias of F0 (Karis, "Physically Based Shading on Mobile", 2014).
vec2 environmentBrdf(float roughness, float n_dot_v) {
    const vec4 c0 = vec4(-1.0, -0.0275, -0.572, 0.022), c1 = vec4(1.0, 0.0425, 1.04, -0.04);
    vec4 r = roughness * c0 + c1;
    float a004 = min(r.x * r.x, exp2(-9.28 * n_dot_v)) * r.x + r.y;
    return vec2(-1.04, 1.04) * a004 + r.zw;
}

/// GGX with height-correlated Smith visibility and Schlick's Fresnel term.
vec3 specularLobe(vec3 f0, float alpha, float n_dot_l, float n_dot_v, float n_dot_h, float v_dot_h) {
    float a2 = alpha * alpha;
    float d = n_dot_h * n_dot_h * (a2 - 1.0) + 1.0;
    float distribution = a2 / (kPi * d * d);
    float visibility = 0.5 / max(n_dot_l * sqrt(n_dot_v * n_dot_v * (1.0 - a2) + a2) +
                                     n_dot_v * sqrt(n_dot_l * n_dot_l * (1.0 - a2) + a2),
                                 1e-6);
    vec3 fresnel = f0 + (1.0 - f0) * pow(1.0 - v_dot_h, 5.0);
    return fresnel * distribution * visibility;
}

/// The surface at a fragment, as the BRDF takes it; directions in world space.
struct Reflector {
    vec3 diffuse, f0;
    float alpha, n_dot_v;
    vec3 n, v;
};

/// Radiance toward the viewer for light of irradiance 1 (at normal incidence) from the unit direction `l`, but for
/// the cosine at the surface, which is returned in `n_dot_l`.
vec3 reflectance(Reflector s, vec3 l, out float n_dot_l) {
    vec3 h = normalize(s.v + l);
    n_dot_l = clamp(dot(s.n, l), 0.0, 1.0);
    float v_dot_h = clamp(dot(s.v, h), 0.0, 1.0);
    vec3 lobe = specularLobe(s.f0, s.alpha, n_dot_l, s.n_dot_v, clamp(dot(s.n, h), 0.0, 1.0), v_dot_h);
    vec3 fresnel = s.f0 + (1.0 - s.f0) * pow(1.0 - v_dot_h, 5.0);
    return (1.0 - fresnel) * s.diffuse / kPi + lobe;
}

/// Outgoing radiance toward the viewer, not yet multiplied by alpha. `base` is baseColor().
vec3 litColor(vec3 base, Gradients g) {
    float metallic = material.factors.x, roughness = material.factors.y, occlusion = 1.0;
    vec3 emissive = material.emissive.rgb;
#ifdef TEXTURED
    if (hasTexture(PEELER_METALLIC_ROUGHNESS_UNIT)) {
        vec4 mr = sampled(metallic_roughness_texture, PEELER_METALLIC_ROUGHNESS_UNIT, g);
        roughness *= mr.g;
        metallic *= mr.b;
    }
    if (hasTexture(PEELER_OCCLUSION_UNIT)) {
        float r = sampled(occlusion_texture, PEELER_OCCLUSION_UNIT, g).r;
        occlusion = 1.0 + material.factors.w * (r - 1.0);
    }
    if (hasTexture(PEELER_EMISSIVE_UNIT))
        emissive *= sampled(emissive_texture, PEELER_EMISSIVE_UNIT, g).rgb;
#endif
    roughness = clamp(roughness, 0.0, 1.0);
    metallic = clamp(metallic, 0.0, 1.0);
    float alpha = max(roughness * roughness, 0.002);  // a mirror would need an infinitely small lamp

    mat3 world_from_view = mat3(frame.world_from_view);
    vec3 view = frame.flags.x != 0 ? vec3(0.0, 0.0, 1.0) : normalize(-surface.position);
    vec3 v = world_from_view * view, n = world_from_view * shadingNormal(g);
    float n_dot_v = clamp(dot(n, v), 1e-4, 1.0);

    vec3 diffuse = base * (1.0 - metallic);
    vec3 f0 = mix(vec3(0.04), base, metallic);

    vec2 scale_bias = environmentBrdf(roughness, n_dot_v);
    vec3 reflected = environmentRadiance(reflect(-v, n), roughness);
    vec3 specular = f0 * scale_bias.x + scale_bias.y;
    vec3 radiance = occlusion * (diffuse * (1.0 - specular) * environmentDiffuse(n) + specular * reflected);

    Reflector surface_here = Reflector(diffuse, f0, alpha, n_dot_v, n, v);
    float n_dot_l;
#ifdef PUNCTUAL
    radiance *= kFill;
    for (uint i = 0u; i < light_count.lights.x; ++i) {
        vec3 toward = towardLight(lights[i], surface.position);
        vec3 reflected_share = reflectance(surface_here, world_from_view * toward, n_dot_l);
        if (n_dot_l <= 0.0) continue;
        vec3 light = irradiance(lights[i], surface.position, toward);
#ifdef SHADOWED
        light *= visibility(lights[i], surface.position);
#endif
        radiance += light * n_dot_l * reflected_share;
    }
#else
    vec3 reflected_share = reflectance(surface_here, kKeyDirection, n_dot_l);
    vec3 key = kKeyRadiance;
#ifdef SHADOWED
    if (n_dot_l > 0.0) key *= visibility(lights[0], surface.position);
#endif
    radiance += key * n_dot_l * reflected_share;
#endif
    return radiance + emissive;
}
