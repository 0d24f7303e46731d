// SPDX-License-Identifier: Apache-2.0
// The nearest opaque fragment (OPAQUE and MASK, not transmissive) with its colour. The depth test
// selects the fragment, so fragments behind those already drawn are not shaded. Among equal depths,
// the test keeps the fragment drawn first, which has the smallest key.
#include "shade.glsl"

// x: the bits of the depth; y: the key of the first primitive of the draw; zw: the colour, if it is
// stored as halfs.
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
