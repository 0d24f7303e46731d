// SPDX-License-Identifier: Apache-2.0
// Fragments as they come, for plain blending in draw order.
#include "shade.glsl"

layout(std430, binding = PEELER_SLOTS) buffer Slots { uint slots[]; };
layout(std430, binding = PEELER_DEPTHS) buffer Depths { uint depth_bits[]; };  // they order like the floats

layout(location = 0) out vec4 color;

void main() {
    Gradients gradients = surfaceGradients();
    vec4 base = baseColor(gradients);
    if (!passesAlphaTest(base.a)) discard;
    Key key = fragmentKey();
    if (!inRange(key)) discard;
    uint pixel = pixelIndex();
    atomicAdd(slots[pixel], 1u);
    atomicMax(depth_bits[pixel], floatBitsToUint(key.depth));
    color = compositedColor(base, gradients);
}
