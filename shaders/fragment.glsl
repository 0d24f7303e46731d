// SPDX-License-Identifier: Apache-2.0
// What a fragment is: where it lies, its key (depth, primitive), and whether it counts (architecture.md,
// "What a fragment is"). Every pass of every method includes this, so that all agree.
#include "interface.glsl"

layout(std140, binding = PEELER_FRAME_BLOCK) uniform FrameBlock { FrameRecord frame; };
layout(std140, binding = PEELER_DRAW_BLOCK) uniform DrawBlock { DrawRecord draw; };

#ifdef BOUNDED
layout(binding = PEELER_OPAQUE_DEPTH_UNIT) uniform sampler2D opaque_depth;
layout(binding = PEELER_OPAQUE_PRIMITIVE_UNIT) uniform usampler2D opaque_primitive;
#endif

struct Key {
    float depth;     // reversed Z: larger is nearer
    uint primitive;  // draw order: smaller comes first among equal depths
};

/// True if a comes before b, front to back.
bool precedes(Key a, Key b) {
    return a.depth > b.depth || (a.depth == b.depth && a.primitive < b.primitive);
}

Key fragmentKey() { return Key(gl_FragCoord.z, draw.ids.x + uint(gl_PrimitiveID)); }

/// Index into the band's per-pixel arrays.
uint pixelIndex() {
    int x = frame.tile.x + int(gl_FragCoord.x) - frame.band.x;
    int y = frame.tile.y + frame.tile.w - 1 - int(gl_FragCoord.y) - frame.band.y;
    return uint(y * frame.band.z + x);
}

/// Near and far plane and, with BOUNDED, the nearest opaque fragment, which itself stays.
bool inRange(Key key) {
    if (!(key.depth > 0.0)) return false;  // the far plane is exclusive
#ifdef BOUNDED
    ivec2 at = ivec2(gl_FragCoord.xy);
    Key nearest_opaque = Key(texelFetch(opaque_depth, at, 0).r, texelFetch(opaque_primitive, at, 0).r);
    if (precedes(nearest_opaque, key)) return false;
#endif
    return true;
}
