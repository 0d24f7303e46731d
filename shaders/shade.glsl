// SPDX-License-Identifier: Apache-2.0
// The colour of an accepted fragment, in the storage format of every method.
#include "lighting.glsl"
#include "packed_color.glsl"
#ifdef TRANSMISSION
#include "transmission.glsl"
#endif

/// Packs a colour so that the compiler cannot drop the rounding. NVIDIA's compiler (580.159) replaces
/// unpackHalf2x16(packHalf2x16(x)) by x. Methods that do not store colours would then composite unrounded colours. The
/// OR with limits.w prevents this.
PACKED_COLOR rounded(vec4 color) { return packColor(color) | PACKED_COLOR(frame.limits.w); }

/// Returns the premultiplied linear colour of a fragment with base colour `base` (baseColor()); with TINTED, also the
/// opacity per channel.
StoredColor fragmentColor(vec4 base, Gradients g) {
    vec3 rgb = base.rgb;
    float alpha = coverage(base.a);
    float passing = 0.0;  // fraction of light that is transmitted instead of diffusely reflected
    vec3 opacity = vec3(alpha);
#ifdef TRANSMISSION
    if (isTintedGlass()) {
        passing = transmittedShare(g);
        opacity *= 1.0 - passingColors(base.rgb, passing, g);
    } else {
        passing = passingLight(base.rgb, g);
        opacity *= 1.0 - passing;
    }
    rgb = base.rgb * (1.0 - passing);
#endif
#ifndef UNLIT
    bool lit = (MATERIAL_FLAGS & PEELER_UNLIT) == 0u &&
               (DRAW_FLAGS & (PEELER_HAS_NORMALS | PEELER_IS_TRIANGLES)) != 0u;
    if (lit) rgb = litColor(base.rgb, passing, g);
#endif
    // Limits colours to the range of a half. Vertex colours may have any size, and interpolation at
    // a snapped vertex may give negative colours. Replaces NaN (from a degenerate facet), which
    // would spoil the composite.
    rgb = clamp(rgb * alpha, vec3(0.0), vec3(65504.0));
    rgb = mix(rgb, vec3(0.0), isnan(rgb));
    StoredColor stored;
#ifdef TINTED
    stored.opacity = rounded(vec4(opacity, 0.0));
    opacity = unpackColor(stored.opacity).rgb;  // rounded as stored, because alpha is the mean of the stored values
    bool grey = opacity.r == opacity.g && opacity.g == opacity.b;
    opacity.r = grey ? opacity.r : (opacity.r + opacity.g + opacity.b) / 3.0;
#endif
    stored.color = rounded(vec4(rgb, opacity.r));
    return stored;
}

/// Returns the colour to composite: the unpacked colour of a stored fragment.
vec4 compositedColor(StoredColor stored) { return unpackColor(stored.color); }
vec4 compositedColor(vec4 base, Gradients g) { return compositedColor(fragmentColor(base, g)); }
