// SPDX-License-Identifier: Apache-2.0
// Fragments in draw order, for plain blending. With TINTED, one pass writes colours, blended by the
// opacity per channel, and a second pass writes opacities (OPACITY). Two passes are needed because
// dual-source blending allows only one target.
#include "shade.glsl"

layout(std430, binding = PEELER_LIST_HEADS) buffer ListHeads { uint list_heads[]; };
layout(std430, binding = PEELER_DEPTHS) buffer Depths { uint depth_bits[]; };  // bits of positive floats sort like the floats

#ifdef OPACITY
layout(location = 0) out vec4 opacity;
#else
layout(location = 0, index = 0) out vec4 color;
#ifdef TINTED
layout(location = 0, index = 1) out vec4 opacity;
#endif
#endif

void main() {
    Gradients gradients = surfaceGradients();
    vec4 base = baseColor(gradients);
    if (!passesAlphaTest(base.a)) discard;
    Key key = fragmentKey();
    if (!inRange(key)) discard;
    StoredColor stored = fragmentColor(base, gradients);
#ifdef TINTED
    opacity = unpackColor(stored.opacity);
#endif
#ifndef OPACITY
    uint pixel = pixelIndex();
    atomicAdd(list_heads[pixel], 1u);
    atomicMax(depth_bits[pixel], floatBitsToUint(key.depth));
    color = compositedColor(stored);
#endif
}
