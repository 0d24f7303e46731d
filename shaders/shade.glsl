// SPDX-License-Identifier: Apache-2.0
// The colour of an accepted fragment, as every method stores it.
#include "lighting.glsl"
#include "packed_color.glsl"
#ifdef TRANSMISSION
#include "transmission.glsl"
#endif

/// Premultiplied linear colour of a fragment whose baseColor() is `base`.
PACKED_COLOR fragmentColor(vec4 base, Gradients g) {
    vec3 rgb = base.rgb;
    float alpha = coverage(base.a), passing = 0.0;
#ifdef TRANSMISSION
    passing = passingLight(base.rgb, g);
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
    return packColor(vec4(mix(rgb, vec3(0.0), isnan(rgb)), alpha * (1.0 - passing)));
}

/// The same as it is composited: what a stored fragment's colour unpacks to.
vec4 compositedColor(vec4 base, Gradients g) { return unpackColor(fragmentColor(base, g)); }
