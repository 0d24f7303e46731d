// SPDX-License-Identifier: Apache-2.0
// Unordered sums of a pixel's fragments. Weighted average and weighted sum take all fragments. The
// tail of a composite with a layer limit takes only the fragments behind the last layer (BEHIND).
#include "shade.glsl"

#ifdef BEHIND
layout(binding = PEELER_PREVIOUS_DEPTH_UNIT) uniform sampler2D previous_depth;
layout(binding = PEELER_PREVIOUS_PRIMITIVE_UNIT) uniform usampler2D previous_primitive;
#else
layout(std430, binding = PEELER_DEPTHS) buffer Depths { uint depth_bits[]; };  // bits of positive floats sort like the floats
#endif

layout(location = 0) out vec4 sum;  // sum of premultiplied colours
layout(location = 1) out float count;
#ifdef TINTED
layout(location = 2) out vec4 opacity_sum;
#endif

void main() {
    Gradients gradients = surfaceGradients();
    vec4 base = baseColor(gradients);
    if (!passesAlphaTest(base.a)) discard;
    Key key = fragmentKey();
    if (!inRange(key)) discard;
#ifdef BEHIND
    ivec2 at = ivec2(gl_FragCoord.xy);
    Key previous = Key(texelFetch(previous_depth, at, 0).r, texelFetch(previous_primitive, at, 0).r);
    if (!precedes(previous, key)) discard;
#else
    atomicMax(depth_bits[pixelIndex()], floatBitsToUint(key.depth));
#endif
    StoredColor stored = fragmentColor(base, gradients);
    sum = compositedColor(stored);
#ifdef TINTED
    opacity_sum = unpackColor(stored.opacity);
#endif
    count = 1.0;
}
