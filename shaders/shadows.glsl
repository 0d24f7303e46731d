// SPDX-License-Identifier: Apache-2.0
// Midpoint shadow maps (Woo 1992): the fraction of a light that arrives at a point.

layout(binding = PEELER_SHADOW_UNIT) uniform sampler2DArray shadow_maps;

/// Returns 1 if nothing at this texel is between the light and `depth`, or if the texel is outside the map.
float litAt(ivec3 texel, float depth) {
    ivec2 size = textureSize(shadow_maps, 0).xy;
    if (any(lessThan(texel.xy, ivec2(0))) || any(greaterThanEqual(texel.xy, size))) return 1.0;
    return depth > texelFetch(shadow_maps, texel, 0).r ? 0.0 : 1.0;
}

/// Returns the fraction of light that arrives. This is the interpolated result of depth tests
/// against the four nearest texels; it is exactly 1 if all four pass. `position` is in view space.
float visibility(LightRecord light, vec3 position) {
    if (light.map.x < 0.0) return 1.0;
    // `precise`, so that every pass compares the same depth.
    precise vec3 at = (light.map_from_view * vec4(position, 1.0)).xyz;
    if (light.map.y != 0.0) {
        if (!(at.z > 0.0)) return 1.0;  // behind a spot light
        at.xy /= at.z;
    }
    float size = float(textureSize(shadow_maps, 0).x);
    precise vec2 place = clamp((0.5 + 0.5 * vec2(at.x, -at.y)) * size - 0.5, -2.0, size + 1.0);
    vec2 base = floor(place), share = place - base;
    ivec3 texel = ivec3(base, int(light.map.x));
    float upper_left = litAt(texel, at.z), upper_right = litAt(texel + ivec3(1, 0, 0), at.z);
    float lower_left = litAt(texel + ivec3(0, 1, 0), at.z), lower_right = litAt(texel + ivec3(1, 1, 0), at.z);
    float upper = upper_left + share.x * (upper_right - upper_left);
    float lower = lower_left + share.x * (lower_right - lower_left);
    return upper + share.y * (lower - upper);
}
