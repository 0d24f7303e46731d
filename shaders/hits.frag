// SPDX-License-Identifier: Apache-2.0
// The hits of rays: like a_buffer.frag, without looking at what surfaces look like.
#ifdef ALPHA_TEST
#include "surface.glsl"
#else
#include "fragment.glsl"
#endif

layout(std430, binding = PEELER_SLOTS) buffer Slots { uint slots[]; };
layout(std430, binding = PEELER_DEPTHS) writeonly buffer Depths { float depths[]; };
layout(std430, binding = PEELER_PRIMITIVES) writeonly buffer Primitives { uint primitives[]; };
#ifdef SLOPES
layout(std430, binding = PEELER_COLORS) writeonly buffer Slopes { vec2 slopes[]; };  // of the depth, a pixel; y up
noperspective in float clip_depth;
#endif

void main() {
#ifdef SLOPES
    vec2 slope = vec2(dFdx(clip_depth), dFdy(clip_depth));
#endif
#ifdef ALPHA_TEST
    if (!passesAlphaTest(baseColor(surfaceGradients()).a)) discard;
#endif
    Key key = fragmentKey();
    if (!inRange(key)) discard;
    uint slot = atomicAdd(slots[pixelIndex()], 1u);
    if (slot >= frame.limits.x) return;  // more than counted: the check after the pass reports it
    depths[slot] = key.depth;
    primitives[slot] = key.primitive;
#ifdef SLOPES
    slopes[slot] = slope;
#endif
}
