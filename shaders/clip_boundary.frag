// SPDX-License-Identifier: Apache-2.0
// The surfaces of a clip mesh: how many a pixel has (COUNT), then where they lie and which way they face.
#include "fragment.glsl"

layout(location = 0) uniform ivec4 argument;  // x: surfaces that the buffer holds

layout(std430, binding = PEELER_LIST_HEADS) buffer ListHeads { uint list_heads[]; };
layout(std430, binding = PEELER_CLIP_DEPTHS) writeonly buffer ClipDepths { float clip_depths[]; };

void main() {
    uint entry = atomicAdd(list_heads[pixelIndex()], 1u);
#ifndef COUNT
    // GL clamps what lies beyond the planes, but may do so after this shader; the sign is the side's.
    float depth = clamp(gl_FragCoord.z, 0.0, 1.0);
    if (entry < uint(argument.x)) clip_depths[entry] = gl_FrontFacing ? depth : -depth;
#endif
}
