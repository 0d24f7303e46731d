// SPDX-License-Identifier: Apache-2.0
// Unordered sums of a pixel's fragments. Weighted average and weighted sum take all fragments. The
// tail of a composite with a layer limit takes only the fragments behind the last layer (BEHIND). DEPTH_WEIGHTS and
// MOMENT_WEIGHTS weight each fragment by its depth (core/peel/weighted_blended.cpp, core/peel/moment_based.cpp).
#include "shade.glsl"
#ifdef MOMENT_WEIGHTS
#include "moments.glsl"
layout(binding = PEELER_MOMENTS_UNIT) uniform sampler2D moment_sums;
layout(binding = PEELER_ABSORBANCE_UNIT) uniform sampler2D absorbance_sum;
#endif

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
#ifdef DEPTH_WEIGHTS
#ifdef TINTED
layout(location = 3) out vec4 covered;
#else
layout(location = 2) out vec4 covered;
#endif

/// Returns the weight of McGuire and Bavoil 2013, equation 7.
float depthWeight(float alpha) {
    float z = viewDistance(gl_FragCoord.z);
    float near = z / 5.0, far = z / 200.0;
    return alpha * clamp(10.0 / (1e-5 + near * near + far * far * far * far * far * far), 1e-2, 3e3);
}
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
#ifdef DEPTH_WEIGHTS
    covered = vec4(sum.a);
#ifdef TINTED
    covered = opacity_sum;
#endif
#endif
#if defined(DEPTH_WEIGHTS) || defined(MOMENT_WEIGHTS)
#ifdef DEPTH_WEIGHTS
    float weight = depthWeight(sum.a);
#else
    ivec2 place = ivec2(gl_FragCoord.xy);
    float weight = transmittanceAt(momentDepth(gl_FragCoord.z), texelFetch(moment_sums, place, 0),
                                   texelFetch(absorbance_sum, place, 0).r);
#endif
    sum *= weight;
#ifdef TINTED
    opacity_sum *= weight;
#endif
#endif
    count = 1.0;
}
