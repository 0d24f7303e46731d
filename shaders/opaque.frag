// SPDX-License-Identifier: Apache-2.0
// The nearest opaque fragment (OPAQUE and MASK, not transmissive) with its colour. The depth test finds it, so that what
// lies behind what has been drawn is not shaded; of equal depths it keeps the first drawn, which is the first by key.
#include "shade.glsl"

// Its depth, as bits; the key of the first primitive of its draw; its colour, if that is of halfs.
layout(location = 0) out uvec4 fragment;
#ifdef COLOR_FLOAT
layout(location = 1) out uvec4 color;
#endif

void main() {
    Gradients gradients = surfaceGradients();
    vec4 base = baseColor(gradients);
    if (!passesAlphaTest(base.a)) discard;
#ifdef CLIPPED
    if (!isKept(gl_FragCoord.z)) discard;
#endif
#ifdef COLOR_FLOAT
    fragment = uvec4(floatBitsToUint(gl_FragCoord.z), first_key, 0u, 0u);
    color = fragmentColor(base, gradients).color;
#else
    fragment = uvec4(floatBitsToUint(gl_FragCoord.z), first_key, fragmentColor(base, gradients).color);
#endif
}
