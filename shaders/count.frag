// SPDX-License-Identifier: Apache-2.0
// The count pass: how many fragments every pixel has.
#ifdef ALPHA_TEST
#include "surface.glsl"
#else
#include "fragment.glsl"
#endif

layout(std430, binding = PEELER_SLOTS) buffer Slots { uint slots[]; };

void main() {
#ifdef ALPHA_TEST
    if (!passesAlphaTest(baseColor(surfaceGradients()).a)) discard;
#endif
    if (!inRange(fragmentKey())) discard;
    atomicAdd(slots[pixelIndex()], 1u);
}
