// SPDX-License-Identifier: Apache-2.0
// Lighting of a surface (glTF 2.0, appendix B, and the KHR_materials extensions).
//
// If the scene has no lights, there is one key light (directional, warm white, from above, left and in front of a
// viewer who looks along -Z) and the built-in environment. A white diffuse surface that faces the key light has a
// radiance of about 1.
//
// With PUNCTUAL, the scene has its own lights, in photometric units: 1 lux on a white diffuse surface gives a radiance
// of 1 / pi. The key light is off, and the built-in environment is dimmed to a fill light.
//
// With ENVIRONMENT, an image lights the scene, and there is no built-in light.
#include "surface.glsl"
#if defined(PUNCTUAL) || defined(SHADOWED)
#include "lights.glsl"
#endif
#ifdef SHADOWED
#include "shadows.glsl"
#endif

const vec3 kKeyDirection = PEELER_KEY_DIRECTION;
const vec3 kKeyRadiance = vec3(2.15, 2.05, 1.90);  // irradiance at normal incidence
const float kFill = 0.1;  // factor of the built-in environment if there are punctual lights
#include "environment.glsl"
#include "reflector.glsl"

/// Returns the outgoing radiance toward the viewer, not yet multiplied by alpha. `base` is baseColor(). `passing` is
/// the fraction of the diffuse light that is transmitted.
vec3 litColor(vec3 base, float passing, Gradients g) {
    float occlusion = 1.0;
#ifdef TEXTURED
    if (hasTexture(PEELER_OCCLUSION_UNIT)) {
        float r = sampled(occlusion_texture, PEELER_OCCLUSION_UNIT, g).r;
        occlusion = 1.0 + material_factors.w * (r - 1.0);
    }
#endif
    Reflector s = reflectorOf(base, g);
#ifdef TRANSMISSION
    s.diffuse *= 1.0 - passing;
#endif
    vec3 radiance = reflectedEnvironment(s, occlusion);
#ifdef CLEARCOAT
    vec3 varnish = occlusion * coatEnvironment(s);
#endif
#if defined(PUNCTUAL)
#ifndef ENVIRONMENT
    radiance *= kFill;
#ifdef CLEARCOAT
    varnish *= kFill;
#endif
#endif
    for (uint i = 0u; i < light_count.lights.x; ++i) {
        vec3 toward = towardLight(lights[i], surface.position);
        vec3 l = world_from_view * toward;
        if (!isLit(s, l)) continue;
        vec3 light = irradiance(lights[i], surface.position, toward);
#ifdef SHADOWED
        light *= visibility(lights[i], surface.position);
#endif
        radiance += light * facing(s, l) * reflectance(s, l);
#ifdef CLEARCOAT
        varnish += light * coatReflectance(s, l);
#endif
    }
#elif !defined(ENVIRONMENT)
    // The factors have the same order as in the loop. The cosine between the key light and the reflectance keeps
    // compilers from folding the constants of the key light and the lobes. So fully lit pixels are bit-identical with
    // and without shadows.
    vec3 key = kKeyRadiance;
#ifdef SHADOWED
    if (isLit(s, kKeyDirection)) key *= visibility(lights[0], surface.position);
#endif
    radiance += key * facing(s, kKeyDirection) * reflectance(s, kKeyDirection);
#ifdef CLEARCOAT
    varnish += key * coatReflectance(s, kKeyDirection);
#endif
#endif
    radiance += emissiveColor(g);
#ifdef CLEARCOAT
    radiance = (1.0 - s.coat) * radiance + varnish;
#endif
    return radiance;
}
