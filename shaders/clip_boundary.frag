// SPDX-License-Identifier: Apache-2.0
// The surfaces of a clip mesh. The first pass counts them per pixel (COUNT). The second pass stores
// their depths and facings.
#include "fragment.glsl"

layout(location = 0) uniform ivec4 argument;  // x: capacity of the buffer, in surfaces

layout(std430, binding = PEELER_LIST_HEADS) buffer ListHeads { uint list_heads[]; };
layout(std430, binding = PEELER_CLIP_DEPTHS) writeonly buffer ClipDepths { float clip_depths[]; };

void main() {
    uint entry = atomicAdd(list_heads[pixelIndex()], 1u);
#ifndef COUNT
    // GL clamps depths beyond the near and far planes, but perhaps only after this shader. The sign
    // of the stored depth gives the facing.
    float depth = clamp(gl_FragCoord.z, 0.0, 1.0);
    if (entry < uint(argument.x)) clip_depths[entry] = gl_FrontFacing ? depth : -depth;
#endif
}
