// SPDX-License-Identifier: Apache-2.0
// The colour of an accepted fragment, as every method stores it.
#include "lighting.glsl"
#include "packed_color.glsl"
#ifdef TRANSMISSION
#include "transmission.glsl"
#endif

/// NVIDIA's compiler (580.159) takes unpackHalf2x16(packHalf2x16(x)) for x, which methods that do not store a colour would
/// composite without its rounding: it is not to know that the one belongs to the other.
PACKED_COLOR rounded(vec4 color) { return packColor(color) | PACKED_COLOR(frame.limits.w); }

/// Premultiplied linear colour of a fragment whose baseColor() is `base`; with TINTED the opacity of every channel, too.
StoredColor fragmentColor(vec4 base, Gradients g) {
    vec3 rgb = base.rgb;
    float alpha = coverage(base.a);
    float passing = 0.0;  // the share of light that passes in place of being diffused
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
    // What a half holds, whatever the vertex colours; no NaN (a degenerate facet), which would spoil the
    // composite; and nothing negative, which interpolation at a snapped vertex gives, and light is not.
    rgb = clamp(rgb * alpha, vec3(0.0), vec3(65504.0));
    rgb = mix(rgb, vec3(0.0), isnan(rgb));
    StoredColor stored;
#ifdef TINTED
    stored.opacity = rounded(vec4(opacity, 0.0));
    opacity = unpackColor(stored.opacity).rgb;  // alpha is the mean of what is stored
    bool grey = opacity.r == opacity.g && opacity.g == opacity.b;
    opacity.r = grey ? opacity.r : (opacity.r + opacity.g + opacity.b) / 3.0;
#endif
    stored.color = rounded(vec4(rgb, opacity.r));
    return stored;
}

/// The same as it is composited: what a stored fragment's colour unpacks to.
vec4 compositedColor(StoredColor stored) { return unpackColor(stored.color); }
vec4 compositedColor(vec4 base, Gradients g) { return compositedColor(fragmentColor(base, g)); }
