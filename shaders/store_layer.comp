// SPDX-License-Identifier: Apache-2.0
// Appends a peeled layer, held in textures of a raster tile, to the lists of a band.
#include "interface.glsl"
#include "stored_fragments.glsl"

layout(local_size_x = 16, local_size_y = 16) in;

layout(std140, binding = PEELER_FRAME_BLOCK) uniform FrameBlock { FrameRecord frame; };
layout(location = 0) uniform ivec4 area;  // x0, y0, x1, y1 inside the tile, y up

layout(binding = PEELER_PREVIOUS_DEPTH_UNIT) uniform sampler2D layer_depth;
layout(binding = PEELER_PREVIOUS_PRIMITIVE_UNIT) uniform usampler2D layer_primitive;
layout(binding = PEELER_PREVIOUS_COLOR_UNIT) uniform usampler2D layer_color;
#ifdef TINTED
layout(binding = PEELER_LAYER_OPACITY_UNIT) uniform usampler2D layer_opacity;
#endif

layout(std430, binding = PEELER_LIST_HEADS) buffer ListHeads { uint list_heads[]; };

void main() {
    ivec2 at = area.xy + ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, area.zw))) return;
    uint primitive = texelFetch(layer_primitive, at, 0).r;
    if (primitive == 0u) return;  // the pixel has no such layer
    int x = frame.tile.x + at.x - frame.band.x;
    int y = frame.tile.y + frame.tile.w - 1 - at.y - frame.band.y;
    uint pixel = uint(y * frame.band.z + x);
    uint entry = list_heads[pixel];
    list_heads[pixel] = entry + 1u;
    if (!hasEntry(entry)) return;
    StoredColor color;
    color.color = packedTexel(texelFetch(layer_color, at, 0));
#ifdef TINTED
    color.opacity = packedTexel(texelFetch(layer_opacity, at, 0));
#endif
    storeFragment(entry, texelFetch(layer_depth, at, 0).r, primitive, color);
}
