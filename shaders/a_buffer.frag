// SPDX-License-Identifier: Apache-2.0
// Counted A-buffer: every fragment goes to the next free slot of its pixel's list (Carpenter 1984; the
// exact allocation from a count pass after Vasilakis & Fudos' S-buffer 2012).
#include "shade.glsl"

layout(std430, binding = PEELER_SLOTS) buffer Slots { uint slots[]; };
layout(std430, binding = PEELER_DEPTHS) writeonly buffer Depths { float depths[]; };
layout(std430, binding = PEELER_PRIMITIVES) writeonly buffer Primitives { uint primitives[]; };
layout(std430, binding = PEELER_COLORS) writeonly buffer Colors { PACKED_COLOR colors[]; };

void main() {
    Gradients gradients = surfaceGradients();
    vec4 base = baseColor(gradients);
    if (!passesAlphaTest(base.a)) discard;
    Key key = fragmentKey();
    if (!inRange(key)) discard;

    uint slot = atomicAdd(slots[pixelIndex()], 1u);
    if (slot >= frame.limits.x) return;  // more than counted: the check after the pass reports it
    depths[slot] = key.depth;
    primitives[slot] = key.primitive;
    colors[slot] = fragmentColor(base, gradients);
}
